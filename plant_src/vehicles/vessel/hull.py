"""Equations of motion of a floating vessel in six degrees of freedom; README.md has them with their sources.

Fossen 2021, Handbook of Marine Craft Hydrodynamics and Motion Control, chapters 3, 6 and 10, in the project's frames: world x, y
horizontal, z up; body x forward, y left, z up. The body's origin O is fixed in the hull and need not be the centre of mass.
State: position of O (world), orientation, velocity of O and rates (body, together nu), time, and states of actuators.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from ..common import kinematics
from ..common.interface import VESSEL_STATES
from ..common.named_values import NamedValues
from .wave_loads import Footprint, WaveKinematics, wave_kinematics


@dataclass(frozen=True)
class Frame:
    """How the body's frame stands in the world.

    `attitude` (3, 3) turns points of the hull into the world, `to_world` (3, 3) the velocity of O; they differ only if the
    velocity is counted in a frame that is level at rest. `spin` (3, 3) makes the angular velocity (body) of the rates, and
    `from_stream` (3, 3) turns the current into the body's frame.
    """

    attitude: ca.SX
    to_world: ca.SX
    rates_to_angular_velocity: ca.SX
    world_to_current_axes: ca.SX

    @property
    def heading(self) -> tuple[ca.SX, ca.SX]:
        """Cosine and sine of the yaw angle."""
        x, y = self.attitude[0, 0], self.attitude[1, 0]
        length = ca.sqrt(x * x + y * y + 1e-300)
        return x / length, y / length

    def generalised_force(self, force: ca.SX, torque: ca.SX) -> ca.SX:
        """A force at O and a torque about it, both in the world frame, as a load in the equations of motion."""
        return ca.vertcat(self.to_world.T @ force, self.rates_to_angular_velocity.T @ (self.attitude.T @ torque))


@dataclass(frozen=True)
class LoadArguments:
    """What a hull is exposed to.

    `relative` is nu relative to the water with its waves, `air` the velocity of O relative to the air (3, body), `still_air`
    relative to air at rest; `slopes` are those of the water along the body's x and y; `rise` is the height of O.
    """

    frame: Frame
    orientation: ca.SX
    relative_velocity: ca.SX
    air_relative_velocity: ca.SX
    velocity: ca.SX
    height: ca.SX
    elevation: ca.SX
    slopes: ca.SX
    inputs: NamedValues
    actuators: ca.SX


def level_frame(orientation: ca.SX) -> Frame:
    """The frame of a hull that is level at rest."""
    attitude = kinematics.rotation_matrix(orientation)
    return Frame(attitude, attitude, ca.SX.eye(3), attitude.T)


@dataclass(frozen=True)
class Hull:
    """One vessel with given constants: rigid body, added mass and loads, in the body's frame about O.

    `centre` of mass (3, m), `inertia` about it (3, 3, kg m2); `added_mass` (6, 6); `inverse` (6, 6) of the whole mass matrix;
    `flow_mass` (6, 6): the part of the added mass whose Coriolis and centripetal loads are not contained in the `loads`.
    `flotation` is the centre of the waterplane (3, m), `deck` that of the landing deck's top; `rest` has height of O (m), roll
    and pitch of the vessel afloat at rest. `loads` gives the loads (6) of water, air and propulsion without those of
    acceleration, `frame` the frame of an orientation.
    """

    mass: ca.SX
    centre_of_mass: ca.SX
    inertia: ca.SX
    added_mass: ca.SX
    coriolis_added_mass: ca.SX
    inverse_mass_matrix: ca.SX
    centre_of_flotation: ca.SX
    deck_centre: ca.SX
    equilibrium: ca.SX
    footprint: Footprint
    wave_count: ca.SX
    wave_table: ca.SX
    loads: Callable[[LoadArguments], ca.SX]
    frame: Callable[[ca.SX], Frame] = level_frame

    def initial_state(self, initial: NamedValues, actuators: int = 0) -> ca.SX:
        """The state from the parameters `initial.*`."""
        displacement = (initial[f"initial.{name}"] for name in ("heave", "roll", "pitch"))
        height, roll, pitch = ca.vertsplit(self.equilibrium + ca.vertcat(*displacement))
        orientation = kinematics.quaternion_from_euler(roll, pitch, initial["initial.yaw"])
        origin = initial["initial.position"] - (self.frame(orientation).attitude @ self.centre_of_mass)[0:2]
        rates = initial["initial.rates"]
        velocity = initial["initial.velocity_body"] - ca.cross(rates, self.centre_of_mass)
        return ca.vertcat(origin, height, orientation, velocity, rates, initial["initial.time"], ca.SX.zeros(actuators))

    def rate(self, state: ca.SX, inputs: NamedValues) -> ca.SX:
        """Time derivative of position, orientation, nu and time."""
        orientation, nu = state[3:7], state[7:13]
        frame = self.frame(orientation)
        spin = nu[3:6]
        sea = self._wave_kinematics(state, frame, inputs["wave_gain"])
        current = frame.world_to_current_axes @ ca.vertcat(inputs["current"], 0)
        orbital, flow = frame.to_world.T @ sea.velocity, frame.to_world.T @ sea.acceleration
        drift = ca.vertcat(nu[0:3] - current, spin)
        relative = ca.vertcat(drift[0:3] - orbital, spin)
        now = self._load_arguments(state, frame, relative, sea, inputs)
        pull = frame.to_world.T @ ca.vertcat(sea.acceleration[0:2], 0)
        force = self.loads(now) + self._external_load(frame, inputs)
        force += self.inertial_load(pull) + self.added_mass[:, 0:3] @ (flow - ca.cross(spin, orbital))
        force -= self._rigid_body_coriolis(drift) + coriolis_load(self.coriolis_added_mass, relative)
        acceleration = self.inverse_mass_matrix @ force - ca.vertcat(ca.cross(spin, current), ca.SX.zeros(3))
        turning = kinematics.quaternion_rate(orientation, frame.rates_to_angular_velocity @ spin)
        return ca.vertcat(frame.to_world @ nu[0:3], turning, acceleration, 1)

    def inertial_load(self, acceleration: ca.SX) -> ca.SX:
        """The load that accelerates the rigid body like this without turning it."""
        force = self.mass * acceleration
        return ca.vertcat(force, ca.cross(self.centre_of_mass, force))

    def _rigid_body_coriolis(self, nu: ca.SX) -> ca.SX:
        velocity, spin = nu[0:3], nu[3:6]
        force = self.mass * ca.cross(spin, velocity + ca.cross(spin, self.centre_of_mass))
        return ca.vertcat(force, ca.cross(spin, self.inertia @ spin) + ca.cross(self.centre_of_mass, force))

    def _wave_kinematics(self, state: ca.SX, frame: Frame, gain: ca.SX) -> WaveKinematics:
        place = state[0:2] + (frame.attitude @ self.centre_of_flotation)[0:2]
        felt = wave_kinematics(place, frame.heading, state[13], self.footprint, self.wave_count, self.wave_table)
        return WaveKinematics(gain * felt.elevation, gain * felt.slopes, gain * felt.velocity, gain * felt.acceleration)

    def _load_arguments(
        self, state: ca.SX, frame: Frame, relative: ca.SX, sea: WaveKinematics, inputs: NamedValues
    ) -> LoadArguments:
        cos, sin = frame.heading
        slopes = ca.vertcat(cos * sea.slopes[0] + sin * sea.slopes[1], cos * sea.slopes[1] - sin * sea.slopes[0])
        still_air = state[7:10]
        air = still_air - frame.to_world.T @ inputs["wind"]
        return LoadArguments(
            frame, state[3:7], relative, air, still_air, state[2], sea.elevation, slopes, inputs, state[len(VESSEL_STATES) :]
        )

    def _external_load(self, frame: Frame, inputs: NamedValues) -> ca.SX:
        force, torque = inputs["external_force"], inputs["external_torque"]
        return frame.generalised_force(force, torque + ca.cross(frame.attitude @ self.centre_of_mass, force))

    def observe(self, state: ca.SX) -> ca.SX:
        """The published motion of the centre of mass (`interface.MOTION`) and of the deck (`interface.DECK`)."""
        orientation, nu = state[3:7], state[7:13]
        frame = self.frame(orientation)
        to_centre, to_deck = frame.attitude @ self.centre_of_mass, frame.attitude @ self.deck_centre
        angular = frame.attitude @ (frame.rates_to_angular_velocity @ nu[3:6])
        origin = frame.to_world @ nu[0:3]
        return ca.vertcat(
            state[0:3] + to_centre,
            orientation,
            kinematics.euler_angles(orientation),
            origin + ca.cross(angular, to_centre),
            nu[0:3] + ca.cross(nu[3:6], self.centre_of_mass),
            nu[3:6],
            state[0:3] + to_deck,
            origin + ca.cross(angular, to_deck),
        )


def coriolis_load(mass: ca.SX, nu: ca.SX) -> ca.SX:
    """Coriolis and centripetal load of a mass matrix (6, 6) (Fossen 2021, equation 6.48 for added mass)."""
    momentum = mass @ nu
    force = ca.cross(nu[3:6], momentum[0:3])
    return ca.vertcat(force, ca.cross(nu[0:3], momentum[0:3]) + ca.cross(nu[3:6], momentum[3:6]))


def load_of_force_at(point: ca.SX, force: ca.SX) -> ca.SX:
    """The load of a force (3) that acts at a point of the hull."""
    return ca.vertcat(force, ca.cross(point, force))


def transformation_matrix(point: ca.SX) -> ca.SX:
    """The matrix (6, 6) that makes the generalised velocity at a point of that at O (Fossen 2021, appendix C)."""
    return ca.blockcat([[ca.SX.eye(3), -ca.skew(point)], [ca.SX.zeros(3, 3), ca.SX.eye(3)]])


def rigid_body_mass_matrix(mass: ca.SX, centre: ca.SX, inertia: ca.SX) -> ca.SX:
    """The mass matrix (6, 6) about O of a body with its inertia (3, 3) about the centre of mass."""
    move = transformation_matrix(centre)
    return move.T @ ca.diagcat(mass * ca.SX.eye(3), inertia) @ move
