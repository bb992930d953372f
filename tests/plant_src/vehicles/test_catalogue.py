"""The catalogue agrees with the equations of each model."""

from __future__ import annotations

import subprocess
import sys

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
