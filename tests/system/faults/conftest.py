"""The misbehaving FMU, compiled once per session."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from command_runner import CommandRunner
from fault_fmu import FaultFmus, build_library


@pytest.fixture(scope="session")
def fault_libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("fault")
    return {version: build_library(version, folder) for version in (2, 3)}


@pytest.fixture
def fmus(fault_libraries: dict[int, Path], tmp_path: Path) -> FaultFmus:
    return FaultFmus(fault_libraries, tmp_path)


@pytest.fixture(params=[2, 3], ids=["FMI2", "FMI3"])
def version(request: pytest.FixtureRequest) -> int:
    number: int = request.param
    return number


@pytest.fixture(scope="session")
def runner() -> Iterator[CommandRunner]:
    runner = CommandRunner()
    yield runner
    runner.close()
