"""The misbehaving FMU, compiled once per session; the markers of this room."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from fault_fmu import SUPERVISED, FaultFmus, build_library
from fault_runs import Runner


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "supervised: needs runs in a child process")
    config.addinivalue_line("markers", "long: takes minutes; run with `pytest -m long`")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    for item in items:
        if item.get_closest_marker("supervised") and not SUPERVISED:
            item.add_marker(pytest.mark.skip("runs are not supervised yet"))
        if item.get_closest_marker("long") and "long" not in config.option.markexpr:
            item.add_marker(pytest.mark.skip("long: run with -m long"))


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
def runner() -> Iterator[Runner]:
    runner = Runner()
    yield runner
    runner.close()
