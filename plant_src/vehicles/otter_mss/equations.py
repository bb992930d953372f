"""Equations of motion of the Otter exactly as in MSS, with its linear hydrostatics.

README.md has the loads, `vehicles/README.md` the rest.
"""

from collections.abc import Mapping

import casadi as ca
from casadi import SX

from cosim.export.fmu.block import Block

from ..common import kinematics
from ..common.named_values import NamedValues, initial_parameters
from ..otter import parameters as p
from ..otter.interface import PROPELLER_STATES, VARIABLES
from ..otter.loads import (
    added_mass,
    cross_flow_drag,
    damping,
    linear_damping,
    mass_properties,
    otter_model,
    propulsion,
    wind,
)
from ..vessel.hull import (
    Frame,
    Hull,
    LoadArguments,
    hull_of,
    load_of_force_at,
    rigid_body_mass_matrix,
    transformation_matrix,
)
from ..vessel.strips import TwinHull, equivalent_strips
from ..vessel.vessel_equations import VesselModel, floating_block, wave_table_of

_CENTRE_OF_FLOTATION = SX(p.CENTRE_OF_FLOTATION)
_STRIPS = equivalent_strips(
    _CENTRE_OF_FLOTATION,
    (SX(p.TRANSVERSE_MOMENT), SX(p.MSS_LONGITUDINAL_MOMENT)),
    SX(p.WATERPLANE_AREA),
)


def hydrostatics(mass: SX, centre: SX) -> dict[str, SX]:
    """Return the hydrostatics for a mass (kg) and a centre of mass (m, body frame).

    Returns:
        "draught" (m); "stiffness", the restoring stiffness of heave (N/m), roll and pitch (N m/rad)
        at the centre of flotation, shape (3,); "compliance", heave (m), roll and pitch (rad) over
        heave force (N), roll and pitch moment (N m) at O, shape (3, 3).
    """
    volume = mass / p.WATER_DENSITY
    draught = volume / (2 * p.BLOCK_COEFFICIENT * p.PONTOON_BEAM * p.LENGTH)
    moments = SX([p.TRANSVERSE_MOMENT, p.MSS_LONGITUDINAL_MOMENT])
    buoyancy_height = (5 * draught / 2 - volume / (2 * p.LENGTH * p.PONTOON_BEAM)) / 3
    metacentric_heights = buoyancy_height + moments / volume - (draught + centre[2])
    weight = p.WATER_DENSITY * p.GRAVITY
    stiffness = ca.vertcat(weight * p.WATERPLANE_AREA, weight * volume * metacentric_heights)
    to_flotation = transformation_matrix(SX(p.CENTRE_OF_FLOTATION))[2:5, 2:5]
    compliance = ca.inv(to_flotation.T @ ca.diag(stiffness) @ to_flotation)
    return {"draught": draught, "stiffness": stiffness, "compliance": compliance}


def derive_constants(parameters: NamedValues) -> dict[str, SX]:
    """Return the constants of the equations."""
    mass, centre, inertia = mass_properties(parameters)
    added = added_mass(inertia)
    mass_matrix = rigid_body_mass_matrix(mass, centre, inertia) + ca.diag(added)
    floating = hydrostatics(mass, centre)
    # pontoons for the mean draught, volume over waterplane
    pontoons = TwinHull(
        _STRIPS,
        SX(p.PONTOON_BEAM),
        mass / p.WATER_DENSITY / p.WATERPLANE_AREA,
        SX(p.PONTOON_TOP - p.PONTOON_BOTTOM),
        SX(p.WATERPLANE_AREA),
    )
    constants = {
        **initial_parameters(parameters),
        "mass": mass,
        "centre_of_mass": centre,
        "inertia": inertia,
        "added_mass": added,
        "inverse_mass_matrix": ca.inv(mass_matrix),
        **floating,
        "damping": linear_damping(ca.diag(mass_matrix), floating["stiffness"]),
        "drag": cross_flow_drag(floating["draught"]),
        "payload_force": -parameters["payload_mass"] * p.GRAVITY,
        "payload_position": parameters["payload_position"],
        "propeller_time_constant": parameters["propeller_time_constant"],
        "wave.count": parameters["wave.count"],
        "wave_table": wave_table_of(parameters, pontoons),
    }
    return constants | {"equilibrium": _equilibrium(constants)}


def trim(constants: Mapping[str, SX], attitude: SX) -> SX:
    """Return height of O (m), roll and pitch (rad) due to the payload, shape (3,).

    `attitude` is the rotation matrix body to world frame.
    """
    force = attitude.T @ ca.vertcat(0, 0, constants["payload_force"])
    load = load_of_force_at(constants["payload_position"], force)
    return constants["compliance"] @ load[2:5]


def _equilibrium(constants: Mapping[str, SX]) -> SX:
    """Return the trim at rest by fixed-point iteration.

    Each step reduces the error to less than a tenth.
    """
    equilibrium = SX.zeros(3)
    for _ in range(20):
        orientation = kinematics.quaternion_from_euler(equilibrium[1], equilibrium[2], SX(0))
        equilibrium = trim(constants, kinematics.rotation_matrix(orientation))
    return equilibrium


def frame(constants: NamedValues, orientation: SX) -> Frame:
    """Return the rotations.

    As in MSS, velocities are expressed in the frame with the Euler angles of the hull minus the
    trim.

    The current is rotated by the yaw angle only, as in MSS.
    """
    attitude = kinematics.rotation_matrix(orientation)
    roll, pitch, yaw = ca.vertsplit(kinematics.euler_angles(orientation))
    _, roll_at_rest, pitch_at_rest = ca.vertsplit(trim(constants, attitude))
    level = roll - roll_at_rest, pitch - pitch_at_rest
    to_world = kinematics.rotation_matrix(kinematics.quaternion_from_euler(*level, yaw))
    spin = kinematics.euler_to_body_rates(roll, pitch) @ kinematics.body_to_euler_rates(*level)
    return Frame(
        attitude, to_world, spin, kinematics.rotation_matrix(kinematics.quaternion_about_z(yaw)).T
    )


def hull(constants: NamedValues) -> Hull:
    """Return the vessel with these constants."""
    added = ca.diag(constants["added_mass"])
    return hull_of(
        constants,
        inertia=constants["inertia"],
        added_mass=added,
        coriolis_added_mass=added,
        deck_centre=SX(p.DECK_CENTRE),
        strips=_STRIPS,
        loads=lambda now: (
            propulsion(constants, now)
            + damping(constants, now)
            + restoring(constants, now)
            + wind(now)
            + now.froude_krylov_load(constants["mass"], constants["centre_of_mass"], _STRIPS)
        ),
        frame=lambda orientation: frame(constants, orientation),
    )


def restoring(constants: NamedValues, now: LoadArguments) -> SX:
    """Return the restoring load tau.

    It is linear in heave, roll and pitch relative to the trim and to the water surface.
    """
    angles = kinematics.euler_angles(now.orientation)[0:2]
    displacement = ca.vertcat(now.height, angles) - trim(constants, now.frame.attitude)
    to_flotation = transformation_matrix(_CENTRE_OF_FLOTATION)[2:5, 2:5]
    surface = ca.vertcat(now.water.heave, now.water.slopes)
    load = -to_flotation.T @ (constants["stiffness"] * (to_flotation @ displacement - surface))
    return ca.vertcat(0, 0, load, 0)


VESSEL = VesselModel(
    "otter_mss",
    "Maritime Robotics Otter of MSS with linear restoring",
    VARIABLES,
    derive_constants,
    hull,
    PROPELLER_STATES,
)


def block() -> Block:
    """Return the Otter of MSS for export."""
    return floating_block(otter_model(VESSEL), VESSEL, p.BODY)
