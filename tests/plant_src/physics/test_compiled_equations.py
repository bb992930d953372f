"""Loading compiled equations from a plant FMU."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import pytest
from world_harness import WorldHarness, quadcopter_settings

from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.physics import compiled_equations


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installation without FMUs."""
    (tmp_path / "fmus").mkdir()
    monkeypatch.setattr(resources, "root", lambda: tmp_path)
    return tmp_path


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "cosim" / "plant"


@pytest.mark.usefixtures("root")
def test_a_missing_fmu_is_named() -> None:
    with pytest.raises(
        InputError,
        match=r'vehicle model "ar_drone" cannot be read from ".*ar_drone.fmu": .*No such file',
    ):
        compiled_equations.load_library("ar_drone")


def test_a_broken_fmu_is_named(root: Path) -> None:
    (root / "fmus" / "ar_drone.fmu").write_bytes(b"no archive")
    with pytest.raises(
        InputError, match=r'cannot be read from ".*ar_drone.fmu": File is not a zip file'
    ):
        compiled_equations.load_library("ar_drone")


def test_an_fmu_for_other_platforms_is_named(root: Path) -> None:
    with ZipFile(root / "fmus" / "ar_drone.fmu", "w") as archive:
        archive.writestr("binaries/mars64/ar_drone.so", "")
    with pytest.raises(
        InputError,
        match=r'"binaries/.*/ar_drone\..*"; build it on this platform with `cosim build`',
    ):
        compiled_equations.load_library("ar_drone")


def test_a_binary_is_unpacked_once_and_completely(cache: Path) -> None:
    for _ in range(2):
        WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 2.0])}).step()
    (library,) = cache.iterdir()
    with ZipFile(resources.root() / "fmus" / "multirotor.fmu") as archive:
        (member,) = [
            name for name in archive.namelist() if name.endswith(f"/multirotor{library.suffix}")
        ]
        assert library.read_bytes() == archive.read(member)


@pytest.mark.parametrize("content", [b"", b"\x7fELF", None])
def test_a_damaged_library_in_the_cache_is_replaced(cache: Path, content: bytes | None) -> None:
    library = compiled_equations.library_path("ar_drone")
    original = library.read_bytes()
    library.write_bytes(original[:-1] + b"!" if content is None else content)
    compiled_equations._cached_library_path.cache_clear()  # as in a new process
    assert compiled_equations.library_path("ar_drone") == library
    assert library.read_bytes() == original
    assert list(cache.iterdir()) == [library]
