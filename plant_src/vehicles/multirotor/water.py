"""Forces of water on a multirotor.

Buoyancy, drag and added mass of its body, and rotors without thrust below the surface.

With the height d of the surface above the centre of mass and the edges l, b, h of the box around
the body, the immersed fraction is s = clamp(d / h + 1/2, 0, 1) at every attitude. u is the velocity
relative to the current, body frame:

    F = rho g V s e_z - s R(q) (|u| D u)       D = rho C_D / 2 diag(b h, l h, l b)
    T = -s |w| K w                             K = rho C_D / 64 diag(l b^4, b l^4, h (l^4 + b^4))
    m_a = 0.68 s rho l b h                     added mass, that of a cube in all directions
    (DNV-RP-H103, table A-2)

The buoyancy acts at the centre of mass. K is the integral of the drag of flat plates that turn
about their centre lines. Added inertia and the pressure peak of the impact on the surface are
neglected. The aerodynamic loads of a rotor are those of the speed n_i e_i, with e_i = clamp((z_i -
level) / R + 1/2, 0, 1) of the height z_i of its hub.
"""

from __future__ import annotations

import casadi as ca

from ..common import kinematics
from ..common.named_values import NamedValues

WATER_DENSITY = 1025.0  # kg/m3, sea water

_ADDED_MASS_COEFFICIENT = 0.68
_SMALLEST_HEIGHT = 1e-3  # m, replaces the height of a hull without size


def emerged_fractions(state: ca.SX, inputs: NamedValues, constants: NamedValues) -> ca.SX:
    """Return the fraction of each rotor's speed that acts on air, shape (slots,)."""
    up = kinematics.rotation_matrix(state[3:7])[2, :]
    hubs = ca.horzcat(*(constants[f"rotor_position.{axis}"] for axis in "xyz"))
    heights = state[2] + hubs @ up.T
    return _clamp((heights - inputs["water_level"]) / constants["rotor_radius"] + 0.5)


def add_water_loads(
    rate: ca.SX, state: ca.SX, inputs: NamedValues, constants: NamedValues
) -> ca.SX:
    """Return the rate of the rigid-body states with the loads of the water.

    Args:
        rate: Time derivative without water.
        state: States of the rigid body.
        inputs: Inputs of the model.
        constants: Constants of the equations.
    """
    to_world, rates = kinematics.rotation_matrix(state[3:7]), state[10:13]
    length, width, height = ca.vertsplit(constants["hull_size"])
    immersed = _clamp((inputs["water_level"] - state[2]) / ca.fmax(height, _SMALLEST_HEIGHT) + 0.5)
    flow = to_world.T @ (state[7:10] - ca.vertcat(inputs["current"], 0))
    pressure = WATER_DENSITY * constants["water_drag_coefficient"] / 2
    areas = ca.vertcat(width * height, length * height, length * width)
    moments = ca.vertcat(length * width**4, width * length**4, height * (length**4 + width**4)) / 32
    buoyancy = WATER_DENSITY * constants["displaced_volume"] * constants["gravity"]
    force = ca.vertcat(0, 0, buoyancy) - to_world @ (ca.norm_2(flow) * pressure * areas * flow)
    torque = -ca.norm_2(rates) * pressure * moments * rates
    mass, added = (
        constants["mass"],
        immersed * _ADDED_MASS_COEFFICIENT * WATER_DENSITY * length * width * height,
    )
    acceleration = (mass * rate[7:10] + immersed * force) / (mass + added)
    return ca.vertcat(
        rate[0:7], acceleration, rate[10:13] + constants["inverse_inertia"] @ (immersed * torque)
    )


def _clamp(value: ca.SX) -> ca.SX:
    return ca.fmin(ca.fmax(value, 0), 1)
