"""The shipped controller FMUs, one tick at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from controller_fmu import ControllerFmu
from fmpy import extract

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """Folder with the contents of `fmus/NAME.fmu`."""

    @cache
    def unpack(name: str) -> str:
        return str(
            extract(
                str(ROOT / "fmus" / f"{name}.fmu"), str(tmp_path_factory.mktemp(Path(name).name))
            )
        )

    return unpack


@pytest.fixture
def controller(unpacked: Callable[[str], str]) -> Iterator[Callable[..., ControllerFmu]]:
    """`controller(NAME, parameters)` is an initialized instance of `fmus/NAME.fmu`."""
    instances: list[ControllerFmu] = []

    def instantiate(name: str, parameters: Mapping[str, Any] | None = None) -> ControllerFmu:
        instances.append(ControllerFmu(unpacked(name), parameters or {}))
        return instances[-1]

    yield instantiate
    for instance in instances:
        instance.close()
