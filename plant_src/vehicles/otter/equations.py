"""Equations of motion of the Otter in six degrees of freedom; README.md has the loads, `vehicles/README.md` the rest."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel
from cosim.export.fmu.block import Block

from ..common import kinematics
from ..common.interface import VESSEL_STATES
from ..common.named_values import NamedValues, initial_parameters, values_by_name, variables_of
from ..vessel import floating_maps, vessel_equations
from ..vessel import hull as vessel
from ..vessel.hull import Frame, Hull, LoadArguments, load_of_force_at, transformation_matrix
from ..vessel.strips import TwinHull, equivalent_strips
from . import hydrostatics
from . import parameters as p
from .geometry import BODY
from .interface import PROPELLER_STATES, VARIABLES

_CENTRE_OF_FLOTATION = ca.SX(p.CENTRE_OF_FLOTATION)
_STRIPS = equivalent_strips(
    _CENTRE_OF_FLOTATION, (ca.SX(p.TRANSVERSE_MOMENT), ca.SX(p.LONGITUDINAL_MOMENT)), ca.SX(p.WATERPLANE_AREA)
)


def derive_constants(parameters: NamedValues) -> dict[str, ca.SX]:
    """Return the constants of the equations."""
    payload, position, hull_centre = parameters["payload_mass"], parameters["payload_position"], ca.SX(p.HULL_CENTRE)
    mass = p.HULL_MASS + payload
    centre = (p.HULL_MASS * hull_centre + payload * position) / mass
    inertia = p.HULL_MASS * ca.diag(ca.SX(p.RADII_OF_GYRATION) ** 2)
    for part, point in ((p.HULL_MASS, hull_centre), (payload, position)):
        lever = ca.skew(point - centre)
        inertia -= part * lever @ lever
    added = added_mass(inertia)
    mass_matrix = vessel.rigid_body_mass_matrix(mass, centre, inertia) + ca.diag(added)
    floating = hydrostatics.hydrostatics(mass, centre)
    constants = {
        **initial_parameters(parameters),
        "mass": mass,
        "centre_of_mass": centre,
        "inertia": inertia,
        "added_mass": added,
        "inverse_mass_matrix": ca.inv(mass_matrix),
        "draught": floating.draught,
        "stiffness": floating.stiffness,
        "compliance": floating.compliance,
        "damping": hydrostatics.linear_damping(ca.diag(mass_matrix), floating.stiffness),
        "drag": hydrostatics.cross_flow_drag(floating.draught),
        "payload_force": -payload * p.GRAVITY,
        "payload_position": position,
        "propeller_time_constant": parameters["propeller_time_constant"],
        "wave.count": parameters["wave.count"],
        "wave_table": vessel_equations.wave_table_of(parameters, _twin_hull(floating.mean_draught)),
    }
    return constants | {"equilibrium": _equilibrium(constants)}


def added_mass(inertia: ca.SX) -> ca.SX:
    """Return the diagonal of M_A, shape (6,), for an inertia about the centre of mass (kg m2)."""
    masses = [p.SURGE_ADDED_MASS, *(ratio * p.HULL_MASS for ratio in p.ADDED_MASS_SHARES)]
    return ca.vertcat(ca.SX(masses), ca.SX(p.ADDED_INERTIA_SHARES) * ca.diag(inertia))


def trim(constants: Mapping[str, ca.SX], attitude: ca.SX) -> ca.SX:
    """Return height of O (m), roll and pitch (rad) due to the payload for a rotation matrix body to world, shape (3,)."""
    force = attitude.T @ ca.vertcat(0, 0, constants["payload_force"])
    load = load_of_force_at(constants["payload_position"], force)
    return constants["compliance"] @ load[2:5]


def _equilibrium(constants: Mapping[str, ca.SX]) -> ca.SX:
    """Return the trim at rest by fixed-point iteration, which reduces the error to less than a tenth in each step."""
    equilibrium = ca.SX.zeros(3)
    for _ in range(20):
        orientation = kinematics.quaternion_from_euler(equilibrium[1], equilibrium[2], ca.SX(0))
        equilibrium = trim(constants, kinematics.rotation_matrix(orientation))
    return equilibrium


def frame(constants: NamedValues, orientation: ca.SX) -> Frame:
    """Return the rotations: as in MSS, velocities are expressed in the frame with the Euler angles of the hull minus the trim.

    The current is rotated by the yaw angle only, as in MSS.
    """
    attitude = kinematics.rotation_matrix(orientation)
    roll, pitch, yaw = ca.vertsplit(kinematics.euler_angles(orientation))
    _, roll_at_rest, pitch_at_rest = ca.vertsplit(trim(constants, attitude))
    level = roll - roll_at_rest, pitch - pitch_at_rest
    to_world = kinematics.rotation_matrix(kinematics.quaternion_from_euler(*level, yaw))
    spin = kinematics.euler_to_body_rates(roll, pitch) @ kinematics.body_to_euler_rates(*level)
    return Frame(attitude, to_world, spin, kinematics.rotation_matrix(kinematics.quaternion_about_z(yaw)).T)


def hull(constants: NamedValues) -> Hull:
    """Return the vessel with these constants."""
    added = ca.diag(constants["added_mass"])
    return Hull(
        mass=constants["mass"],
        centre_of_mass=constants["centre_of_mass"],
        inertia=constants["inertia"],
        added_mass=added,
        coriolis_added_mass=added,
        inverse_mass_matrix=constants["inverse_mass_matrix"],
        deck_centre=ca.SX(p.DECK_CENTRE),
        equilibrium=constants["equilibrium"],
        strips=_STRIPS,
        wave_count=constants["wave.count"],
        wave_table=constants["wave_table"],
        loads=lambda now: (
            propulsion(constants, now)
            + damping(constants, now)
            + restoring(constants, now)
            + wind(now)
            + now.froude_krylov_load(constants["mass"], constants["centre_of_mass"], _STRIPS)
        ),
        frame=lambda orientation: frame(constants, orientation),
    )


def _twin_hull(draught: ca.SX) -> TwinHull:
    """Return the pontoons for a mean draught (m)."""
    return TwinHull(_STRIPS, ca.SX(p.PONTOON_BEAM), draught, ca.SX(p.PONTOON_TOP - p.PONTOON_BOTTOM), ca.SX(p.WATERPLANE_AREA))


def restoring(constants: NamedValues, now: LoadArguments) -> ca.SX:
    """Return the restoring load tau, linear in heave, roll and pitch relative to the trim and to the water surface."""
    angles = kinematics.euler_angles(now.orientation)[0:2]
    displacement = ca.vertcat(now.height, angles) - trim(constants, now.frame.attitude)
    to_flotation = transformation_matrix(_CENTRE_OF_FLOTATION)[2:5, 2:5]
    surface = ca.vertcat(now.water.heave, now.water.slopes)
    load = -to_flotation.T @ (constants["stiffness"] * (to_flotation @ displacement - surface))
    return ca.vertcat(0, 0, load, 0)


def damping(constants: NamedValues, now: LoadArguments) -> ca.SX:
    """Return tau of the linear damping, which grows with the yaw rate in yaw, and of the cross-flow drag along the hull."""
    growth = ca.vertcat(ca.SX.ones(5), 1 + p.YAW_DAMPING_GROWTH * ca.fabs(now.relative_velocity[5]))
    relative = ca.vertcat(now.relative_velocity[0:3], now.rates_in_water, now.relative_velocity[5])
    load = -constants["damping"] * growth * relative
    _, v, w, _, q, r = ca.vertsplit(relative)
    for x in np.linspace(-p.LENGTH / 2, p.LENGTH / 2, p.STATION_COUNT).tolist():
        across, down = v + x * r, w - x * q
        drag = -constants["drag"] * ca.vertcat(0, ca.fabs(across) * across, ca.fabs(down) * down)
        load += load_of_force_at(ca.SX([x, 0, 0]), drag)
    return load


def propulsion(constants: NamedValues, now: LoadArguments) -> ca.SX:
    """Return the load tau of both propellers."""
    lag = constants["propeller_time_constant"]
    speed = ca.if_else(lag > 0, now.actuators, now.inputs["propeller_speed"])
    speed = ca.fmin(ca.fmax(speed, p.MIN_PROPELLER_SPEED), p.MAX_PROPELLER_SPEED)
    coefficient = ca.if_else(speed > 0, p.THRUST_AHEAD, p.THRUST_ASTERN)
    port, starboard = ca.vertsplit(coefficient * speed * ca.fabs(speed))
    return ca.vertcat(port + starboard, 0, 0, 0, 0, p.PONTOON_OFFSET * (starboard - port))


def wind(now: LoadArguments) -> ca.SX:
    """Return the load tau of the wind relative to still air, whose drag is part of the surge damping."""
    coefficients = ca.SX([p.AIR_DENSITY / 2 * a * c for a, c in zip(p.PROJECTED_AREAS, p.WIND_COEFFICIENTS, strict=True)])
    still, air = now.velocity[0:2], now.air_relative_velocity[0:2]
    force = coefficients * (ca.fabs(still) * still - ca.fabs(air) * air)
    return load_of_force_at(ca.SX([0, 0, p.WIND_HEIGHT]), ca.vertcat(force, 0))


class OtterModel(ContinuousModel):
    """Model whose shaft speeds are constant during a step and follow their commands after it (Euler), as in MSS."""

    def integrate(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX, sub_steps: int = 1) -> ca.SX:
        """Return the state after `step` (s): one Runge-Kutta step of the vessel and one Euler step of the shafts."""
        del sub_steps  # always one, as in MSS
        end = super().integrate(state, inputs, parameters, step)
        first = len(VESSEL_STATES)
        lag, shafts = VESSEL.constants.by_name(parameters)["propeller_time_constant"], end[first:]
        commands = values_by_name(inputs, variables_of(VARIABLES, "input"))["propeller_speed"]
        return ca.vertcat(end[:first], shafts + ca.fmin(1, ca.if_else(lag > 0, step / lag, 1)) * (commands - shafts))


VESSEL = vessel_equations.VesselModel(
    "otter", "Maritime Robotics Otter with a landing deck, afloat", VARIABLES, derive_constants, hull, PROPELLER_STATES
)


def block() -> Block:
    """Return the Otter for export."""
    model = VESSEL.create_continuous_model(OtterModel, max_sub_step=0.01)
    return as_block(model, floating_maps.FloatingContactMaps(model, VESSEL, floating_maps.constant_body(BODY)).functions())
