"""Equations of motion, weight and buoyancy of a floating vessel in six degrees of freedom.

`vehicles/README.md` has the equations with their sources.

Fossen (2021), Handbook of Marine Craft Hydrodynamics and Motion Control, 2nd edition, chapters 3, 6
and 10, converted to world frame ENU and body frame forward-left-up. The origin O of the body frame
is fixed in the hull and need not be the centre of mass. nu = (u, v, w, p, q, r) holds surge, sway
and heave velocity of O (m/s) and roll, pitch and yaw rate (rad/s), body frame. Loads tau = (X, Y,
Z, K, M, N) are forces (N) and moments about O (N m), body frame.

State: position of O (m, world frame), unit quaternion, nu, time (s), and the states of the
actuators.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
from casadi import SX

from ..common import kinematics
from ..common.interface import VESSEL_STATES
from ..common.named_values import NamedValues
from .strips import (
    GRAVITY,
    STRIP_COUNT,
    Immersion,
    Strips,
    TwinHull,
    WaterMotion,
    immersion,
    water_motion,
)


@dataclass(frozen=True)
class Frame:
    """Rotations between body, velocity and world frame.

    The velocity frame, in which nu is expressed, is the body frame for most vessels. The Otter's
    velocity frame is level when the trimmed vessel is at rest.

    Attributes:
        attitude: Rotation matrix body to world frame, shape (3, 3).
        to_world: Rotation matrix velocity frame to world frame, shape (3, 3).
        rates_to_angular_velocity: Matrix from (p, q, r) to the angular velocity in the body frame,
            shape (3, 3).
        world_to_current_axes: Matrix from the current in the world frame to that in the velocity
            frame, shape (3, 3).
    """

    attitude: SX
    to_world: SX
    rates_to_angular_velocity: SX
    world_to_current_axes: SX

    def generalised_force(self, force: SX, torque: SX) -> SX:
        """Return the load tau (6) of a force at O (N) and a torque about O (N m), world frame."""
        return ca.vertcat(
            self.to_world.T @ force, self.rates_to_angular_velocity.T @ (self.attitude.T @ torque)
        )


@dataclass(frozen=True)
class LoadArguments:
    """Arguments of the loads on a hull.

    Attributes:
        frame: Rotations.
        orientation: Unit quaternion body to world frame, shape (4,).
        relative_velocity: nu_r, nu relative to the water with current and waves, shape (6,).
        air_relative_velocity: Velocity of O relative to the air (m/s, velocity frame), shape (3,).
        velocity: Velocity of O (m/s, velocity frame), shape (3,).
        height: Height of O above the still water (m).
        water: Motion of the water in the waves.
        inputs: Inputs of the model.
        actuators: States of the actuators.
    """

    frame: Frame
    orientation: SX
    relative_velocity: SX
    air_relative_velocity: SX
    velocity: SX
    height: SX
    water: WaterMotion
    inputs: NamedValues
    actuators: SX

    @property
    def rates_in_water(self) -> SX:
        """Roll and pitch rate relative to the surface of the water (rad/s), shape (2,)."""
        return self.relative_velocity[3:5] - self.water.rates

    def froude_krylov_load(self, mass: SX, centre: SX, strips: Strips) -> SX:
        """Return tau that accelerates the displaced water with the waves.

        It is the Froude-Krylov load beyond the hydrostatic pressure (Faltinsen 1990, Sea Loads on
        Ships and Offshore Structures, chapter 3).

        Args:
            mass: Displaced mass (kg).
            centre: Its centre (m, body frame).
            strips: Strips of the hull.
        """
        load = load_of_force_at(centre, mass * (self.frame.to_world.T @ self.water.acceleration))
        return load + ca.vertcat(
            0, 0, 0, mass * strips.radii_squared * self.water.angular_acceleration, 0
        )


def level_frame(orientation: SX) -> Frame:
    """Return the frame of a hull whose velocity frame is the body frame."""
    attitude = kinematics.rotation_matrix(orientation)
    return Frame(attitude, attitude, SX.eye(3), attitude.T)


@dataclass(frozen=True)
class Hull:
    """Rigid body, added mass and loads of one vessel with given constants.

    Positions are in the body frame from O.

    Attributes:
        mass: Mass (kg).
        centre_of_mass: Centre of mass r_g (m), shape (3,).
        inertia: Inertia about the centre of mass I_g (kg m2), shape (3, 3).
        added_mass: M_A, shape (6, 6).
        coriolis_added_mass: Part of M_A whose Coriolis and centripetal loads C_A are not contained
            in `loads`, shape (6, 6).
        inverse_mass_matrix: Inverse of M_RB + M_A, shape (6, 6).
        deck_centre: Centre of the top of the landing deck (m), shape (3,).
        equilibrium: Height of O (m), roll and pitch (rad) of the vessel afloat at rest, shape (3,).
        strips: Strips at which the waves act.
        wave_count: Number of wave components.
        wave_table: Wave components, see `strips.wave_table`.
        loads: Function for the load tau (6) of water, air and propulsion, without added mass.
        frame: Function from the orientation to the rotations.
        centre_in_velocity_axes: Centre of mass in the velocity frame (m), shape (3,); None:
            `centre_of_mass`. The inertia is in the velocity frame as well.
    """

    mass: SX
    centre_of_mass: SX
    inertia: SX
    added_mass: SX
    coriolis_added_mass: SX
    inverse_mass_matrix: SX
    deck_centre: SX
    equilibrium: SX
    strips: Strips
    wave_count: SX
    wave_table: SX
    loads: Callable[[LoadArguments], SX]
    frame: Callable[[SX], Frame] = level_frame
    centre_in_velocity_axes: SX | None = None

    @property
    def velocity_centre(self) -> SX:
        """Centre of mass in the velocity frame (m), shape (3,)."""
        other = self.centre_in_velocity_axes
        return self.centre_of_mass if other is None else other

    def initial_state(self, initial: NamedValues, actuators: int = 0) -> SX:
        """Return the state from the parameters `initial.*`, with `actuators` further states of 0.

        With `initial.on_waves` the vessel is displaced with the plane of the surface, and moves
        with the water.
        """
        displacement = self.equilibrium + ca.vertcat(
            *(initial[f"initial.{name}"] for name in ("heave", "roll", "pitch"))
        )
        yaw, time = initial["initial.yaw"], initial["initial.time"]
        level = self.frame(kinematics.quaternion_from_euler(displacement[1], displacement[2], yaw))
        centre = (
            initial["initial.position"]
            + (level.attitude @ (self.strips.centre - self.centre_of_mass))[0:2]
        )
        water = water_motion(
            centre,
            level.attitude,
            time,
            self.strips,
            initial["initial.on_waves"],
            self.wave_count,
            self.wave_table,
        )
        rise = water.heave + ca.dot(
            water.slopes, ca.vertcat(-self.strips.centre[1], self.strips.centre[0])
        )
        height, roll, pitch = ca.vertsplit(displacement + ca.vertcat(rise, water.slopes))
        orientation = kinematics.quaternion_from_euler(roll, pitch, yaw)
        frame = self.frame(orientation)
        origin = initial["initial.position"] - (frame.attitude @ self.centre_of_mass)[0:2]
        rates = initial["initial.rates"] + ca.vertcat(water.rates, 0)
        velocity = (
            initial["initial.velocity_body"]
            + frame.to_world.T @ water.velocity
            - ca.cross(rates, self.velocity_centre)
        )
        return ca.vertcat(origin, height, orientation, velocity, rates, time, SX.zeros(actuators))

    def rate(self, state: SX, inputs: NamedValues) -> SX:
        """Return the time derivative of position, quaternion, nu and time.

        In the current and the waves (Fossen 2021, chapter 10; `vehicles/README.md`).
        """
        orientation, nu = state[3:7], state[7:13]
        frame = self.frame(orientation)
        rates = nu[3:6]
        centre = state[0:2] + (frame.attitude @ self.strips.centre)[0:2]
        water = water_motion(
            centre,
            frame.attitude,
            state[13],
            self.strips,
            inputs["wave_gain"],
            self.wave_count,
            self.wave_table,
        )
        current = frame.world_to_current_axes @ ca.vertcat(inputs["current"], 0)
        wave_velocity = frame.to_world.T @ water.velocity
        wave_acceleration = frame.to_world.T @ water.acceleration
        nu_without_current = ca.vertcat(nu[0:3] - current, rates)
        nu_r = ca.vertcat(nu_without_current[0:3] - wave_velocity, rates)
        air = nu[0:3] - frame.to_world.T @ inputs["wind"]
        now = LoadArguments(
            frame,
            orientation,
            nu_r,
            air,
            nu[0:3],
            state[2],
            water,
            inputs,
            state[len(VESSEL_STATES) :],
        )
        external = ca.vertcat(inputs["external_force"], inputs["external_torque"])
        tau = self.loads(now) + self.load_at_centre(frame, external)
        linear = wave_acceleration - ca.cross(rates, wave_velocity)
        tau += self.added_mass @ ca.vertcat(linear, water.angular_acceleration, 0)
        tau -= self._rigid_body_coriolis(nu_without_current) + coriolis_load(
            self.coriolis_added_mass, nu_r
        )
        acceleration = self.inverse_mass_matrix @ tau - ca.vertcat(
            ca.cross(rates, current), SX.zeros(3)
        )
        quaternion_rate = kinematics.quaternion_rate(
            orientation, frame.rates_to_angular_velocity @ rates
        )
        return ca.vertcat(frame.to_world @ nu[0:3], quaternion_rate, acceleration, 1)

    def _rigid_body_coriolis(self, nu: SX) -> SX:
        """Return C_RB(nu) nu in terms of the angular velocity (Fossen 2021, section 3.3)."""
        velocity, rates = nu[0:3], nu[3:6]
        force = self.mass * ca.cross(rates, velocity + ca.cross(rates, self.velocity_centre))
        return ca.vertcat(
            force, ca.cross(rates, self.inertia @ rates) + ca.cross(self.velocity_centre, force)
        )

    def load_at_centre(self, frame: Frame, load: SX) -> SX:
        """Return the load tau of a force at the centre of mass and a torque (6, world frame)."""
        lever = frame.attitude @ self.centre_of_mass
        return frame.generalised_force(load[0:3], load[3:6] + ca.cross(lever, load[0:3]))

    def observe(self, state: SX) -> SX:
        """Return the motion of the centre of mass and of the deck.

        They are `interface.MOTION_OUTPUTS` and `interface.DECK_OUTPUTS`.
        """
        orientation, nu = state[3:7], state[7:13]
        frame = self.frame(orientation)
        to_centre, to_deck = frame.attitude @ self.centre_of_mass, frame.attitude @ self.deck_centre
        angular_velocity = frame.attitude @ (frame.rates_to_angular_velocity @ nu[3:6])
        origin_velocity = frame.to_world @ nu[0:3]
        return ca.vertcat(
            state[0:3] + to_centre,
            orientation,
            kinematics.euler_angles(orientation),
            origin_velocity + ca.cross(angular_velocity, to_centre),
            nu[0:3] + ca.cross(nu[3:6], self.velocity_centre),
            nu[3:6],
            state[0:3] + to_deck,
            origin_velocity + ca.cross(angular_velocity, to_deck),
        )


def hull_of(constants: NamedValues, **others: Any) -> Hull:
    """Return the vessel with these constants.

    Args:
        constants: Constants of the equations; mass, centre of mass, mass matrix, equilibrium and
            waves are among them by these names.
        **others: Further attributes of the vessel.
    """
    return Hull(
        mass=constants["mass"],
        centre_of_mass=constants["centre_of_mass"],
        inverse_mass_matrix=constants["inverse_mass_matrix"],
        equilibrium=constants["equilibrium"],
        wave_count=constants["wave.count"],
        wave_table=constants["wave_table"],
        **others,
    )


def coriolis_load(mass: SX, nu: SX) -> SX:
    """Return C(nu) nu of a mass matrix (6, 6), for added mass Fossen (2021), eq. 6.48."""
    momentum = mass @ nu
    force = ca.cross(nu[3:6], momentum[0:3])
    return ca.vertcat(force, ca.cross(nu[0:3], momentum[0:3]) + ca.cross(nu[3:6], momentum[3:6]))


def load_of_force_at(point: SX, force: SX) -> SX:
    """Return the load tau of a force (N) at a point (m), both in the body frame."""
    return ca.vertcat(force, ca.cross(point, force))


def transformation_matrix(point: SX) -> SX:
    """Return the matrix (6, 6) from nu of O to nu of a point (m) (Fossen 2021, appendix C)."""
    return ca.blockcat([[SX.eye(3), -ca.skew(point)], [SX.zeros(3, 3), SX.eye(3)]])


def rigid_body_mass_matrix(mass: SX, centre: SX, inertia: SX) -> SX:
    """Return M_RB about O (Fossen 2021, eq. 3.60).

    Args:
        mass: Mass (kg).
        centre: Centre of mass r_g (m), shape (3,).
        inertia: Inertia about the centre of mass I_g (kg m2), shape (3, 3).
    """
    to_centre = transformation_matrix(centre)
    return to_centre.T @ ca.diagcat(mass * SX.eye(3), inertia) @ to_centre


@dataclass(frozen=True)
class Ballast:
    """Weight of a vessel and density of the water.

    Attributes:
        mass: Mass (kg).
        centre_of_mass: Centre of mass from O (m, body frame), shape (3,).
        water_density: Density of the water (kg/m3).
    """

    mass: SX
    centre_of_mass: SX
    water_density: SX


def weight_and_buoyancy(under_water: Immersion, up: SX, ballast: Ballast) -> SX:
    """Return the load tau (6) of weight and buoyancy for the vertical axis in the body frame."""
    weight = load_of_force_at(ballast.centre_of_mass, -GRAVITY * ballast.mass * up)
    density = GRAVITY * ballast.water_density
    return weight + density * ca.vertcat(under_water.volume * up, ca.cross(under_water.moment, up))


def improved_equilibrium(state: SX, hull: TwinHull, ballast: Ballast, stiffness: SX) -> SX:
    """Return the state after one step of Newton's method towards the equilibrium in still water.

    The state is height of O (m), roll and pitch (rad). The stiffness is that of the upright hull in
    all steps, so that the method converges linearly but needs no derivatives.

    Args:
        state: Height, roll and pitch before the step, shape (3,).
        hull: Hulls.
        ballast: Weight of the vessel.
        stiffness: Stiffness of heave (N/m), roll and pitch (N m/rad) at the centre of the
            waterplane, shape (3,).
    """
    middle = hull.strips.centre
    up = upward_axis(state)
    load = weight_and_buoyancy(immersion(hull, up, state[0], SX.zeros(STRIP_COUNT)), up, ballast)
    force, moment = ca.dot(load[0:3], up), load[3:6] - ca.cross(middle, load[0:3])
    angles = moment[0:2] / stiffness[1:3]
    return state + ca.vertcat(force / stiffness[0] + middle[0] * angles[1], angles)


def attitude_at(state: SX) -> SX:
    """Return the rotation matrix body to world frame for height, roll and pitch without yaw."""
    orientation = kinematics.quaternion_from_euler(state[1], state[2], SX(0))
    return kinematics.rotation_matrix(orientation)


def upward_axis(state: SX) -> SX:
    """Return the vertical axis of the world in the body frame for a state, shape (3,)."""
    return attitude_at(state)[2, :].T
