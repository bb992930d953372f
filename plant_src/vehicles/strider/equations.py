"""Equations of motion of the catamaran in the horizontal plane: surge, sway and yaw.

They are eqs. 9, 12 and 13 of the paper (`parameters.py`); README.md has them in the project's
notation. Loads (X, Y, N) are surge and sway force (N) and yaw moment (N m), body frame
forward-left-up.

The resistance is friction by the ITTC-57 line on the wetted surface (ITTC 1957, 8th conference,
Madrid), and a residuary part that is a smooth curve over the Froude number (`parameters.py`).
"""

import math

import casadi as ca
from casadi import SX

from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel
from cosim.export.fmu.block import Block

from ..common.elementary_functions import logarithm, sine_and_cosine
from ..common.interface import PLANAR_STATES
from ..common.named_values import ConstantsMap, NamedValues, initial_parameters, values_by_name
from ..common.rigid_body import with_world_outputs
from ..vessel import planar_maps
from ..vessel.propulsion import rudder_force
from . import parameters as p
from .interface import INPUTS, VARIABLES


def resistance(u: SX) -> SX:
    """Return the surge force (N) of both hulls for a surge velocity relative to the water (m/s)."""
    square = u * u
    coefficient = friction_coefficient(u) + residuary_coefficient(square)
    return -p.WATER_DENSITY / 2 * p.WETTED_SURFACE * coefficient * ca.fabs(u) * u


def friction_coefficient(u: SX) -> SX:
    """Return 0.075 / (log10 Re - 2)^2 for a speed (m/s), the ITTC-57 line.

    Slower flow has the value at `MIN_REYNOLDS_NUMBER`.
    """
    ratio = ca.fmax(1, ca.fabs(u) * (p.HULL_LENGTH / p.VISCOSITY / p.MIN_REYNOLDS_NUMBER))
    exponent = logarithm(ratio) * (1 / math.log(10)) + (math.log10(p.MIN_REYNOLDS_NUMBER) - 2)
    return 0.075 / (exponent * exponent)


def residuary_coefficient(square: SX) -> SX:
    """Return the residuary coefficient for a squared speed (m2/s2).

    It rises with Fn^2 to its maximum and falls with Fn^-2.
    """
    share = square * (1 / (p.GRAVITY * p.HULL_LENGTH * p.RESIDUARY_PEAK_FROUDE_NUMBER**2))
    return p.RESIDUARY_PEAK * 2 * share / (1 + share * share)


def rate(state: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the time derivative of the state (x, y, yaw, surge u, sway v, yaw rate r)."""
    yaw, u, v, r = ca.vertsplit(state[2:6])
    external_force, wind, current = inputs["external_force"], inputs["wind"], inputs["current"]
    sin, cos = sine_and_cosine(yaw)
    u_water = u - (cos * current[0] + sin * current[1])
    v_water = v - (cos * current[1] - sin * current[0])
    u_air, v_air = u - (cos * wind[0] + sin * wind[1]), v - (cos * wind[1] - sin * wind[0])
    race = race_velocity_squared(inputs["thrust"], constants["race_factor"])
    loads = (
        hull_loads(v_water, r)
        + air_drag(u_air, v_air)
        + rudder_loads(u_water, v_water, r, race, inputs["rudder_angle"])
    )
    loads[0] += constants["resistance"] * resistance(u_water)
    surge_force = loads[0] + inputs["thrust"] + cos * external_force[0] + sin * external_force[1]
    side_force = loads[1] - sin * external_force[0] + cos * external_force[1]
    moment = loads[2] + inputs["external_torque.z"]
    kinematic = (cos * u - sin * v, sin * u + cos * v, r)
    dynamic = (surge_force / p.MASS + v * r, side_force / p.MASS - u * r, moment / p.INERTIA[2])
    return ca.vertcat(*kinematic, *dynamic)


def hull_loads(v: SX, r: SX) -> SX:
    """Return (X, Y, N) of the hulls for sway velocity and yaw rate relative to the water."""
    return p.HULL_COUNT * ca.vertcat(0, p.Y_V * v + p.Y_R * r, p.N_V * v + p.N_R * r)


def air_drag(u: SX, v: SX) -> SX:
    """Return (X, Y, N) of the air for a surge and sway velocity (m/s) relative to the air."""
    return -p.AIR_DRAG * ca.vertcat(ca.fabs(u) * u, ca.fabs(v) * v, 0)


def hull_constants(parameters: NamedValues) -> dict[str, SX]:
    """Return the constants of resistance and propeller race.

    The race factor is 2 / (rho A) (m2/s2/N), 0 for a propeller with the diameter 0.
    """
    diameter = parameters["propeller_diameter"]
    area = math.pi / 4 * diameter * diameter
    factor = ca.if_else(area > 0, 2 / p.WATER_DENSITY / ca.fmax(area, 1e-9), 0)
    return {"resistance": parameters["resistance"], "race_factor": factor}


def race_velocity_squared(thrust: SX, factor: SX) -> SX:
    """Return what the propeller adds to the squared velocity at the rudder (m2/s2).

    In its fully developed race, the momentum theory of the actuator disc gives u_race^2 = u^2 +
    2 T / (rho A). Astern, the race leaves the rudder.

    Args:
        thrust: Thrust (N).
        factor: Constant "race_factor" (m2/s2/N).
    """
    return factor * ca.fmax(thrust, 0)


def rudder_loads(u: SX, v: SX, r: SX, race: SX, rudder_angle: SX) -> SX:
    """Return (X, Y, N) of the rudder.

    The lift is a sine of the angle of attack up to the stall angle.

    Args:
        u: Surge velocity relative to the water (m/s); the lift changes its sign when going astern.
        v: Sway velocity relative to the water (m/s).
        r: Yaw rate (rad/s).
        race: Value of `race_velocity_squared` (m2/s2).
        rudder_angle: Rudder angle (rad).
    """
    turn = ca.sin(rudder_angle), ca.cos(rudder_angle)
    pressure_area = SX(p.WATER_DENSITY / 2 * p.RUDDER_MAX_LIFT_COEFFICIENT * p.RUDDER_AREA)
    ahead, abeam = rudder_force(
        u, v - p.RUDDER_ARM * r, race, rudder_angle, turn, pressure_area, SX(p.STALL_ANGLE)
    )
    return ca.vertcat(ahead, abeam, -p.RUDDER_ARM * abeam)


def observe(state: SX) -> SX:
    """Return the motion outputs of the vessel and of its landing deck."""
    return planar_maps.planar_outputs(state, SX(p.CENTRE_OF_MASS_HEIGHT), SX(p.DECK_CENTRE))


#: map from the parameters to the constants of the equations
CONSTANTS = ConstantsMap(
    VARIABLES, lambda parameters: {**initial_parameters(parameters), **hull_constants(parameters)}
)


def model() -> ContinuousModel:
    """Return the equations of the catamaran."""
    return ContinuousModel(
        "strider",
        "Strider V1.0 catamaran on calm water",
        VARIABLES,
        PLANAR_STATES,
        # the first constants are position, yaw angle, velocity and yaw rate, as in the state
        lambda constants: constants[: len(PLANAR_STATES)],
        lambda state, inputs, constants: rate(
            state, values_by_name(inputs, INPUTS), CONSTANTS.by_name(constants)
        ),
        lambda state, _inputs, _constants: with_world_outputs(observe(state)),
        derived_parameters=CONSTANTS.vector,
    )


def block() -> Block:
    """Return the catamaran for export."""
    equations = model()
    body = planar_maps.PlanarBody(SX(p.MASS), SX(p.INERTIA[2]), SX(p.CENTRE_OF_MASS_HEIGHT))
    maps = planar_maps.PlanarContactMaps(
        equations, lambda _constants: body, lambda state, _constants: observe(state)
    )
    return as_block(equations, maps.functions())
