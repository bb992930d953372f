"""Variables that vehicles have in common: their names, units and order, for the plant FMUs and for the world alike.

World frame: x, y horizontal, z up. Body frame: x forward, y left, z up, origin at the centre of mass. Right-hand rule
throughout: positive roll lifts the left side, positive pitch lowers the nose, positive yaw is counter-clockwise from above.
"""

from __future__ import annotations

from collections.abc import Sequence

from cosim.core.component import Causality, Variability, Variable
from cosim.core.units import parse


def vector(name: str, axes: Sequence[str], unit: str, description: str, causality: Causality = "output") -> tuple[Variable, ...]:
    """Scalar variables `name.axis`, one for each axis."""
    variability: Variability = "fixed" if causality == "parameter" else "continuous"
    start = None if causality == "output" else 0.0
    return tuple(
        Variable(f"{name}.{axis}", "Float64", causality, variability, start, parse(unit), description=f"{description}: {axis}")
        for axis in axes
    )


def scalar(name: str, unit: str, description: str, causality: Causality = "input", start: float = 0.0) -> Variable:
    """One real variable."""
    variability: Variability = "fixed" if causality == "parameter" else "continuous"
    return Variable(name, "Float64", causality, variability, start, parse(unit), description=description)


ATTITUDE = ("roll", "pitch", "yaw")

#: how a vehicle moves
MOTION = (
    *vector("position", "xyz", "m", "centre of mass, world frame"),
    *vector("orientation", "wxyz", "1", "unit quaternion, body to world"),
    *vector("attitude", ATTITUDE, "rad", "ZYX Euler angle"),
    *vector("velocity", "xyz", "m/s", "centre of mass, world frame"),
    *vector("velocity_body", "uvw", "m/s", "centre of mass, body frame"),
    *vector("rates", "pqr", "rad/s", "angular velocity, body frame"),
)

#: the landing deck of a vessel
DECK = (
    *vector("deck.position", "xyz", "m", "centre of the top of the landing deck, world frame"),
    *vector("deck.velocity", "xyz", "m/s", "centre of the top of the landing deck, world frame"),
)

CONTACT = (
    Variable("contact.force", "Float64", "output", unit=parse("N"), description="sum of normal forces, mean over the step"),
    Variable("contact.touching", "Boolean", "output", "discrete", description="contact with anything"),
    Variable("contact.vessel", "Boolean", "output", "discrete", description="contact with a vessel"),
)

#: loads from outside, at the centre of mass
EXTERNAL_LOADS = (
    *vector("external_force", "xyz", "N", "force at the centre of mass, world frame", "input"),
    *vector("external_torque", "xyz", "N.m", "torque, world frame", "input"),
)

#: what the environment does to a vehicle: the last inputs of a model, written by the environment where there is one
WIND = vector("wind", "xyz", "m/s", "velocity of the air at the vehicle, world frame", "input")
CURRENT = vector("current", "xy", "m/s", "velocity of the water, world frame", "input")
WAVE_GAIN = (scalar("wave_gain", "1", "factor on the amplitudes of all waves", start=1.0),)
GROUND_DISTANCE = (
    scalar("ground_distance", "m", "height of the centre of the rotor plane above the next surface below", start=1e3),
)
SURROUNDINGS = frozenset(variable.name for variable in (*WIND, *CURRENT, *WAVE_GAIN, *GROUND_DISTANCE))


#: how many components the sea can have
COMPONENTS = 64


def _array(name: str, unit: str, description: str, minimum: float | None = None) -> Variable:
    start = (0.0,) * COMPONENTS
    shape = (COMPONENTS,)
    return Variable(name, "Float64", "parameter", "fixed", start, parse(unit), shape, description, minimum)


#: the sea; the components after the first `wave.count` are not used
WAVES = (
    Variable(
        "wave.count", "Float64", "parameter", "fixed", 0.0, parse("1"), (), "number of wave components", 0.0, float(COMPONENTS)
    ),
    _array("wave.amplitude", "m", "amplitude of each wave component", 0.0),
    _array("wave.frequency", "rad/s", "angular frequency of each wave component", 0.0),
    _array("wave.direction", "rad", "where each wave component runs to, counter-clockwise from x"),
    _array("wave.phase", "rad", "phase of each wave component at the origin"),
)

#: the states of a vessel in six degrees of freedom, those of its actuators follow
AFLOAT_STATES = (
    *(f"origin.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
    *(f"velocity_body.{axis}" for axis in "uvw"),
    *(f"rates.{axis}" for axis in "pqr"),
    "time",
)

#: how a floating vessel starts, level and at rest but for these
AFLOAT = (
    scalar("initial.heave", "m", "initial height above that at rest", "parameter"),
    scalar("initial.roll", "rad", "initial roll angle from that at rest", "parameter"),
    scalar("initial.pitch", "rad", "initial pitch angle from that at rest", "parameter"),
    scalar("initial.time", "s", "time of the waves at the start", "parameter"),
)


def initial(position_axes: str, velocity_axes: str, rate_axes: str) -> tuple[Variable, ...]:
    """Parameters that say where and how fast a vehicle starts, level and with its nose at a yaw angle."""
    return (
        *vector("initial.position", position_axes, "m", "initial centre of mass, world frame", "parameter"),
        scalar("initial.yaw", "rad", "initial yaw angle", "parameter"),
        *vector("initial.velocity_body", velocity_axes, "m/s", "initial velocity, body frame", "parameter"),
        *vector("initial.rates", rate_axes, "rad/s", "initial angular velocity, body frame", "parameter"),
    )
