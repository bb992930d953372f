"""The catalogue agrees with the equations of each model."""

from __future__ import annotations

import importlib
from typing import Any

import casadi as ca
import pytest
from fmpy import read_model_description

from cosim.core import resources
from plant_src.catalogue import MODELS, SLOTS, VEHICLE_MODELS
from plant_src.vehicles.common.interface import ENVIRONMENT_INPUTS
from plant_src.vehicles.multirotor.airframe import MAX_ROTORS
from plant_src.vehicles.multirotor.equations import MultirotorEquations
from plant_src.vehicles.planar_vessel.equations import PlanarEquations
from plant_src.vehicles.planar_vessel.planar_vessel import PlanarVessel
from plant_src.vehicles.submerged.craft import MAX_THRUSTERS
from plant_src.vehicles.submerged.equations import SubmergedEquations
from plant_src.vehicles.surface_vessel.equations import FloatingEquations
from plant_src.vehicles.surface_vessel.surface_vessel import SurfaceVessel

ALL = pytest.mark.parametrize("name", MODELS)


def equations(name: str) -> Any:
    return importlib.import_module(f"plant_src.vehicles.{name}.equations")


@ALL
def test_the_fmu_has_the_variables_of_the_catalogue(name: str) -> None:
    description = read_model_description(str(resources.root() / "fmus" / f"{name}.fmu"))
    expected = {
        slot: variable.causality
        for variable in MODELS[name].interface
        for slot in variable.scalar_names
    }
    assert {
        variable.name: variable.causality for variable in description.modelVariables
    } == expected


@ALL
def test_environment_inputs_come_last_among_the_inputs(name: str) -> None:
    inputs = [
        variable.name in ENVIRONMENT_INPUTS
        for variable in MODELS[name].interface
        if variable.causality == "input"
    ]
    assert inputs == sorted(inputs)


@pytest.mark.parametrize(
    "name", [name for name, model in MODELS.items() if model.constant_count is not None]
)
def test_the_number_of_constants_is_that_of_the_equations(name: str) -> None:
    model = MODELS[name]
    if model.airframe:
        constants = MultirotorEquations(model.airframe, MAX_ROTORS).constants
    elif model.craft:
        constants = SubmergedEquations(model.craft, MAX_THRUSTERS).constants
    elif isinstance(model.boat, SurfaceVessel):
        constants = FloatingEquations(model.boat, SLOTS, name, "").model.constants
    elif isinstance(model.boat, PlanarVessel):
        constants = PlanarEquations(model.boat, SLOTS, name, "").constants
    else:
        constants = (
            getattr(equations(model.binary), "CONSTANTS", None)
            or equations(model.binary).VESSEL.constants
        )
    parameters = model.equation_parameters(model.start_values("parameter"))
    assert constants.vector(ca.SX(parameters)).numel() == model.constant_count


def test_strider_moves_in_the_plane_by_default() -> None:
    assert [model.name for model in VEHICLE_MODELS["strider"].values()] == [
        "strider",
        "strider_6dof",
    ]
    assert next(iter(VEHICLE_MODELS["strider"])) == "planar"
    assert list(VEHICLE_MODELS["otter"]) == ["6dof"]
