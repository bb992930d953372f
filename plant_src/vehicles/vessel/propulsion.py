"""Loads of propellers and rudders."""

from __future__ import annotations

import math
from collections.abc import Sequence

import casadi as ca

from cosim.export.equations.simd_sum import sum_over_rows

from ..common.elementary_functions import arctangent, sine_and_cosine, sine_of_right_angle_share
from ..common.named_values import NamedValues
from .actuators import MAX_PROPELLERS, MAX_RUDDERS, MIN_TIME_CONSTANT

_PROPELLER_ROW = 13
_RUDDER_ROW = 7


def _propeller_term() -> ca.Function:
    """Return the function of one propeller to its load (6) about O.

    The common arguments are the velocity relative to the water (6), the depth of O and the change
    of the depth along x, y and z.
    """
    common, row = ca.SX.sym("common", 10), ca.SX.sym("row", _PROPELLER_ROW)
    velocity, rates, depth, slope = common[0:3], common[3:6], common[6], common[7:10]
    position, axis = row[0:3], row[3:6]
    azimuth, speed, forward, reverse, advance, half_per_radius, immersed_at_rest = ca.vertsplit(
        row[6:]
    )
    sine, cosine = sine_and_cosine(azimuth)
    direction = ca.vertcat(
        cosine * axis[0] - sine * axis[1], sine * axis[0] + cosine * axis[1], axis[2]
    )
    immersed = ca.fmin(
        1, ca.fmax(0, (depth - ca.dot(slope, position)) * half_per_radius + immersed_at_rest)
    )
    inflow = ca.dot(direction, velocity + ca.cross(rates, position))
    size = ca.fabs(speed)
    thrust = immersed * size * (ca.if_else(speed > 0, forward, reverse) * speed - advance * inflow)
    force = thrust * direction
    return ca.Function("propeller", [common, row], [ca.vertcat(force, ca.cross(position, force))])


def _rudder_term() -> ca.Function:
    """Return the function of one rudder to its load (6) about O.

    The common arguments are u, v and r relative to the water.
    """
    common, row = ca.SX.sym("common", 3), ca.SX.sym("row", _RUDDER_ROW)
    u, v, r = ca.vertsplit(common)
    x, y, z, angle, race, pressure_area, stall_angle = ca.vertsplit(row)
    turn = sine_and_cosine(angle)
    ahead, abeam = rudder_force(
        u - y * r, v + x * r, race, angle, turn, pressure_area, ca.fmax(stall_angle, 1e-6)
    )
    force = ca.vertcat(ahead, abeam, 0)
    return ca.Function(
        "rudder", [common, row], [ca.vertcat(force, ca.cross(ca.vertcat(x, y, z), force))]
    )


#: sums over all propellers and rudders, which the equations call as loops in C
PROPELLER_SUM = sum_over_rows("propellers", _propeller_term(), MAX_PROPELLERS)
RUDDER_SUM = sum_over_rows("rudders", _rudder_term(), MAX_RUDDERS)


def derive_races(parameters: NamedValues) -> dict[str, ca.SX]:
    """Return the constant "race" of vessels with rudders.

    2 / (rho A) of the propeller ahead of each rudder (m2/s2/N).

    A row belongs to a rudder, a column to a propeller.
    """
    if "rudder_count" not in parameters:
        return {}
    radius = parameters["propeller_radius"]
    area = math.pi * radius * radius
    factors = ca.if_else(area > 0, 2 / parameters["water_density"] / ca.fmax(area, 1e-9), 0)
    rows = [
        [
            ca.if_else(rudder == number, factors[number - 1], 0)
            for number in range(1, radius.numel() + 1)
        ]
        for rudder in ca.vertsplit(parameters["rudder_propeller"])
    ]
    return {"race": ca.vertcat(*(ca.horzcat(*row) for row in rows))}


def speeds(actuators: ca.SX, inputs: NamedValues, constants: NamedValues) -> ca.SX:
    """Return the propeller speeds (rad/s).

    The states of those with a lag, else the limited commands.
    """
    return ca.if_else(
        constants["propeller_time_constant"] > 0, actuators, _commands(inputs, constants)
    )


def speed_rates(actuators: ca.SX, inputs: NamedValues, constants: NamedValues) -> ca.SX:
    """Return the time derivatives of the propeller speeds (rad/s2), a first-order lag."""
    lag = constants["propeller_time_constant"]
    return ca.if_else(
        lag > 0, (_commands(inputs, constants) - actuators) / ca.fmax(lag, MIN_TIME_CONSTANT), 0
    )


def _commands(inputs: NamedValues, constants: NamedValues) -> ca.SX:
    return _limited(
        inputs["propeller_speed"], -constants["max_reverse_speed"], constants["max_propeller_speed"]
    )


def _limited(value: ca.SX, low: ca.SX, high: ca.SX) -> ca.SX:
    return ca.fmin(ca.fmax(value, low), high)


def propeller_loads(
    speed: ca.SX,
    flow: ca.SX,
    depth: ca.SX,
    slope: ca.SX,
    inputs: NamedValues,
    constants: NamedValues,
) -> ca.SX:
    """Return the load (6) about O of all propellers.

    Args:
        speed: Propeller speeds (rad/s).
        flow: Velocity relative to the water, shape (6,).
        depth: Depth of O below the surface (m).
        slope: Decrease of the depth along x, y and z of the body, shape (3,).
        inputs: Inputs of the model.
        constants: Constants of the equations.
    """
    limit, radius = constants["max_azimuth"], constants["propeller_radius"]
    azimuth = _limited(inputs["azimuth"], -limit, limit) if "azimuth" in inputs else 0 * limit
    columns = [
        *(
            constants[f"propeller_{name}.{letter}"]
            for name in ("position", "axis")
            for letter in "xyz"
        ),
        *(azimuth, speed, constants["thrust_coefficient"], constants["reverse_thrust_coefficient"]),
        constants["advance_coefficient"],
        ca.if_else(radius > 0, 0.5 / ca.fmax(radius, 1e-9), 0),
        ca.if_else(radius > 0, 0.5, 1),
    ]
    table = _table(columns, MAX_PROPELLERS)
    return PROPELLER_SUM(ca.vertcat(flow, depth, slope), constants["propeller_count"], table)


def rudder_loads(speed: ca.SX, flow: ca.SX, inputs: NamedValues, constants: NamedValues) -> ca.SX:
    """Return the load (6) about O of all rudders for propeller speeds (rad/s) and a velocity (6) relative to the water."""
    if "rudder_count" not in constants:
        return ca.SX.zeros(6)
    limit = constants["max_rudder_angle"]
    thrust = constants["thrust_coefficient"] * ca.fmax(speed, 0) ** 2
    pressure_area = (
        constants["water_density"]
        / 2
        * constants["rudder_lift_coefficient"]
        * constants["rudder_area"]
    )
    columns = [
        *(constants[f"rudder_position.{letter}"] for letter in "xyz"),
        *(
            _limited(inputs["rudder_angle"], -limit, limit),
            constants["race"] @ thrust,
            pressure_area,
            constants["stall_angle"],
        ),
    ]
    return RUDDER_SUM(
        ca.vertcat(flow[0], flow[1], flow[5]),
        constants["rudder_count"],
        _table(columns, MAX_RUDDERS),
    )


def _table(columns: Sequence[ca.SX], rows: int) -> ca.SX:
    """Return a table with `rows` rows, of which those beyond the columns are 0."""
    filled = [ca.vertcat(column, ca.SX.zeros(rows - column.numel())) for column in columns]
    return ca.horzcat(*filled)


def rudder_force(
    u: ca.SX,
    v: ca.SX,
    race: ca.SX,
    angle: ca.SX,
    turn: tuple[ca.SX, ca.SX],
    pressure_area: ca.SX,
    stall_angle: ca.SX,
) -> tuple[ca.SX, ca.SX]:
    """Return surge and sway force (N).

    The lift is a sine of the angle of attack up to the stall angle.

    Args:
        u: Surge velocity relative to the water at the rudder (m/s); the lift changes its sign when
            going astern.
        v: Sway velocity relative to the water at the rudder (m/s).
        race: What a propeller adds to the squared velocity at the rudder (m2/s2).
        angle: Rudder angle (rad).
        turn: Sine and cosine of the rudder angle.
        pressure_area: rho / 2 times maximum lift coefficient times area (kg/m).
        stall_angle: Angle of attack beyond which the lift is constant (rad).
    """
    pressure = ca.fabs(u) * u + race
    ahead = ca.sign(pressure)
    inflow_angle = arctangent(ahead * v, ca.sqrt(ca.fabs(pressure)))
    attack = ca.fmin(1, ca.fmax(-1, (angle - inflow_angle) / stall_angle))
    lift = pressure_area * pressure * sine_of_right_angle_share(attack)
    return -lift * turn[0], lift * turn[1]
