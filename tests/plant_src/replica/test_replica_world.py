"""The plant of the replica: its interface, its conventions, and mechanics that can be computed by
hand.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from plant_validation import MeasurementCheck

from cosim.core.component import Ports
from cosim.core.errors import ComponentError, InputError
from plant_src.replica.world import World

PLATFORM = {"size": [4.0, 4.0, 0.05], "position": [0.0, 0.0, 0.45]}
REPLICA = "Replica of the published simulator"
HALF = 0.005  # s, one of the two steps that the engine makes
WEIGHT = 0.443892 * 9.81

#: equation 10: four thrusts, four torques, thrust and rudder of the vessel, X, Y, N
INPUTS = [f"uav.{load}[{i}]" for load in ("thrust", "torque") for i in (1, 2, 3, 4)]
INPUTS += [
    "usv.thrust",
    "usv.rudder.x",
    "usv.rudder.y",
    "usv.water.x",
    "usv.water.y",
    "usv.water.n",
]

#: equation 11
OUTPUTS = [f"uav.position.{axis}" for axis in "xyz"]
OUTPUTS += [f"uav.attitude.{angle}" for angle in ("phi", "theta", "psi")]
OUTPUTS += [f"uav.{vector}.{axis}" for vector in ("velocity", "acceleration") for axis in "xyz"]
OUTPUTS += [
    f"usv.{vector}.{axis}"
    for vector in ("position", "velocity", "angular_velocity")
    for axis in "xyz"
]
OUTPUTS += ["usv.attitude.yaw"]


class Trial:
    """A replica's world with bound arrays."""

    def __init__(self, uav: dict[str, Any], usv: dict[str, Any] | None = None, **more: Any):
        self.world = World("plant", {"uav": uav, "usv": usv or {"position": [30.0, 0.0]}}, **more)
        self.inputs, self.outputs = np.zeros(14), np.zeros(22)
        variables = self.world.variables
        ports = []
        for causality, array in (("input", self.inputs), ("output", self.outputs)):
            chosen = [variable for variable in variables if variable.causality == causality]
            ports.append(Ports(chosen, {np.dtype(float): array}))
        self.world.bind(*ports)

    def step(self, count: int = 1, **loads: float) -> Trial:
        for name, value in loads.items():
            self.inputs[INPUTS.index(name.replace("__", "."))] = value
        for _ in range(count):
            self.world.set_inputs()
            self.world.do_step(0.0, 0.01)
        self.world.get_outputs()
        return self

    def hover(self, count: int = 1) -> Trial:
        self.inputs[0:4] = WEIGHT / 4
        return self.step(count)

    def vector(self, name: str, axes: tuple[str, ...] = ("x", "y", "z")) -> np.ndarray:
        return np.array([self[f"{name}.{axis}"] for axis in axes])

    @property
    def attitude(self) -> np.ndarray:
        return self.vector("uav.attitude", ("phi", "theta", "psi"))

    def __getitem__(self, name: str) -> float:
        return float(self.world.get(name))


def test_the_signals_have_the_published_order() -> None:
    variables = World.variables
    assert [v.name for v in variables if v.causality == "input"] == INPUTS
    assert [v.name for v in variables if v.causality == "output"] == OUTPUTS


def test_the_start_is_published_in_the_original_conventions() -> None:
    trial = Trial(
        {"position": [1.0, 2.0, 3.0], "yaw": np.pi / 2}, {"position": [-4.0, 5.0], "yaw": -3.0}
    )
    np.testing.assert_allclose(trial.vector("uav.position"), [1, 2, 3], atol=1e-12)
    np.testing.assert_allclose(trial.attitude, [0, 0, -np.pi / 2], atol=1e-8)
    np.testing.assert_allclose(trial.vector("usv.position"), [-4, 5, 0.1245])
    assert trial["usv.attitude.yaw"] == pytest.approx(-3.0)


@pytest.mark.parametrize("yaw", [0.0, 3.0, np.pi, -2.5])
def test_psi_is_clockwise(yaw: float) -> None:
    psi = Trial({"position": [0, 0, 3], "yaw": yaw}).attitude[2]
    assert np.exp(1j * psi) == pytest.approx(np.exp(-1j * yaw))


def test_it_falls_as_two_engine_steps_per_sample_make_it_fall(measured: MeasurementCheck) -> None:
    trial = Trial({"position": [0, 0, 10]}).step(50)
    assert trial["uav.velocity.z"] == pytest.approx(-9.81 * 0.5)
    fall, expected = 10 - trial["uav.position.z"], 9.81 * HALF**2 * 100 * 101 / 2
    measured(
        REPLICA,
        "free fall in two Euler steps per sample, 0.5 s",
        fall,
        expected,
        "m",
        "closed form",
        relative=1e-6,
    )


def test_the_published_point_is_not_the_centre_of_mass() -> None:
    """A free spin is about the centre of mass, which flies on straight; the origin of the model
    goes round it.
    """
    spin, duration, centre = 2.0, 0.1, complex(-0.003329, 0.001981)
    trial = Trial({"position": [0, 0, 10], "rates": [0, 0, spin]})
    np.testing.assert_allclose(trial.vector("uav.velocity"), 0, atol=1e-9)
    trial.step(10)
    expected = centre + 1j * spin * centre * duration - centre * np.exp(1j * spin * duration)
    assert abs(expected) > 5e-5
    np.testing.assert_allclose(
        trial.vector("uav.position")[:2], [expected.real, expected.imag], atol=1e-5
    )


def test_hovering_thrust_carries_the_weight() -> None:
    assert abs(Trial({"position": [0, 0, 10]}).hover()["uav.velocity.z"]) < 1e-3


@pytest.mark.parametrize(
    "loads",
    [
        {"uav__thrust[1]": 0.1},
        {"uav__thrust[2]": 0.1},
        {"uav__thrust[3]": 0.1, "uav__torque[1]": 0.002},
        {"uav__thrust[4]": 0.1, "uav__torque[4]": 0.003},
    ],
)
def test_rotors_turn_the_body_as_the_published_numbers_say(loads: dict[str, float]) -> None:
    """Forward-right-down: inertia, rotor places and senses of the fact sheet; two steps from rest
    turn by 3 h^2 alpha.
    """
    inertia = np.array(
        [
            [0.002835, -0.000978, -0.000116],
            [-0.000978, 0.002821, -0.000111],
            [-0.000116, -0.000111, 0.005131],
        ]
    )
    rotors = [
        [0.181777, 0.000828, -0.006153],
        [0.000096, -0.181531, -0.006153],
        [-0.181505, -0.000016, -0.006153],
        [0.000096, 0.181499, -0.006153],
    ]
    torque = np.zeros(3)
    for name, value in loads.items():
        i = int(name[-2]) - 1
        torque += (
            np.cross(rotors[i], [0, 0, -value])
            if "thrust" in name
            else [0, 0, (-1) ** (i + 1) * value]
        )
    turned = Trial({"position": [0, 0, 10]}).step(**loads).attitude
    np.testing.assert_allclose(
        turned, 3 * HALF**2 * np.linalg.solve(inertia, torque), atol=2e-6, rtol=5e-3
    )


@pytest.mark.parametrize(("rotor", "angle", "sign"), [(1, 1, 1), (2, 0, 1), (3, 1, -1), (4, 0, -1)])
def test_positive_angles_are_nose_up_and_right_side_down(rotor: int, angle: int, sign: int) -> None:
    assert (
        sign
        * Trial({"position": [0, 0, 10]}).step(**{f"uav__thrust[{rotor}]": 0.2}).attitude[angle]
        > 1e-4
    )


def test_a_tilted_rotor_pulls_sideways() -> None:
    """Nose down accelerates forward."""
    trial = (
        Trial({"position": [0, 0, 10]}).hover().step(20, **{"uav__thrust[3]": WEIGHT / 4 + 0.05})
    )
    assert trial.attitude[1] < -0.05
    assert trial["uav.velocity.x"] > 0.03


def test_the_links_of_the_rig_move_with_the_hull(measured: MeasurementCheck) -> None:
    """4.31 kg in x, 4.21 kg in y."""
    trial = Trial({"position": [0, 0, 100]}).step(10, usv__water__x=1.0, usv__water__y=2.0)
    *level, climb = trial.vector("usv.velocity")
    assert climb == 0
    measured(
        REPLICA,
        "speed of the hull with the links of its rig",
        level,
        [0.1 / 4.31, 0.2 / 4.21],
        "m/s",
        "F t / m",
        relative=1e-9,
    )


def test_rudder_and_moment_turn_the_hull() -> None:
    trial = Trial({"position": [0, 0, 100]}).step(usv__rudder__y=1.0, usv__water__n=0.5)
    assert trial["usv.angular_velocity.z"] == pytest.approx(0.01 * (0.5 - 0.34727) / 0.6391)


def test_forces_of_the_hull_lie_in_its_axes() -> None:
    trial = Trial({"position": [0, 0, 100]}, {"position": [0, 0], "yaw": np.pi / 2}).step(
        usv__thrust=1.0, usv__rudder__x=0.5
    )
    np.testing.assert_allclose(trial.vector("usv.velocity"), [0, 0.015 / 4.21, 0], atol=1e-12)


def test_yaw_of_the_vessel_is_cyclic() -> None:
    trial = Trial(
        {"position": [0, 0, 100]}, {"position": [0, 0], "yaw": 3.1, "rates": [0, 0, 1.0]}
    ).step(10)
    assert trial["usv.attitude.yaw"] == pytest.approx(3.2 - 2 * np.pi, abs=1e-6)


def test_published_acceleration_is_a_difference_quotient_of_velocity_plus_position() -> None:
    """Level with psi = 0: z of R v + position is z - v_z, so that falling it changes by v_z + g."""
    trial = Trial({"position": [0, 0, 10]}).step(3)
    before = trial["uav.position.z"] - trial["uav.velocity.z"]
    trial.step()
    after = trial["uav.position.z"] - trial["uav.velocity.z"]
    assert trial["uav.acceleration.z"] == pytest.approx((after - before) / 0.01)


@pytest.mark.parametrize("support", ["platform", "deck"])
def test_it_rests_on_its_feet(support: str) -> None:
    """0.0566 m above a platform; at 0.3255 m on the vessel's deck."""
    usv = {"position": [0, 0]} if support == "deck" else None
    platforms = {"start": PLATFORM} if support == "platform" else None
    height = {"platform": 0.475 + 0.0566, "deck": 0.3255}[support]
    trial = Trial({"position": [0, 0, height + 0.05]}, usv, platforms=platforms).step(200)
    assert trial["uav.position.z"] == pytest.approx(height, abs=1e-3)
    assert np.abs(trial.vector("uav.velocity")).max() < 1e-3


def test_landing_sideways_pushes_the_vessel(measured: MeasurementCheck) -> None:
    trial = Trial(
        {"position": [0, 0, 0.33], "velocity_body": [0.3, 0, 0]}, {"position": [0, 0]}
    ).step(40)
    share = 0.443892 / (0.443892 + 4.31)
    found, expected = trial["usv.velocity.x"], 0.3 * share
    measured(
        REPLICA,
        "common speed after a sideways landing",
        found,
        expected,
        "m/s",
        "conservation",
        relative=0.02,
    )
    assert trial["uav.velocity.x"] == pytest.approx(0.3 * share, rel=0.02)


def test_more_sub_steps_change_little_in_flight() -> None:
    ends = [
        Trial({"position": [0, 0, 10], "rates": [0.5, 0.2, 0.1]}, sub_steps=n)
        .hover(50)
        .vector("uav.position")
        for n in (2, 20)
    ]
    assert 1e-6 < np.linalg.norm(ends[0] - ends[1]) < 0.02


def test_a_restored_state_repeats_bit_for_bit() -> None:
    trial = Trial({"position": [0, 0, 0.36]}, {"position": [0, 0]}).step(12)
    state = trial.world.get_state()
    first = trial.step(30).outputs.copy()
    trial.world.set_state(state)
    assert np.array_equal(trial.step(30).outputs, first)


def test_a_value_that_is_not_finite_is_rejected_by_name() -> None:
    with pytest.raises(ComponentError, match=r"uav\.torque\[2\] is nan"):
        Trial({"position": [0, 0, 10]}).step(**{"uav__torque[2]": float("nan")})


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"vehicles": {"uav": {"position": [0, 0, 1]}}}, "expected the vehicles"),
        (
            {
                "vehicles": {"uav": {"position": [0, 0, 1]}, "usv": {"position": [0, 0]}},
                "sub_steps": 0,
            },
            "at least 1",
        ),
        (
            {"vehicles": {"uav": {"position": [0, 0]}, "usv": {"position": [0, 0]}}},
            "list of 3 numbers",
        ),
        ({"vehicles": {"uav": {"position": [0, 0, 0.2]}, "usv": {"position": [0, 0]}}}, "overlap"),
    ],
)
def test_arguments_are_checked(arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        World("plant", **arguments)


def test_unknown_variables_are_refused_with_the_nearest_name() -> None:
    with pytest.raises(ComponentError, match=r"did you mean \"usv\.rudder\.y\""):
        Trial({"position": [0, 0, 10]}).world.set("usv.rudder.z", 1.0)
