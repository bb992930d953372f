"""Controllers in Python against those in Modelica: in process, exported and in a whole mission."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from controller_fmu import PERIOD, ControllerFmu
from fmpy import extract

import cosim
from cosim.components.python_class import load_component
from cosim.core import resources
from cosim.core.component import Ports

ROOT = resources.root()
SOURCES = ROOT / "controllers/python"
TWINS = {
    "vtol": "Vtol",
    "position_controller": "PositionController",
    "altitude_controller": "AltitudeController",
    "attitude_controller": "AttitudeController",
    "mixer": "Mixer",
    "inverse_kinematics": "InverseKinematics",
    "waypoint_guidance": "WaypointGuidance",
    "path_guidance": "PathGuidance",
    "speed_controller": "SpeedController",
    "heading_controller": "HeadingController",
    "heading_autopilot": "HeadingAutopilot",
    "strider_autopilot": "StriderAutopilot",
}
TICKS = 2500
#: enough for controllers without flight modes
FEW_TICKS = 800
#: half the width of the inputs' random walks, by unit
WIDTHS = {"m": 0.4, "m/s": 1.5, "rad": 3.1, "%": 60.0, "1": 1.0, "m/s2": 3.0}

#: with these, random inputs pass through all flight modes, with aborted descents
EAGER_LANDING = {
    "take_off_time": 0.02,
    "landing_time": 0.1,
    "approach_band": 1.0,
    "landing_error": 0.4,
    "abort_error": 0.5,
    "hold_time": 0.05,
    "contact_time": 0.3,
}


class InProcess:
    """Python controller in process with the interface of `ControllerFmu`."""

    def __init__(self, name: str, parameters: dict[str, Any]):
        self.component, self.time = (
            load_component(f"{name}.py:{TWINS[name]}", SOURCES, name, {}),
            0.0,
        )
        self.outputs = [v.name for v in self.component.variables if v.causality == "output"]
        self.component.bind(Ports((), {}), Ports((), {}))
        self.set(parameters)
        self.component.enter_initialization_mode(0.0, TICKS * PERIOD)
        self.component.exit_initialization_mode()

    def set(self, values: dict[str, Any]) -> None:
        for name, value in values.items():
            self.component.set(name, value)

    def step(self, inputs: dict[str, Any]) -> dict[str, Any]:
        self.set(inputs)
        self.component.do_step(self.time, PERIOD)
        self.time += PERIOD
        return {name: self.component.get(name) for name in self.outputs}


def exported(name: str, parameters: dict[str, Any], folder: Path) -> ControllerFmu:
    return ControllerFmu(
        str(extract(str(ROOT / f"fmus/python/{name}.fmu"), str(folder / name))), parameters
    )


def random_parameters(variables: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Every parameter off its start value; waypoints where the vessel wanders."""
    parameters: dict[str, Any] = {}
    for name, variable in variables.items():
        if variable.causality == "parameter" and variable.type == "Real":
            parameters[name] = float(variable.start) * float(rng.uniform(0.7, 1.3)) or float(
                rng.uniform(-0.4, 0.4)
            )
    parameters |= (
        {"waypoint_count": 20, "end_policy": int(rng.integers(1, 4))}
        if "waypoint_count" in variables
        else {}
    )
    return parameters | (EAGER_LANDING if "landing_time" in variables else {})


def random_inputs(variables: dict[str, Any], rng: np.random.Generator) -> list[dict[str, Any]]:
    """Random walks between knots 0.2 s apart; Booleans hold for some ticks."""
    ticks: list[dict[str, Any]] = [{} for _ in range(TICKS)]
    for name in (name for name, variable in variables.items() if variable.causality == "input"):
        knots = rng.uniform(-1, 1, TICKS // 20 + 2)
        walk = np.interp(np.arange(TICKS) / 20, np.arange(len(knots)), knots)
        for tick, value in zip(ticks, walk, strict=True):
            unit = variables[name].unit
            tick[name] = (
                value > 0.6 if variables[name].type == "Boolean" else float(value) * WIDTHS[unit]
            )
    return ticks


def test_random_inputs_pass_through_all_flight_modes(
    controller: Callable[..., ControllerFmu],
) -> None:
    rng = np.random.default_rng(1)
    vtol = controller("vtol", random_parameters(controller("vtol").variables, rng))
    flown = [vtol.step(inputs) for inputs in random_inputs(vtol.variables, rng)]
    assert {row["mode"] for row in flown} == {1, 2, 3, 4, 5, 6}
    assert flown[-1]["aborts"] > 0


def assert_same(name: str, found: dict[str, Any], expected: dict[str, Any], tick: int) -> None:
    """To the bit; but compilers and the C library may round the cosines of the low-pass
    differently.
    """
    close = (
        {k: pytest.approx(v, rel=1e-12, abs=1e-12) for k, v in expected.items()}
        if name == "inverse_kinematics"
        else expected
    )
    assert found == close, f"tick {tick}"


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", TWINS)
def test_in_process_equals_modelica(
    controller: Callable[..., ControllerFmu], name: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    parameters = random_parameters(controller(name).variables, rng)
    modelica, python = controller(name, parameters), InProcess(name, parameters)
    for k, inputs in enumerate(
        random_inputs(modelica.variables, rng)[: TICKS if name == "vtol" else FEW_TICKS]
    ):
        assert_same(name, python.step(inputs), modelica.step(inputs), k)


@pytest.mark.parametrize("name", TWINS)
def test_exported_equals_modelica(
    controller: Callable[..., ControllerFmu], tmp_path: Path, name: str
) -> None:
    rng = np.random.default_rng(3)
    parameters = random_parameters(controller(name).variables, rng)
    modelica, python = controller(name, parameters), exported(name, parameters, tmp_path)
    for k, inputs in enumerate(
        random_inputs(modelica.variables, rng)[: TICKS if name == "vtol" else FEW_TICKS]
    ):
        assert_same(name, python.step(inputs), modelica.step(inputs), k)
    python.close()


@pytest.mark.parametrize("name", TWINS)
def test_interfaces_are_the_same(
    controller: Callable[..., ControllerFmu], tmp_path: Path, name: str
) -> None:
    def interface(instance: ControllerFmu) -> dict[str, tuple[Any, ...]]:
        shown = (v for v in instance.variables.values() if v.causality != "local")
        return {v.name: (kind(v.type), v.causality, v.variability, v.unit, start(v)) for v in shown}

    def kind(type_name: str) -> str:
        return "Integer" if type_name == "Enumeration" else type_name

    def start(variable: Any) -> Any:
        known = variable.start is not None and variable.causality in ("input", "parameter")
        return (
            {"true": 1.0, "false": 0.0}.get(variable.start)
            or float(variable.start.replace("false", "0"))
            if known
            else None
        )

    python = exported(name, {}, tmp_path)
    assert interface(python) == interface(controller(name))
    python.close()


def python_system(tmp_path: Path, system: str) -> str:
    """A nested system with every controller FMU replaced by its Python twin."""
    scenario = json.loads((ROOT / "scenarios/systems" / system).read_text())
    for component in scenario["components"].values():
        name = Path(component.pop("fmu")).stem
        component["python"] = str(SOURCES / f"{name}.py:{TWINS[name]}")
    (tmp_path / system).write_text(json.dumps(scenario))
    return str(tmp_path / system)


def test_demo1_flies_the_same_with_python_controllers(tmp_path: Path) -> None:
    original = json.loads((ROOT / "scenarios/demo1_box.json").read_text())["components"]["usv"]
    autopilot = {
        "python": str(SOURCES / "strider_autopilot.py:StriderAutopilot"),
        "parameters": original["parameters"],
    }
    changes = {
        "/components/uav/system": python_system(tmp_path, "ar_drone_cascaded.json"),
        "/components/usv": autopilot,
    }
    modelica, python = cosim.run("demo1_box"), cosim.run("demo1_box", changes)
    assert set(np.unique(modelica["uav.mode"])) == {1, 2, 3, 4, 5, 6}
    for name in modelica:
        assert np.array_equal(python[name], modelica[name], equal_nan=True), name


def test_demo3_flies_the_same_with_python_controllers(tmp_path: Path) -> None:
    changes = {
        "/components/uav/system": python_system(tmp_path, "ar_drone_inverse_kinematics.json")
    }
    modelica, python = (
        cosim.run("demo3_inverse_kinematics"),
        cosim.run("demo3_inverse_kinematics", changes),
    )
    for name in modelica:
        np.testing.assert_allclose(python[name], modelica[name], rtol=1e-9, atol=1e-9, err_msg=name)


def test_registered_variables_are_the_whole_state() -> None:
    """They are what PythonFMU saves of an exported controller."""
    rng = np.random.default_rng(5)
    for name in TWINS:
        twin = InProcess(name, {})
        variables = {v.name: v for v in twin.component.variables}
        inputs = []
        for _ in range(60):
            tick = dict[str, float]()
            for n, v in variables.items():
                if v.causality == "input":
                    flag = v.type == "Boolean"
                    tick[n] = bool(rng.integers(2)) if flag else float(rng.normal())
            inputs.append(tick)
        for tick in inputs[:30]:
            twin.step(tick)
        state, time = twin.component._slave._get_fmu_state(), twin.time
        onwards = [twin.step(tick) for tick in inputs[30:]]
        fresh = InProcess(name, {})
        fresh.component._slave._set_fmu_state(state)
        fresh.time = time
        assert [fresh.step(tick) for tick in inputs[30:]] == onwards, name
