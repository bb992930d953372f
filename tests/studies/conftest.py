"""Fixtures with a first-order lag FMU that has injectable faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from fault_fmu import build_library
from lag_project import LagProject, MakeLagProject


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
