"""Equations of a vessel in six degrees of freedom for export, and its contact functions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
from casadi import SX

from cosim.core.component import Variable
from cosim.export.equations.c_code import Callee
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel
from cosim.export.fmu.block import Block

from ..common import kinematics
from ..common.contact_maps import (
    TWIST_SIZE,
    correct_symbols,
    create_symbols,
    gyroscopic_torque,
    impulse_correct_function,
    impulse_of_twist,
    initialize_function,
    is_upside_down,
    mean_twist,
    moved_pose,
    predict_function,
    predict_symbols,
    predicted_state,
)
from ..common.interface import VESSEL_STATES
from ..common.named_values import ConstantsMap, NamedValues, values_by_name, variables_of
from ..common.rigid_body import with_world_outputs
from ..common.shapes import Body
from ..common.water_surface import SURFACE_SUM, create_elevation_function
from .hull import Hull
from .strips import WAVE_SUM, TwinHull, wave_table

#: longest integration step (s); the motion of vessels is slow, and each stage evaluates the waves
MAX_STEP = 0.01


def wave_table_of(parameters: NamedValues, hull: TwinHull) -> SX:
    """Return the table of wave components (`strips.wave_table`) from the parameters `wave.*`."""
    return wave_table(
        hull,
        *(parameters[f"wave.{name}"] for name in ("amplitude", "frequency", "direction", "phase")),
    )


@dataclass(frozen=True)
class VesselModel:
    """Equations of one vessel.

    Attributes:
        identifier: Name of the FMU.
        description: Description of the FMU.
        variables: Parameters, inputs and outputs.
        derive_constants: Function from the parameters to the constants, which holds everything that
            depends on parameters only.
        hull: Function from the constants to the vessel.
        actuators: Names of the actuator states.
        actuator_rate: Function from actuator states, inputs and constants to the rates of these
            states. None means that the kind of the exported model moves them after each step.
        callees: Further functions that the equations call.
    """

    identifier: str
    description: str
    variables: Sequence[Variable]
    derive_constants: Callable[[NamedValues], Mapping[str, SX]]
    hull: Callable[[NamedValues], Hull]
    actuators: Sequence[str] = ()
    actuator_rate: Callable[[SX, NamedValues, NamedValues], SX] | None = None
    callees: Sequence[Callee] = ()

    @cached_property
    def constants(self) -> ConstantsMap:
        """Map from the parameters to the constants of the equations."""
        return ConstantsMap(self.variables, self.derive_constants)

    def hull_with(self, constants: SX) -> Hull:
        """Return the vessel for a vector of constants."""
        return self.hull(self.constants.by_name(constants))

    def create_continuous_model(
        self, kind: type[ContinuousModel] = ContinuousModel, **options: Any
    ) -> ContinuousModel:
        """Return the model to export; its contact outputs are 0.

        Args:
            kind: Class of the model.
            **options: Further arguments of the class.
        """
        inputs, actuators = variables_of(self.variables, "input"), len(self.actuators)
        return kind(
            self.identifier,
            self.description,
            self.variables,
            (*VESSEL_STATES, *self.actuators),
            lambda c: self.hull_with(c).initial_state(self.constants.by_name(c), actuators),
            lambda x, u, c: ca.vertcat(
                self.hull_with(c).rate(x, values_by_name(u, inputs)), self._actuator_rates(x, u, c)
            ),
            lambda x, _u, c: with_world_outputs(self.hull_with(c).observe(x)),
            normalised_state,
            derived_parameters=self.constants.vector,
            max_sub_step=MAX_STEP,
            callees=[WAVE_SUM, SURFACE_SUM, *self.callees],
            **options,
        )

    def _actuator_rates(self, state: SX, inputs: SX, constants: SX) -> SX:
        if self.actuator_rate is None:
            return SX.zeros(len(self.actuators))
        given = values_by_name(inputs, variables_of(self.variables, "input"))
        return self.actuator_rate(
            state[len(VESSEL_STATES) :], given, self.constants.by_name(constants)
        )


def normalised_state(state: SX) -> SX:
    """Return the state with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised_quaternion(state[3:7]), state[7:])


class BulletBody(NamedTuple):
    """Mass (kg) and moments of inertia about the body axes (kg m2) of the body in Bullet."""

    mass: SX
    inertia: SX


def floating_block(
    model: ContinuousModel, vessel: VesselModel, body: Body | Callable[[SX], BulletBody]
) -> Block:
    """Return a vessel for export: its FMU and the contact functions of the world.

    Args:
        model: Equations of the vessel as they are exported.
        vessel: The same equations by name.
        body: Body in Bullet, or the function from the constants to its mass and inertia.
    """
    if isinstance(body, Body):
        constant = BulletBody(SX(body.mass), SX(body.inertia))
        return as_block(model, FloatingContactMaps(model, vessel, lambda _: constant).functions())
    return as_block(model, FloatingContactMaps(model, vessel, body).functions())


@dataclass(frozen=True)
class FloatingContactMaps:
    """Contact functions of a vessel with the states `interface.VESSEL_STATES`.

    Bullet's body has its centre of mass in the origin O of the body frame, and mass and inertia of
    `body`. The impulse that Bullet finds does not depend on them, because the previous impulse is
    taken into account; they should not exceed those of the vessel. Poses and twists in Bullet are
    those of O. The argument `contact_impulse` is the impulse on O in the last step (N s, N m s
    about O, world frame), shape (6,).

    Attributes:
        model: Equations of the vessel as they are exported.
        vessel: The same equations by name.
        body: Function from the constants to mass and inertia of the body in Bullet.
    """

    model: ContinuousModel
    vessel: VesselModel
    body: Callable[[SX], BulletBody]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [
            initialize_function(self.model, self._twist, lambda state, _: _bullet_pose(state)),
            self._predict_function(),
            self._correct_function(),
            create_elevation_function(),
        ]

    def _twist(self, state: SX, constants: SX) -> SX:
        frame = self.vessel.hull_with(constants).frame(state[3:7])
        angular = frame.attitude @ (frame.rates_to_angular_velocity @ state[10:13])
        return ca.vertcat(frame.to_world @ state[7:10], angular)

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model) | create_symbols(contact_impulse=TWIST_SIZE)
        state, constants, step = arguments["state"], arguments["constants"], arguments["step_size"]
        impulse = arguments["contact_impulse"]
        hull, attitude = self.vessel.hull_with(constants), kinematics.rotation_matrix(state[3:7])
        load = _impulse_about_centre(hull, attitude, impulse) / step
        inputs = arguments["inputs"]
        first = [each.name for each in self.model.elements("input")].index("external_force.x")
        last = first + TWIST_SIZE
        loaded = ca.vertcat(inputs[:first], inputs[first:last] + load, inputs[last:])
        end = predicted_state(self.model, arguments, loaded)
        moved = mean_twist(state, end, step)
        body = self.body(constants)
        inertia = _inertia_in_world(body, attitude)
        turned = attitude @ ((attitude.T @ impulse[3:6]) / body.inertia)
        twist = moved - ca.vertcat(impulse[0:3] / body.mass, turned)
        return predict_function(
            arguments,
            end,
            twist,
            ca.vertcat(state[0:3], end[0:3]),
            is_upside_down(end[3:7]),
            compensating_torque=gyroscopic_torque(inertia, twist[3:6]),
            bullet_pose=_bullet_pose(state),
            previous_contact_impulse=impulse,
        )

    def _correct_function(self) -> ca.Function:
        arguments = correct_symbols(self.model)
        start, predicted, twist, bullet_twist, constants, step = arguments.values()
        arguments |= create_symbols(previous_contact_impulse=TWIST_SIZE)
        previous = arguments["previous_contact_impulse"]
        hull, attitude = self.vessel.hull_with(constants), kinematics.rotation_matrix(start[3:7])
        body = self.body(constants)
        inertia = _inertia_in_world(body, attitude)
        impulse, magnitude = impulse_of_twist(bullet_twist - twist, body.mass, inertia)
        surplus = _impulse_about_centre(hull, attitude, impulse - previous)
        position, orientation = moved_pose(start, bullet_twist, step)
        pose = ca.vertcat(position, kinematics.normalised_quaternion(orientation))
        before, frame = hull.frame(predicted[3:7]), hull.frame(pose[3:7])
        nu = predicted[7:13] + hull.inverse_mass_matrix @ hull.load_at_centre(before, surplus)
        # the velocity in the world frame is kept, although Bullet has turned the body
        velocity = frame.to_world.T @ (before.to_world @ nu[0:3])
        corrected = ca.vertcat(pose, velocity, nu[3:6], predicted[13:])
        mean_nu = ca.vertcat(
            frame.to_world.T @ bullet_twist[0:3],
            ca.inv(frame.rates_to_angular_velocity) @ (frame.attitude.T @ bullet_twist[3:6]),
        )
        return impulse_correct_function(
            arguments, impulse, magnitude, corrected, mean_nu, hull.observe
        )


def _inertia_in_world(body: BulletBody, attitude: SX) -> SX:
    return attitude @ ca.diag(body.inertia) @ attitude.T


def _impulse_about_centre(hull: Hull, attitude: SX, impulse: SX) -> SX:
    """Move an impulse (6) on O to the centre of mass."""
    lever = attitude @ hull.centre_of_mass
    return ca.vertcat(impulse[0:3], impulse[3:6] - ca.cross(lever, impulse[0:3]))


def _bullet_pose(state: SX) -> SX:
    return ca.vertcat(state[0:3], state[4:7], state[3])
