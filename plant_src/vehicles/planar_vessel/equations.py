"""Equations of motion of a vessel in the horizontal plane that is given by data.

State: position of the centre of mass (m, world frame), yaw angle, surge and sway velocity of the
centre of mass, yaw rate, and propeller speeds. With nu = (u, v, r) of the origin O, the current
nu_c in body axes and nu_r = nu - nu_c (Fossen 2021, Handbook of Marine Craft Hydrodynamics and
Motion Control, 2nd edition, chapters 3 and 6, in the axes forward-left-up):

    (M_RB + M_A) (nu' - nu_c') = tau - C_RB nu_r - C_A(nu_r) nu_r - D nu_r
                                 - (|u_r| D_u + |v_r| D_v + |r| D_r) nu_r - d nu_r^3
    nu_c' = (r v_c, -r u_c, 0)

tau are the loads of propellers, rudders and air, and the external load at the centre of mass. One
binary holds the equations of all planar vessels; all values are parameters.
"""

import casadi as ca
import numpy as np
from casadi import SX

from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel
from cosim.export.fmu.block import Block

from ..common.elementary_functions import sine_and_cosine
from ..common.named_values import (
    ConstantsMap,
    NamedValues,
    square_matrix,
    values_by_name,
    variables_of,
)
from ..common.rigid_body import with_world_outputs
from ..vessel import planar_maps, propulsion
from ..vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS, Propeller
from .planar_vessel import PlanarVessel, states, variables

_BODY_STATES = 6
_FAR_BELOW = 1e3  # m; propellers of planar vessels are always immersed


def planar_vessel_model(
    vessel: PlanarVessel, description: str, slots: tuple[int, int]
) -> ContinuousModel:
    """Return the model to export of a planar vessel; its contact outputs are 0.

    Args:
        vessel: Vessel with the start values.
        description: Description of the FMU.
        slots: Numbers of elements of the arrays of propellers and rudders.
    """
    declared = variables(vessel, slots)
    constants, given = ConstantsMap(declared, derive_constants), variables_of(declared, "input")
    return ContinuousModel(
        vessel.name,
        description,
        declared,
        states(slots[0]),
        lambda c: initial_state(constants.by_name(c), slots[0]),
        lambda x, u, c: rate(x, values_by_name(u, given), constants.by_name(c)),
        lambda x, _u, c: with_world_outputs(observe(x, constants.by_name(c))),
        derived_parameters=constants.vector,
        callees=(propulsion.PROPELLER_SUM, *([propulsion.RUDDER_SUM] if slots[1] else [])),
    )


def derive_constants(parameters: NamedValues) -> dict[str, SX]:
    """Return the constants of the equations."""
    x, y, _ = ca.vertsplit(parameters["centre_of_mass"])
    mass = parameters["mass"]
    # nu of the centre of mass from nu of O
    to_centre = ca.blockcat([[1, 0, -y], [0, 1, x], [0, 0, 1]])
    rigid = to_centre.T @ ca.diag(ca.vertcat(mass, mass, parameters["yaw_inertia"])) @ to_centre
    return {
        **{name: value for name, value in parameters.items() if name != "rudder_propeller"},
        **propulsion.derive_races(parameters),
        "rigid_body_mass": rigid,
        "inverse_mass_matrix": ca.inv(rigid + square_matrix(parameters["added_mass"])),
    }


def rate(state: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the time derivative of the state."""
    yaw, u, v, r = ca.vertsplit(state[2:_BODY_STATES])
    sin, cos = sine_and_cosine(yaw)
    x, y, _ = ca.vertsplit(constants["centre_of_mass"])
    to_body = ca.vertcat(ca.horzcat(cos, sin), ca.horzcat(-sin, cos))
    current = to_body @ inputs["current"]
    absolute = ca.vertcat(u + r * y, v - r * x, r)  # nu of O
    relative = absolute - ca.vertcat(current, 0)
    air = absolute[0:2] - to_body @ inputs["wind"][0:2]
    actuators = state[_BODY_STATES:]
    load = water_loads(actuators, relative, inputs, constants)
    drag = -constants["air_drag"] * ca.fabs(air) * air
    load += _load_at(constants["air_centre"], drag)
    load += _load_at(constants["centre_of_mass"], to_body @ inputs["external_force"][0:2])
    load += ca.vertcat(0, 0, inputs["external_torque.z"])
    added = square_matrix(constants["coriolis_added_mass"])
    load -= coriolis(constants["rigid_body_mass"], relative) + coriolis(added, relative)
    acceleration = constants["inverse_mass_matrix"] @ load
    # rate of a steady current in the axes of the turning vessel
    acceleration += ca.vertcat(r * current[1], -r * current[0], 0)
    yaw_acceleration = acceleration[2]
    centre = acceleration[0:2] + yaw_acceleration * ca.vertcat(-y, x)
    kinematic = ca.vertcat(to_body.T @ ca.vertcat(u, v), r)
    return ca.vertcat(
        kinematic, centre, yaw_acceleration, propulsion.speed_rates(actuators, inputs, constants)
    )


def coriolis(mass: SX, nu: SX) -> SX:
    """Return C(nu) nu of a mass matrix (3, 3) (Fossen 2021, section 3.3, in three velocities)."""
    momentum = mass @ nu
    return ca.vertcat(
        -nu[2] * momentum[1], nu[2] * momentum[0], nu[0] * momentum[1] - nu[1] * momentum[0]
    )


def water_loads(actuators: SX, relative: SX, inputs: NamedValues, constants: NamedValues) -> SX:
    """Return the load (X, Y, N) about O of water, propellers and rudders."""
    load = square_matrix(constants["linear_damping"]) @ relative
    for k, letter in enumerate("uvr"):
        matrix = square_matrix(constants[f"quadratic_damping.{letter}"])
        load += ca.fabs(relative[k]) * (matrix @ relative)
    load += ca.vertcat(*(constants[f"cubic_damping.{letter}"] for letter in "uvr")) * relative**3
    speed = propulsion.speeds(actuators, inputs, constants)
    flow = ca.vertcat(relative[0:2], 0, 0, 0, relative[2])
    driving = propulsion.propeller_loads(
        speed, flow, SX(_FAR_BELOW), SX.zeros(3), inputs, constants
    )
    driving += propulsion.rudder_loads(speed, flow, inputs, constants)
    return ca.vertcat(driving[0:2], driving[5]) - load


def _load_at(point: SX, force: SX) -> SX:
    return ca.vertcat(force, point[0] * force[1] - point[1] * force[0])


def initial_state(constants: NamedValues, slots: int) -> SX:
    """Return the state at the start; the propellers rest."""
    initial = ca.vertcat(
        constants["initial.position"], constants["initial.yaw"], constants["initial.velocity_body"]
    )
    return ca.vertcat(initial, constants["initial.rates"], SX.zeros(slots))


def observe(state: SX, constants: NamedValues) -> SX:
    """Return the motion outputs of the vessel and of its landing deck."""
    centre = constants["centre_of_mass"]
    height, deck = constants["height"] + centre[2], constants["deck_centre"] - centre
    return planar_maps.planar_outputs(state, height, deck)


def planar_vessel_block(
    vessel: PlanarVessel, description: str, slots: tuple[int, int] | None = None
) -> Block:
    """Return a planar vessel for export.

    Args:
        vessel: Vessel with the start values.
        description: Description of the FMU.
        slots: Numbers of slots of propellers and rudders. None means the numbers of the vessel.
    """
    model = planar_vessel_model(vessel, description, slots or vessel.slots)
    model = model.with_called_derivatives()
    by_name = ConstantsMap(model.variables, derive_constants).by_name

    def body(constants: SX) -> planar_maps.PlanarBody:
        known = by_name(constants)
        return planar_maps.PlanarBody(
            known["mass"], known["yaw_inertia"], known["height"] + known["centre_of_mass"][2]
        )

    maps = planar_maps.PlanarContactMaps(model, body, lambda x, c: observe(x, by_name(c)))
    return as_block(model, maps.functions())


_ZERO = np.zeros((3, 3))

#: vessel of 30 kg with two propellers; the start values of the FMU
VESSEL = PlanarVessel(
    name="planar_vessel",
    mass=30.0,
    yaw_inertia=6.0,
    centre_of_mass=(0.0, 0.0, 0.0),
    height=0.0,
    added_mass=np.diag([2.0, 20.0, 3.0]),
    coriolis_added_mass=np.diag([2.0, 20.0, 3.0]),
    linear_damping=np.diag([10.0, 40.0, 20.0]),
    quadratic_damping=(_ZERO, _ZERO, _ZERO),
    cubic_damping=(0.0, 0.0, 0.0),
    air_drag=(0.0, 0.0),
    air_centre=(0.0, 0.0, 0.0),
    deck_centre=(0.0, 0.0, 0.2),
    propellers=tuple(
        Propeller(label, (-0.5, y, -0.15), (1.0, 0.0, 0.0), 4e-3, 3e-3, 100.0, 100.0)
        for label, y in (("port", 0.3), ("starboard", -0.3))
    ),
    rudders=(),
)


def block() -> Block:
    """Return the planar vessel for export."""
    text = "Vessel in the horizontal plane with up to 16 propellers and 16 rudders"
    return planar_vessel_block(VESSEL, text, (MAX_PROPELLERS, MAX_RUDDERS))
