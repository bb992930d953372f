"""The force models of the published simulator, built as FMUs of both versions, against its formulas
written out with its numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from fakes import FakeComponent, outputs

from cosim.components.fmi import FmuFile, create_component
from cosim.core import resources
from cosim.core.system import Connection, Endpoint, System
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.export.build import build_to

Loads = Callable[..., dict[str, float]]


@pytest.fixture(scope="module", params=[2, 3])
def fmus(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the FMUs, which are built from their sources: `fmus/` may be older."""
    folder = tmp_path_factory.mktemp("fmus")
    for name in ("air_drag", "hull_hydrodynamics", "rotor_map", "rudder"):
        source = resources.root() / f"plant_src/replica/forces/{name}.py"
        build_to(source, None, folder / f"{name}.fmu", request.param)
    return folder


@pytest.fixture
def loads(fmus: Path) -> Loads:
    """Function that evaluates an FMU (by name) with inputs and parameters."""

    def evaluated(name: str, inputs: Mapping[str, float], **parameters: float) -> dict[str, float]:
        file = FmuFile(fmus / f"{name}.fmu")
        source = FakeComponent(outputs(*inputs), lambda *_: None, start=inputs)
        connected = [Connection(Endpoint("in", slot), Endpoint("fmu", slot)) for slot in inputs]
        components = {"in": source, "fmu": create_component(file, "fmu")}
        wired = System(components, connected, (("in", "fmu"),), start_values={"fmu": parameters})
        slots = [
            slot
            for v in file.description.variables
            if v.causality == "output"
            for slot in v.scalar_names
        ]
        recording = simulate(
            wired,
            Settings(
                exact_fraction(0),
                exact_fraction(0.01),
                exact_fraction(0.01),
                {s: Endpoint("fmu", s) for s in slots},
            ),
        ).recording
        return {slot: float(recording.columns[slot][-1]) for slot in slots}

    return evaluated


def rotors(loads: Loads, *throttles: float) -> list[tuple[float, float]]:
    """(thrust, torque) of each rotor."""
    found = loads(
        "rotor_map", {f"throttle[{i}]": throttle for i, throttle in enumerate(throttles, start=1)}
    )
    return [(found[f"thrust[{i}]"], found[f"torque[{i}]"]) for i in range(1, len(throttles) + 1)]


def motion(u: float, v: float, r: float, yaw: float = 0.0) -> dict[str, float]:
    """Signals of the bus for a vessel with a body velocity (m/s) and a yaw rate (rad/s)."""
    velocity = complex(u, v) * complex(math.cos(yaw), math.sin(yaw))
    return {
        "vehicle.velocity.x": velocity.real,
        "vehicle.velocity.y": velocity.imag,
        "vehicle.angular_velocity.z": r,
        "vehicle.attitude.yaw": yaw,
    }


def rudder(
    loads: Loads, u: float, v: float, r: float, angle: float, **parameters: float
) -> tuple[float, float]:
    found = loads("rudder", {**motion(u, v, r), "rudder_angle": angle}, **parameters)
    return found["force.x"], found["force.y"]


def test_full_throttle_gives_the_published_maximum(loads: Loads) -> None:
    for thrust, torque in rotors(loads, *[100.0] * 4):
        assert (thrust, torque) == pytest.approx((2.508, 2.508 * 2.38e-7 / 9.148e-6), rel=2e-4)


def test_hover_takes_65_88_percent(loads: Loads) -> None:
    assert sum(thrust for thrust, _ in rotors(loads, *[65.88] * 4)) == pytest.approx(
        0.443892 * 9.81, rel=3e-4
    )


def test_throttles_are_limited(loads: Loads) -> None:
    below, none, most, above = rotors(loads, -5.0, 0.0, 100.0, 130.0)
    assert below == none == (0.0, 0.0)
    assert above == most


def test_each_thrust_grows_with_the_square_of_its_own_throttle(loads: Loads) -> None:
    thrusts = [thrust for thrust, _ in rotors(loads, 20.0, 40.0, 60.0, 80.0)]
    assert [thrust / thrusts[0] for thrust in thrusts] == pytest.approx([1, 4, 9, 16])


def test_rotors_of_other_coefficients(loads: Loads) -> None:
    changes = {"thrust_coefficient": 2e-6, "torque_coefficient": 3e-8, "max_speed": 1000.0}
    found = loads("rotor_map", {"throttle[1]": 50.0}, **changes)
    assert (found["thrust[1]"], found["torque[1]"]) == pytest.approx((0.5, 0.0075))


def test_the_water_acts_on_two_hulls(loads: Loads) -> None:
    """Equations 12 and 13 twice."""
    found = loads("hull_hydrodynamics", motion(u=0.9, v=-0.2, r=0.3))
    assert found["load.x"] == 0
    assert found["load.y"] == pytest.approx(2 * (-3.899501881 * -0.2 + 1.774273356 * 0.3))
    assert found["load.n"] == pytest.approx(2 * (-1.774273356 * -0.2 - 0.807294377 * 0.3))


def test_hulls_and_their_coefficients_are_parameters(loads: Loads) -> None:
    changes = {"hulls": 1.0, "Y_v": -1.0, "Y_r": -2.0, "N_v": -3.0, "N_r": -4.0}
    found = loads("hull_hydrodynamics", motion(u=0.9, v=0.1, r=0.01), **changes)
    assert (found["load.y"], found["load.n"]) == pytest.approx((-0.12, -0.34))


def test_air_drag_joins_the_load_of_the_water(loads: Loads) -> None:
    found = loads(
        "air_drag", {**motion(u=0.9, v=-0.2, r=0.3), "water.x": 1.0, "water.y": 2.0, "water.n": 3.0}
    )
    assert (found["load.x"], found["load.y"], found["load.n"]) == pytest.approx(
        (1 - 0.1 * 0.81, 2 + 0.1 * 0.04, 3)
    )


def test_without_a_coefficient_there_is_no_drag(loads: Loads) -> None:
    found = loads("air_drag", motion(2.0, 1.0, 0.0), coefficient=0.0)
    assert not any(found.values())


@pytest.mark.parametrize("model", ["rudder", "hull_hydrodynamics", "air_drag"])
def test_loads_do_not_depend_on_the_compass(loads: Loads, model: str) -> None:
    east, west = (loads(model, motion(0.7, 0.1, -0.2, yaw)) for yaw in (0.0, 2.1))
    assert any(east.values())
    assert west == pytest.approx(east, abs=1e-12)


def test_a_stalled_rudder_gives_3_83_newton_at_one_metre_per_second(loads: Loads) -> None:
    angle = math.radians(35)
    found = rudder(loads, 1.0, 0.0, 0.0, angle)
    assert found == pytest.approx((-3.832 * math.sin(angle), 3.832 * math.cos(angle)), rel=1e-3)


def test_lift_is_a_sine_of_the_angle_of_attack_up_to_30_degrees(loads: Loads) -> None:
    angle = math.radians(15)
    assert rudder(loads, 1.0, 0.0, 0.0, angle)[1] / math.cos(angle) == pytest.approx(
        3.83232 * math.sin(math.pi / 4), rel=1e-9
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_inflow_of_a_turn_has_the_published_sign_or_the_physical_one(
    loads: Loads, sign: float
) -> None:
    inflow = math.atan((0.05 + sign * 0.34727 * 0.4) / 0.8)
    lift = (
        0.5 * 998 * 1.2 * 0.0064 * 0.64 * math.sin(math.pi / 2 * (0.1 - inflow) / math.radians(30))
    )
    found = rudder(loads, 0.8, 0.05, 0.4, 0.1, inflow_sign=sign)
    assert found == pytest.approx((-lift * math.sin(0.1), lift * math.cos(0.1)))


def test_a_rudder_of_other_size_and_shape(loads: Loads) -> None:
    changes = {
        "area": 0.02,
        "max_lift_coefficient": 1.0,
        "stall_angle": 0.4,
        "density": 1000.0,
        "arm": 1.0,
    }
    lift = 0.5 * 1000 * 0.02 * 4 * math.sin(math.pi / 2 * (0.1 - math.atan(0.1)) / 0.4)
    assert rudder(loads, 2.0, 0.0, 0.2, 0.1, **changes)[1] == pytest.approx(lift * math.cos(0.1))


def test_a_vessel_at_rest_has_no_loads(loads: Loads) -> None:
    assert rudder(loads, 0.0, 0.0, 0.0, 0.3) == (0, 0)
    for model in ("hull_hydrodynamics", "air_drag"):
        assert not any(loads(model, motion(0.0, 0.0, 0.0)).values())
