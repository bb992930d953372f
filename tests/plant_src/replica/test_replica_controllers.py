"""The published controllers, unit by unit."""

from __future__ import annotations

import math

import pytest

from plant_src.replica.bus import Bus
from plant_src.replica.fmu_base import Pid, ReplicaFmu
from plant_src.replica.quadcopter import AttitudeController, Mixer, PositionController, Vtol
from plant_src.replica.vessel import Autopilot, Waypoints


def step(unit: ReplicaFmu, time: float = 0.0, **values: float) -> dict[str, float]:
    """One step; "__" in names stands for the dot."""
    unit.values |= {name.replace("__", "."): value for name, value in values.items()}
    assert unit.do_step(time, 0.01)
    return unit.values


def bogacki_shampine(filtered: float, damped: float, n: float, h: float) -> float:
    """One step of ode3 for the derivative filter x' = n (damped - x)."""
    k1 = n * (damped - filtered)
    k2 = n * (damped - filtered - h / 2 * k1)
    k3 = n * (damped - filtered - 3 * h / 4 * k2)
    return filtered + h / 9 * (2 * k1 + 3 * k2 + 4 * k3)


def test_the_filter_is_integrated_like_the_published_one() -> None:
    loop, expected = Pid(0.0, D=0.3, N=100.0), 0.0
    for error in (1.0, 1.0, -0.4, 0.2, 0.9):
        assert loop.step(error, 0.01) == pytest.approx(100 * (0.3 * error - expected))
        expected = bogacki_shampine(expected, 0.3 * error, 100.0, 0.01)


def test_an_integral_is_stepped_forward() -> None:
    loop = Pid(2.0, I=0.5)
    assert [loop.step(1.0, 0.01) for _ in range(3)] == pytest.approx([2.0, 2.005, 2.01])


@pytest.mark.parametrize(("clamping", "held"), [(True, 0.0), (False, 5.0)])
def test_only_loops_with_clamping_stop_integrating_at_the_limit(
    clamping: bool, held: float
) -> None:
    loop = Pid(2.0, I=1.0, upper=1.0, clamping=clamping)
    assert {loop.step(5.0, 0.01) for _ in range(100)} == {1.0}
    assert loop.integral == pytest.approx(held)


def test_a_clamped_integral_comes_back_at_once() -> None:
    loop = Pid(2.0, I=1.0, upper=1.0, clamping=True, integral=3.0)
    loop.step(-0.1, 0.01)
    assert loop.integral == pytest.approx(3.0 - 0.001)


def test_the_bus_starts_with_zeros_and_is_one_sample_late() -> None:
    bus = Bus(instance_name="bus")
    seen = [step(bus, plant__uav__position__z=z)["uav.position.z"] for z in (0.7, 0.8, 0.9)]
    assert seen == [0.0, 0.7, 0.8]


@pytest.mark.parametrize(
    ("time", "altitude", "distance", "reference"),
    [
        (4.99, 2.0, 0.0, 2.0),
        (5.0, 2.0, 0.0, 1.0),
        (5.0, 1.1, 0.0, 1.0),
        (5.0, 1.09, 0.11, 1.0),
        (5.0, 1.09, 0.09, 0.0),
        (9.0, 0.4, 0.11, 1.0),
    ],
)
def test_take_off_approach_landing_and_abort(
    time: float, altitude: float, distance: float, reference: float
) -> None:
    vtol = Vtol(instance_name="vtol")
    values = step(
        vtol,
        time,
        altitude_command=2.0,
        vehicle__position__z=altitude,
        target__position__y=distance,
    )
    assert values["altitude_reference"] == reference


def test_without_landing_the_command_holds() -> None:
    assert (
        step(Vtol(instance_name="vtol"), 20.0, altitude_command=3.0, enabled=0.0)[
            "altitude_reference"
        ]
        == 3.0
    )


@pytest.mark.parametrize(
    ("psi", "x", "y", "phi", "theta"),
    [
        (0.0, 1.0, 0.0, 0, -1),
        (0.0, 0.0, 1.0, -1, 0),
        (-math.pi / 2, 0.0, 1.0, 0, -1),  # nose to +y: a target there is ahead
        (-math.pi / 2, 1.0, 0.0, 1, 0),  # and one at +x to the right
    ],
)
def test_it_tilts_towards_the_target(psi: float, x: float, y: float, phi: int, theta: int) -> None:
    unit = PositionController(instance_name="position")
    values = step(unit, vehicle__attitude__psi=psi, target__position__x=x, target__position__y=y)
    signs = [
        round(values[name], 9) and math.copysign(1, values[name])
        for name in ("phi_command", "theta_command")
    ]
    assert signs == [phi, theta]


def test_tilt_commands_end_at_15_degrees() -> None:
    values = step(PositionController(instance_name="position"), target__position__x=5.0)
    assert math.degrees(values["theta_command"]) == pytest.approx(-15.0)


def test_world_velocities_are_taken_for_body_velocities() -> None:
    """With the nose to +y a velocity along +x is still fed to the loop of the forward velocity: the
    published flaw.
    """
    unit = PositionController(instance_name="position")
    values = step(unit, vehicle__attitude__psi=-math.pi / 2, vehicle__velocity__x=0.5)
    assert values["theta_command"] > 0.1
    assert values["phi_command"] == 0


def test_the_yaw_error_is_not_wrapped() -> None:
    """From -179 to 179 degrees the short way is down, the published one is up."""
    unit = AttitudeController(instance_name="attitude")
    values = step(unit, psi_command=math.radians(179), vehicle__attitude__psi=math.radians(-179))
    assert values["yaw"] == 10.0


def test_the_mixer_adds_and_limits() -> None:
    values = step(Mixer(instance_name="mixer"), collective=90.0, roll=20.0, pitch=-5.0, yaw=3.0)
    assert [values[f"throttle[{i}]"] for i in range(1, 5)] == [82.0, 100.0, 92.0, 73.0]


@pytest.mark.parametrize(("x", "y"), [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
def test_the_course_points_to_the_waypoint(x: float, y: float) -> None:
    unit = Waypoints(instance_name="waypoints")
    course = step(unit, **{"waypoint_x[1]": 10 * x, "waypoint_y[1]": 10 * y})["course_command"]
    assert 0 <= course < 2 * math.pi
    assert (math.cos(course), math.sin(course)) == pytest.approx(
        (x / math.sqrt(2), y / math.sqrt(2))
    )


def test_a_waypoint_is_switched_one_sample_late_and_the_last_one_stays() -> None:
    unit = Waypoints(instance_name="waypoints")
    unit.values |= {"waypoint_count": 2.0, "waypoint_x[1]": 10.0, "waypoint_x[2]": 20.0}
    places = (0.0, 9.4, 9.6, 9.6, 19.4, 19.6, 19.6, 19.7)
    assert [step(unit, vehicle__position__x=x)["waypoint"] for x in places] == [
        1,
        1,
        1,
        2,
        2,
        2,
        2,
        2,
    ]


@pytest.mark.parametrize(
    ("yaw", "course", "sign"), [(0.1, 6.2, 1), (-0.1, 0.1, -1), (3.1, 3.3, -1), (-3.1, 3.0, 1)]
)
def test_the_rudder_takes_the_shorter_way(yaw: float, course: float, sign: int) -> None:
    values = step(
        Autopilot(instance_name="autopilot"), vehicle__attitude__yaw=yaw, course_command=course
    )
    assert math.copysign(1, values["rudder_angle"]) == sign


def test_thrust_is_limited_to_three_newton_and_rudder_to_35_degrees() -> None:
    values = step(
        Autopilot(instance_name="autopilot"), speed_command=1.0, vehicle__attitude__yaw=2.0
    )
    assert values["thrust"] == 3.0
    assert values["rudder_angle"] == pytest.approx(math.radians(35))


def test_thrust_is_proportional_to_the_speed_along_the_hull() -> None:
    unit = Autopilot(instance_name="autopilot")
    values = step(
        unit, speed_command=1.0, vehicle__attitude__yaw=math.pi / 2, vehicle__velocity__y=0.99
    )
    assert values["thrust"] == pytest.approx(82.65 * 0.01)
