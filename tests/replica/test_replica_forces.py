"""The force models of the published simulator, against its formulas written out with its numbers."""

from __future__ import annotations

import math

import pytest

from plant_src.replica.forces import RotorMap, VesselForces


def rotors(throttle: float) -> tuple[float, float]:
    unit = RotorMap(instance_name="rotors")
    unit.value["throttle[3]"] = throttle
    assert unit.do_step(0.0, 0.01)
    return unit.value["thrust[3]"], unit.value["torque[3]"]


def vessel(u: float, v: float, r: float, rudder_angle: float = 0.0, yaw: float = 0.0, **parameters: float) -> dict[str, float]:
    """Loads at a body velocity."""
    unit = VesselForces(instance_name="forces")
    velocity = complex(u, v) * complex(math.cos(yaw), math.sin(yaw))
    unit.value |= {"vehicle.velocity.x": velocity.real, "vehicle.velocity.y": velocity.imag, "vehicle.attitude.yaw": yaw}
    unit.value |= {"vehicle.angular_velocity.z": r, "rudder_angle": rudder_angle, **parameters}
    assert unit.do_step(0.0, 0.01)
    return unit.value


def test_full_throttle_gives_the_published_maximum() -> None:
    assert rotors(100.0) == pytest.approx((2.508, 2.508 * 2.38e-7 / 9.148e-6), rel=2e-4)


def test_hover_takes_65_88_percent() -> None:
    assert 4 * rotors(65.88)[0] == pytest.approx(0.443892 * 9.81, rel=3e-4)


def test_throttle_is_limited() -> None:
    assert rotors(-5.0) == (0.0, 0.0)
    assert rotors(130.0) == rotors(100.0)


def test_thrust_grows_with_the_square_of_the_throttle() -> None:
    assert rotors(80.0)[0] == pytest.approx(4 * rotors(40.0)[0])


def test_water_and_air_act_on_two_hulls() -> None:
    """Equations 12 and 13 twice, and 0.1 v |v| of air."""
    loads = vessel(u=0.9, v=-0.2, r=0.3)
    assert loads["water.x"] == pytest.approx(-0.1 * 0.81)
    assert loads["water.y"] == pytest.approx(2 * (-3.899501881 * -0.2 + 1.774273356 * 0.3) + 0.1 * 0.04)
    assert loads["water.n"] == pytest.approx(2 * (-1.774273356 * -0.2 - 0.807294377 * 0.3))


def test_loads_do_not_depend_on_the_compass() -> None:
    north, east = vessel(0.7, 0.1, -0.2, 0.1, yaw=0.0), vessel(0.7, 0.1, -0.2, 0.1, yaw=2.1)
    for name in ("rudder.x", "rudder.y", "water.x", "water.y", "water.n"):
        assert east[name] == pytest.approx(north[name], abs=1e-12)


def test_a_stalled_rudder_gives_3_83_newton_at_one_metre_per_second() -> None:
    angle = math.radians(35)
    loads = vessel(u=1.0, v=0.0, r=0.0, rudder_angle=angle)
    assert loads["rudder.x"] == pytest.approx(-3.832 * math.sin(angle), rel=1e-3)
    assert loads["rudder.y"] == pytest.approx(3.832 * math.cos(angle), rel=1e-3)


def test_lift_is_a_sine_of_the_angle_of_attack_up_to_30_degrees() -> None:
    half = vessel(u=1.0, v=0.0, r=0.0, rudder_angle=math.radians(15))["rudder.y"] / math.cos(math.radians(15))
    assert half == pytest.approx(3.83232 * math.sin(math.pi / 4), rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_inflow_of_a_turn_has_the_published_sign_or_the_physical_one(sign: float) -> None:
    inflow = math.atan((0.05 + sign * 0.34727 * 0.4) / 0.8)
    lift = 0.5 * 998 * 1.2 * 0.0064 * 0.64 * math.sin(math.pi / 2 * (0.1 - inflow) / math.radians(30))
    loads = vessel(0.8, 0.05, 0.4, 0.1, rudder_inflow_sign=sign)
    assert loads["rudder.y"] == pytest.approx(lift * math.cos(0.1))
    assert loads["rudder.x"] == pytest.approx(-lift * math.sin(0.1))


def test_a_vessel_at_rest_has_no_loads() -> None:
    loads = vessel(0.0, 0.0, 0.0, 0.3)
    assert not any(loads[name] for name in ("rudder.x", "rudder.y", "water.x", "water.y", "water.n"))
