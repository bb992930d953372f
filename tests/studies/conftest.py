"""Fixtures with a first-order lag FMU that has injectable faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import forked_fork_servers
import pytest
from fault_fmu import build_library
from lag_project import LagProject, MakeLagProject

from cosim.studies.execution import worker_pool

#: modules whose tests kill fork servers or measure their memory
REAL_PROCESSES = ("test_killed_sweeps", "test_sweep_memory")


@pytest.fixture(scope="session")
def make_lag(tmp_path_factory: pytest.TempPathFactory) -> MakeLagProject:
    """Function that creates a folder with the lag and its scenario."""
    library: Path = build_library(2, tmp_path_factory.mktemp("library"))

    def make(**more: Any) -> LagProject:
        return LagProject.create(tmp_path_factory.mktemp("lag"), library, **more)

    return make


@pytest.fixture
def lag(make_lag: MakeLagProject) -> LagProject:
    return make_lag()


@pytest.fixture(autouse=True)
def forked_servers(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork the fork servers of worker pools, except in the tests of their processes."""
    if request.path.stem not in REAL_PROCESSES:
        monkeypatch.setattr(worker_pool, "subprocess", forked_fork_servers.SUBPROCESS)
