"""The catalogue agrees with the equations of each model."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from zipfile import ZipFile

import numpy as np
import pytest
from fmpy import read_model_description

from cosim.core import resources
from plant_src.catalogue import MODELS, VEHICLE_MODELS
from plant_src.vehicles.common.interface import ENVIRONMENT_INPUTS

ALL = pytest.mark.parametrize("name", MODELS)


@ALL
def test_the_fmu_has_the_variables_of_the_catalogue(name: str) -> None:
    description = read_model_description(str(resources.root() / "fmus" / f"{name}.fmu"))
    expected = dict[str, str]()
    for variable in MODELS[name].interface:
        expected |= dict.fromkeys(variable.scalar_names, variable.causality)
    found = {variable.name: variable.causality for variable in description.modelVariables}
    assert found == expected


@ALL
def test_the_fmu_has_the_start_values_and_limits_of_the_catalogue(name: str) -> None:
    description = read_model_description(str(resources.root() / "fmus" / f"{name}.fmu"))
    found = {}
    for variable in description.modelVariables:
        if variable.causality == "parameter" and variable.type == "Real":
            texts = (variable.start, variable.min, variable.max)
            found[variable.name] = tuple(None if text is None else float(text) for text in texts)
    expected = {
        scalar: (start, variable.minimum, variable.maximum)
        for variable in MODELS[name].interface
        if variable.causality == "parameter" and variable.type == "Float64"
        for scalar, start in zip(variable.scalar_names, np.ravel(variable.start), strict=True)
    }
    assert found == expected


@pytest.mark.parametrize("name", ["strider", "strider_6dof", "otter"])
def test_the_fmu_has_the_compiled_functions_of_the_equations(name: str) -> None:
    """Their names and the sizes of their arrays, with which the world calls them."""
    pytest.importorskip("casadi")
    equations = import_module(f"plant_src.vehicles.{name}.equations")
    with ZipFile(resources.root() / "fmus" / f"{name}.fmu") as fmu:
        compiled = fmu.read("sources/model.c").decode()
    functions = compiled.partition("equations_functions[] =")[2]
    assert "contact_correct" in functions
    assert equations.block().files["model.c"].partition("equations_functions[] =")[2] == functions


@ALL
def test_environment_inputs_come_last_among_the_inputs(name: str) -> None:
    inputs = [
        variable.name in ENVIRONMENT_INPUTS
        for variable in MODELS[name].interface
        if variable.causality == "input"
    ]
    assert inputs == sorted(inputs)


def test_strider_moves_in_the_plane_by_default() -> None:
    assert [model.name for model in VEHICLE_MODELS["strider"].values()] == [
        "strider",
        "strider_6dof",
    ]
    assert next(iter(VEHICLE_MODELS["strider"])) == "planar"
    assert list(VEHICLE_MODELS["otter"]) == ["6dof"]


def test_a_run_reads_only_the_vehicles_that_it_uses() -> None:
    program = (
        "import cosim, sys; cosim.load('demo1_box').step(); "
        "from plant_src.catalogue import MODELS, VEHICLE_MODELS; "
        "print(sorted(MODELS._made), 'plant_src.vehicles.submerged.craft' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=resources.root(), capture_output=True, check=True
    )
    assert done.stdout.decode().split("\n")[0] == "['ar_drone', 'strider', 'strider_6dof'] False"
