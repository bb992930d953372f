"""Equations of motion of the Otter in six degrees of freedom: README.md has them in our notation."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel
from cosim.export.fmu.block import Block

from ..common import kinematics
from ..common.interface import VESSEL_STATES
from ..common.named_values import NamedValues, values_by_name, variables_of
from ..vessel import floating_maps, vessel_equations
from ..vessel import hull as vessel
from ..vessel.hull import Frame, Hull, LoadArguments, load_of_force_at, transformation_matrix
from ..vessel.wave_loads import Footprint
from . import hydrostatics
from . import parameters as p
from .geometry import BODY
from .interface import PROPELLER_STATES, VARIABLES

_CENTRE_OF_FLOTATION = ca.SX(p.CENTRE_OF_FLOTATION)


def derive_constants(parameters: NamedValues) -> dict[str, ca.SX]:
    """What the equations need of the parameters."""
    payload, place, hull_centre = parameters["payload_mass"], parameters["payload_position"], ca.SX(p.HULL_CENTRE)
    mass = p.HULL_MASS + payload
    centre = (p.HULL_MASS * hull_centre + payload * place) / mass
    inertia = p.HULL_MASS * ca.diag(ca.SX(p.RADII_OF_GYRATION) ** 2)
    for share, point in ((p.HULL_MASS, hull_centre), (payload, place)):
        lever = ca.skew(point - centre)
        inertia -= share * lever @ lever
    added = added_mass(inertia)
    whole = vessel.rigid_body_mass_matrix(mass, centre, inertia) + ca.diag(added)
    water = hydrostatics.hydrostatics(mass, centre)
    load = ca.vertcat(0, 0, -payload * p.GRAVITY)
    constants = {
        **vessel_equations.initial_parameters(parameters),
        "mass": mass,
        "centre": centre,
        "inertia": inertia,
        "added_mass": added,
        "inverse": ca.inv(whole),
        "draught": water.draught,
        "stiffness": water.stiffness,
        "settling": water.compliance,
        "footprint": water.footprint,
        "damping": hydrostatics.linear_damping(ca.diag(whole), water.stiffness),
        "drag": hydrostatics.cross_flow_drag(water.draught),
        "payload": load[2],
        "payload_position": place,
        "propeller_time_constant": parameters["propeller_time_constant"],
        "wave.count": parameters["wave.count"],
        "sea": vessel_equations.wave_table_of(parameters, _unpack_footprint(water.footprint)),
    }
    return constants | {"rest": _equilibrium(constants)}


def added_mass(inertia: ca.SX) -> ca.SX:
    """The diagonal (6) of the added mass."""
    masses = [p.SURGE_ADDED_MASS, *(share * p.HULL_MASS for share in p.ADDED_MASS_SHARES)]
    return ca.vertcat(ca.SX(masses), ca.SX(p.ADDED_INERTIA_SHARES) * ca.diag(inertia))


def trim(constants: Mapping[str, ca.SX], attitude: ca.SX) -> ca.SX:
    """Height of O, roll and pitch to which the payload presses the hull in this attitude."""
    force = attitude.T @ ca.vertcat(0, 0, constants["payload"])
    load = load_of_force_at(constants["payload_position"], force)
    return constants["settling"] @ load[2:5]


def _equilibrium(constants: Mapping[str, ca.SX]) -> ca.SX:
    """The trim that is that of its own attitude, by iteration: each step leaves less than a tenth of the error."""
    rest = ca.SX.zeros(3)
    for _ in range(20):
        rest = trim(constants, kinematics.rotation_matrix(kinematics.quaternion_from_euler(rest[1], rest[2], ca.SX(0))))
    return rest


def frame(constants: NamedValues, orientation: ca.SX) -> Frame:
    """Velocities are counted in the hull's level frame, which is that of its Euler angles less those of the trim.

    The current is turned by the yaw angle alone.
    """
    attitude = kinematics.rotation_matrix(orientation)
    roll, pitch, yaw = ca.vertsplit(kinematics.euler_angles(orientation))
    _, roll_at_rest, pitch_at_rest = ca.vertsplit(trim(constants, attitude))
    level = roll - roll_at_rest, pitch - pitch_at_rest
    to_world = kinematics.rotation_matrix(kinematics.quaternion_from_euler(*level, yaw))
    spin = kinematics.euler_to_body_rates(roll, pitch) @ kinematics.body_to_euler_rates(*level)
    return Frame(attitude, to_world, spin, kinematics.rotation_matrix(kinematics.quaternion_about_z(yaw)).T)


def hull(constants: NamedValues) -> Hull:
    """The vessel with these constants."""
    added = ca.diag(constants["added_mass"])
    return Hull(
        mass=constants["mass"],
        centre_of_mass=constants["centre"],
        inertia=constants["inertia"],
        added_mass=added,
        coriolis_added_mass=added,
        inverse_mass_matrix=constants["inverse"],
        centre_of_flotation=_CENTRE_OF_FLOTATION,
        deck_centre=ca.SX(p.DECK_CENTRE),
        equilibrium=constants["rest"],
        footprint=_unpack_footprint(constants["footprint"]),
        wave_count=constants["wave.count"],
        wave_table=constants["sea"],
        loads=lambda now: propulsion(constants, now) + damping(constants, now) + restoring(constants, now) + wind(now),
        frame=lambda orientation: frame(constants, orientation),
    )


def _unpack_footprint(values: ca.SX) -> Footprint:
    return Footprint(*ca.vertsplit(values))


def restoring(constants: NamedValues, now: LoadArguments) -> ca.SX:
    """Linear in height, roll and pitch, relative to the trim and the surface of the water at the centre of flotation."""
    angles = kinematics.euler_angles(now.orientation)[0:2]
    displacement = ca.vertcat(now.height, angles) - trim(constants, now.frame.attitude)
    move = transformation_matrix(_CENTRE_OF_FLOTATION)[2:5, 2:5]
    surface = ca.vertcat(now.elevation, now.slopes[1], -now.slopes[0])
    load = -move.T @ (constants["stiffness"] * (move @ displacement - surface))
    return ca.vertcat(0, 0, load, 0)


def damping(constants: NamedValues, now: LoadArguments) -> ca.SX:
    """Linear damping, in yaw growing with the rate, and drag of the cross-flow along the hull."""
    growth = ca.vertcat(ca.SX.ones(5), 1 + p.YAW_DAMPING_GROWTH * ca.fabs(now.relative_velocity[5]))
    load = -constants["damping"] * growth * now.relative_velocity
    _, v, w, _, q, r = ca.vertsplit(now.relative_velocity)
    for x in np.linspace(-p.LENGTH / 2, p.LENGTH / 2, p.STATION_COUNT).tolist():
        across, down = v + x * r, w - x * q
        drag = -constants["drag"] * ca.vertcat(0, ca.fabs(across) * across, ca.fabs(down) * down)
        load += load_of_force_at(ca.SX([x, 0, 0]), drag)
    return load


def propulsion(constants: NamedValues, now: LoadArguments) -> ca.SX:
    """Thrust of both propellers."""
    lag = constants["propeller_time_constant"]
    speed = ca.if_else(lag > 0, now.actuators, now.inputs["propeller_speed"])
    speed = ca.fmin(ca.fmax(speed, p.MIN_PROPELLER_SPEED), p.MAX_PROPELLER_SPEED)
    coefficient = ca.if_else(speed > 0, p.THRUST_AHEAD, p.THRUST_ASTERN)
    port, starboard = ca.vertsplit(coefficient * speed * ca.fabs(speed))
    return ca.vertcat(port + starboard, 0, 0, 0, 0, p.PONTOON_OFFSET * (starboard - port))


def wind(now: LoadArguments) -> ca.SX:
    """Drag of the wind beyond that of still air."""
    coefficients = ca.SX([p.AIR_DENSITY / 2 * a * c for a, c in zip(p.PROJECTED_AREAS, p.WIND_COEFFICIENTS, strict=True)])
    still, air = now.velocity[0:2], now.air_relative_velocity[0:2]
    force = coefficients * (ca.fabs(still) * still - ca.fabs(air) * air)
    return load_of_force_at(ca.SX([0, 0, p.WIND_HEIGHT]), ca.vertcat(force, 0))


class OtterModel(ContinuousModel):
    """The shafts follow their commands after each step, in which their speed is held, as in MSS's simulations (Euler)."""

    def integrate(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX, sub_steps: int = 1) -> ca.SX:
        """The state after one step of the Runge-Kutta method, whatever `sub_steps`, and of the shafts."""
        end = super().integrate(state, inputs, parameters, step)
        first = len(VESSEL_STATES)
        lag, shafts = VESSEL.constants.by_name(parameters)["propeller_time_constant"], end[first:]
        commands = values_by_name(inputs, variables_of(VARIABLES, "input"))["propeller_speed"]
        return ca.vertcat(end[:first], shafts + ca.fmin(1, ca.if_else(lag > 0, step / lag, 1)) * (commands - shafts))


VESSEL = vessel_equations.VesselModel(
    "otter", "Maritime Robotics Otter with a landing deck, afloat", VARIABLES, derive_constants, hull, PROPELLER_STATES
)


def block() -> Block:
    """The Otter on open water."""
    model = VESSEL.create_continuous_model(OtterModel, max_sub_step=0.01)
    return as_block(model, floating_maps.FloatingContactMaps(model, VESSEL, BODY).functions())
