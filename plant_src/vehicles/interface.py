"""Variables that vehicles have in common: their names, units and order, for the plant FMUs and for the world alike.

World frame: x, y horizontal, z up. Body frame: x forward, y left, z up, origin at the centre of mass. Right-hand rule
throughout: positive roll lifts the left side, positive pitch lowers the nose, positive yaw is counter-clockwise from above.
"""

from __future__ import annotations

from collections.abc import Sequence

from cosim.component import Causality, Variability, Variable
from cosim.units import parse


def vector(name: str, axes: Sequence[str], unit: str, description: str, causality: Causality = "output") -> tuple[Variable, ...]:
    """Scalar variables `name.axis`, one for each axis."""
    variability: Variability = "fixed" if causality == "parameter" else "continuous"
    start = None if causality == "output" else 0.0
    return tuple(
        Variable(f"{name}.{axis}", "Float64", causality, variability, start, parse(unit), description=f"{description}: {axis}")
        for axis in axes
    )


def scalar(name: str, unit: str, description: str, causality: Causality = "input") -> Variable:
    """One real variable that starts at zero."""
    variability: Variability = "fixed" if causality == "parameter" else "continuous"
    return Variable(name, "Float64", causality, variability, 0.0, parse(unit), description=description)


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


def initial(position_axes: str, velocity_axes: str, rate_axes: str) -> tuple[Variable, ...]:
    """Parameters that say where and how fast a vehicle starts, level and with its nose at a yaw angle."""
    return (
        *vector("initial.position", position_axes, "m", "initial centre of mass, world frame", "parameter"),
        scalar("initial.yaw", "rad", "initial yaw angle", "parameter"),
        *vector("initial.velocity_body", velocity_axes, "m/s", "initial velocity, body frame", "parameter"),
        *vector("initial.rates", rate_axes, "rad/s", "initial angular velocity, body frame", "parameter"),
    )
