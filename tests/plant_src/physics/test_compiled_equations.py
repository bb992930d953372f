"""Loading compiled equations from a plant FMU: they must have the interface of the program."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from world_harness import WorldHarness, quadcopter_settings

from cosim.core import resources
from cosim.core.errors import InputError
from cosim.core.units import parse_unit
from plant_src.catalogue import MODELS, Model
from plant_src.physics import compiled_equations
from plant_src.physics.compiled_equations import CompiledEquations


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
        match=r'vehicle model "multirotor" cannot be read from ".*multirotor.fmu": .*No such file',
    ):
        CompiledEquations(MODELS["ar_drone"])


def test_a_broken_fmu_is_named(root: Path) -> None:
    (root / "fmus" / "multirotor.fmu").write_bytes(b"no archive")
    with pytest.raises(
        InputError, match=r'cannot be read from ".*multirotor.fmu": File is not a zip file'
    ):
        CompiledEquations(MODELS["ar_drone"])


def test_an_fmu_for_other_platforms_is_named(root: Path) -> None:
    with ZipFile(root / "fmus" / "multirotor.fmu", "w") as archive:
        archive.writestr("binaries/mars64/multirotor.so", "")
    with pytest.raises(
        InputError,
        match=r'"binaries/.*/multirotor\..*"; rebuild it with `cosim build .*` on this platform',
    ):
        CompiledEquations(MODELS["ar_drone"])


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


OTTER = MODELS["otter"]
STATES = OTTER.states


def changed_model(variable_name: str = "", **changes: Any) -> Model:
    """Return the Otter with other properties of one variable."""
    changed = [
        replace(variable, **changes) if variable.name == variable_name else variable
        for variable in OTTER.interface
    ]
    return replace(OTTER, interface=changed)


def swapped(first: str, second: str) -> Model:
    """Return the Otter whose equations would have two parameters in the other order."""
    names = {first: second, second: first}
    by_name = {variable.name: variable for variable in OTTER.interface}
    order = [by_name[names.get(name, name)] for name in by_name]
    return replace(OTTER, interface=order)


@pytest.mark.parametrize(
    ("model", "found", "expected"),
    [
        (
            changed_model("payload_mass", name="cargo_mass"),
            "parameter payload_mass (Float64, kg)",
            "parameter cargo_mass (Float64, kg)",
        ),
        (
            changed_model("payload_mass", unit=parse_unit("g")),
            "parameter payload_mass (Float64, kg)",
            "parameter payload_mass (Float64, g)",
        ),
        (
            changed_model("wave.phase", shape=(63,), start=(0.0,) * 63),
            "parameter wave.phase[64] (Float64, rad)",
            "parameter wave.phase[63] (Float64, rad)",
        ),
        (
            changed_model("wind.x", causality="parameter"),
            "input wind.x (Float64, m/s)",
            "parameter wind.x (Float64, m/s)",
        ),
        (
            swapped("initial.rates.p", "initial.rates.q"),
            "parameter initial.rates.p (Float64, rad/s)",
            "parameter initial.rates.q (Float64, rad/s)",
        ),
        (
            replace(OTTER, states=[STATES[1], STATES[0], *STATES[2:]]),
            "state origin.x",
            "state origin.y",
        ),
        (
            replace(OTTER, interface=OTTER.interface[:-1]),
            "output ditched (Boolean, no unit)",
            "nothing",
        ),
    ],
    ids=["name", "unit", "size", "role", "order", "order of states", "number"],
)
def test_equations_of_other_variables_are_refused(model: Model, found: str, expected: str) -> None:
    source = resources.root() / "plant_src" / "vehicles" / "otter" / "equations.py"
    with pytest.raises(InputError) as error:
        CompiledEquations(model)
    assert str(error.value) == (
        f'"{resources.root() / "fmus" / "otter.fmu"}" was built from other variables: found '
        f'"{found}", expected "{expected}"; rebuild it with `cosim build {source}`'
    )


def test_other_start_values_and_descriptions_are_the_same_equations() -> None:
    CompiledEquations(changed_model("payload_mass", start=3.0, minimum=1.0, description="cargo"))


def test_another_division_into_arrays_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("plant_src.catalogue.ENVIRONMENT_INPUTS", {"wind.x", "wave_gain"})
    with pytest.raises(
        InputError,
        match=r'array "inputs" of other size: found 8 elements, expected 12; rebuild it with `',
    ):
        CompiledEquations(changed_model())


def test_a_binary_without_a_description_of_its_interface_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shipped = resources.root() / "fmus" / "rudder.fmu"
    (tmp_path / "fmus").mkdir()
    with ZipFile(shipped) as archive, ZipFile(tmp_path / "fmus" / "otter.fmu", "w") as other:
        for name in archive.namelist():
            if name.startswith("binaries/"):
                other.writestr(name.replace("rudder", "otter"), archive.read(name))
    monkeypatch.setattr(resources, "root", lambda: tmp_path)
    with pytest.raises(
        InputError, match=r"was built by an older version of cosim; rebuild it with `cosim build "
    ):
        CompiledEquations(OTTER)


@pytest.mark.parametrize("difference", [-1, 1])
def test_an_array_of_another_size_is_not_bound(difference: int) -> None:
    equations = CompiledEquations(OTTER)
    sizes = equations.functions["contact_initialize"].sizes
    count = sizes["constants"]
    arrays = {name: np.zeros(size) for name, size in sizes.items()}
    equations.bind("contact_initialize", arrays)()
    with pytest.raises(
        ValueError, match=rf'"constants" has {count + difference} elements, expected {count}'
    ):
        equations.bind("contact_initialize", arrays | {"constants": np.zeros(count + difference)})


@pytest.mark.parametrize("array", [np.zeros(6, np.float32), np.zeros((6, 2))[:, 0]])
def test_an_array_of_another_layout_is_not_bound(array: np.ndarray) -> None:
    equations = CompiledEquations(OTTER)
    sizes = equations.functions["contact_predict"].sizes
    arrays = {name: np.zeros(size) for name, size in sizes.items()}
    with pytest.raises(TypeError, match='"contact_impulse" is not contiguous or not of type'):
        equations.bind("contact_predict", arrays | {"contact_impulse": array})
