"""Force of a rudder, as CasADi expressions."""

from __future__ import annotations

import casadi as ca

from ..common.elementary_functions import arctangent, sine_of_right_angle_share


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
