"""Loads of propellers and rudders of vessels, as CasADi expressions.

    T_i = e_i (c_i n_i |n_i| - k_i |n_i| u_i)          u_i = a_i . (v_r + w x r_i)

n_i is the speed, c_i the thrust coefficient of its sense of rotation, k_i the loss by axial inflow
(Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd edition, chapter 9),
a_i the axis turned by the azimuth angle, e_i the immersed fraction of the height of the propeller.
The race of a propeller adds 2 max(c_i n_i |n_i|, 0) / (rho A_i) to the squared velocity at a
rudder, as in the momentum theory of the actuator disc.
"""

import math
from collections.abc import Sequence

import casadi as ca
from casadi import SX

from cosim.export.equations.c_code import sum_over_rows

from ..common.elementary_functions import arctangent, sine_and_cosine, sine_of_right_angle_share
from ..common.named_values import NamedValues, vector_rows
from .actuators import MAX_PROPELLERS, MAX_RUDDERS, MIN_TIME_CONSTANT

_PROPELLER_ROW = 13
_RUDDER_ROW = 7


def rudder_force(
    u: SX,
    v: SX,
    race: SX,
    angle: SX,
    turn: tuple[SX, SX],
    pressure_area: SX,
    stall_angle: SX,
) -> tuple[SX, SX]:
    """Return surge and sway force (N) of a rudder.

    The lift is a sine of the angle of attack up to the stall angle, as in the published simulator
    of the Strider (`strider/parameters.py`), and constant beyond.

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


def _propeller_term() -> ca.Function:
    """Return the function of one propeller to its load (6) about O.

    The common arguments are the velocity relative to the water (6), the depth of O and the change
    of the depth along x, y and z.
    """
    common, row = SX.sym("common", 10), SX.sym("row", _PROPELLER_ROW)
    velocity, rates, depth, slope = common[0:3], common[3:6], common[6], common[7:10]
    position, axis = row[0:3], row[3:6]
    azimuth, speed, forward, reverse, advance, half_per_radius, at_rest = ca.vertsplit(row[6:])
    sine, cosine = sine_and_cosine(azimuth)
    direction = ca.vertcat(
        cosine * axis[0] - sine * axis[1], sine * axis[0] + cosine * axis[1], axis[2]
    )
    height = (depth - ca.dot(slope, position)) * half_per_radius + at_rest
    immersed = ca.fmin(1, ca.fmax(0, height))
    inflow = ca.dot(direction, velocity + ca.cross(rates, position))
    size = ca.fabs(speed)
    thrust = immersed * size * (ca.if_else(speed > 0, forward, reverse) * speed - advance * inflow)
    force = thrust * direction
    return ca.Function("propeller", [common, row], [ca.vertcat(force, ca.cross(position, force))])


def _rudder_term() -> ca.Function:
    """Return the function of one rudder to its load (6) about O.

    The common arguments are u, v and r relative to the water.
    """
    common, row = SX.sym("common", 3), SX.sym("row", _RUDDER_ROW)
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


def derive_races(parameters: NamedValues) -> dict[str, SX]:
    """Return the constant "race" of vessels with rudders.

    It is 2 / (rho A) of the propeller ahead of each rudder (m2/s2/N), and 0 of the others. A row
    belongs to a rudder, a column to a propeller.
    """
    if "rudder_count" not in parameters:
        return {}
    radius = parameters["propeller_radius"]
    area = math.pi * radius * radius
    factors = ca.if_else(area > 0, 2 / parameters["water_density"] / ca.fmax(area, 1e-9), 0)
    rows = []
    for rudder in ca.vertsplit(parameters["rudder_propeller"]):
        row = [ca.if_else(rudder == k + 1, factors[k], 0) for k in range(radius.numel())]
        rows.append(ca.horzcat(*row))
    return {"race": ca.vertcat(*rows)}


def speeds(actuators: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the propeller speeds (rad/s).

    The states of those with a lag, else the limited commands.
    """
    return ca.if_else(
        constants["propeller_time_constant"] > 0, actuators, _commands(inputs, constants)
    )


def speed_rates(actuators: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the time derivatives of the propeller speeds (rad/s2), a first-order lag."""
    lag = constants["propeller_time_constant"]
    return ca.if_else(
        lag > 0, (_commands(inputs, constants) - actuators) / ca.fmax(lag, MIN_TIME_CONSTANT), 0
    )


def _commands(inputs: NamedValues, constants: NamedValues) -> SX:
    return _limited(
        inputs["propeller_speed"], -constants["max_reverse_speed"], constants["max_propeller_speed"]
    )


def _limited(value: SX, low: SX, high: SX) -> SX:
    return ca.fmin(ca.fmax(value, low), high)


def propeller_loads(
    speed: SX,
    flow: SX,
    depth: SX,
    slope: SX,
    inputs: NamedValues,
    constants: NamedValues,
) -> SX:
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
        vector_rows(constants, "propeller_position"),
        vector_rows(constants, "propeller_axis"),
        azimuth,
        speed,
        constants["thrust_coefficient"],
        constants["reverse_thrust_coefficient"],
        constants["advance_coefficient"],
        ca.if_else(radius > 0, 0.5 / ca.fmax(radius, 1e-9), 0),
        ca.if_else(radius > 0, 0.5, 1),
    ]
    table = _table(columns, MAX_PROPELLERS)
    return PROPELLER_SUM(ca.vertcat(flow, depth, slope), constants["propeller_count"], table)


def rudder_loads(speed: SX, flow: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the load (6) about O of all rudders.

    Args:
        speed: Propeller speeds (rad/s).
        flow: Velocity relative to the water, shape (6,).
        inputs: Inputs of the model.
        constants: Constants of the equations.
    """
    if "rudder_count" not in constants:
        return SX.zeros(6)
    limit = constants["max_rudder_angle"]
    thrust = constants["thrust_coefficient"] * ca.fmax(speed, 0) ** 2
    pressure = constants["water_density"] / 2 * constants["rudder_lift_coefficient"]
    columns = [
        vector_rows(constants, "rudder_position"),
        _limited(inputs["rudder_angle"], -limit, limit),
        constants["race"] @ thrust,
        pressure * constants["rudder_area"],
        constants["stall_angle"],
    ]
    common = ca.vertcat(flow[0], flow[1], flow[5])
    return RUDDER_SUM(common, constants["rudder_count"], _table(columns, MAX_RUDDERS))


def _table(columns: Sequence[SX], rows: int) -> SX:
    """Return a table with `rows` rows, of which those beyond the columns are 0."""
    table = ca.horzcat(*columns)
    return ca.vertcat(table, SX.zeros(rows - table.rows(), table.columns()))
