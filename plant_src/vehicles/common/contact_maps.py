"""Compiled part of the contact scheme (`plant_src/physics/body.py`), as CasADi functions that a vehicle's binary exports.

    contact_initialize  parameters -> constants (of `ContinuousModel.derived_parameters`, or the parameters), initial state as
                        the predicted state of a step, its twist (twice) and its pose in Bullet
    contact_predict     state, inputs, environment inputs (the last inputs of the model), constants, step size, reference
                        position, safe distance -> state, predicted state after a step without contact, the constant twist that
                        leads there, that twist again, pose in Bullet, endpoints of the centre of mass, step status
    contact_correct     state at the start, predicted state, commanded twist, Bullet's twist, constants, step size
                        -> state, magnitude of the contact impulse (0 without contact), outputs

Each kind of body has further arguments and results: a free body the orientation of its principal axes, a planar one its
vertical load, a floating one its contact impulse. Floating vessels also export `water_elevation` (`common/water_surface.py`),
and multirotors `surroundings` (`multirotor/surroundings.py`).

The twist that Bullet changes in contact, times the mass and inertia of Bullet's body, gives the contact impulse. Divided by the
mass and inertia of the vehicle it is added to the predicted velocity. In contact the published velocity is Bullet's mean velocity
of the step; the velocity of the equations belongs to the end of the step and is not zero at rest. The pose in contact follows
from Bullet's twist, because Bullet moves a body with its velocity at the end of the step.

A pose in Bullet is (position, quaternion x y z w), a twist (velocity, angular velocity), both in the world frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca

from cosim.export.equations.model import ContinuousModel

from . import kinematics
from .interface import ENVIRONMENT_INPUTS
from .rigid_body import RigidBody
from .step_status import INVALID_STATE, LEAVES_SAFE_BOX, MAX_STATE_NORM, MAY_FAIL

#: names of the arguments and results that every `contact_predict` has, see `predict_symbols`
PREDICT_ARGUMENTS = (
    "state",
    "inputs",
    "environment_inputs",
    "constants",
    "step_size",
    "reference_position",
    "safe_distance",
)
PREDICT_RESULTS = ("start_state", "predicted_state", "commanded_twist", "bullet_twist")
#: names of the results that every `contact_initialize` has
INITIALIZE_RESULTS = ("constants", *PREDICT_RESULTS[1:], "bullet_pose")
#: names of the arguments and results that every `contact_correct` has, see `correct_symbols`
CORRECT_ARGUMENTS = (*PREDICT_RESULTS, "constants", "step_size")
CORRECT_RESULTS = ("state", "impulse_magnitude", "motion")
#: names of the results of `contact_predict` of a free body, and of one with a contact impulse
FREE_RESULTS = (
    *PREDICT_RESULTS,
    "compensating_torque",
    "bullet_pose",
    "endpoints",
    "step_status",
)
IMPULSE_RESULTS = (*FREE_RESULTS[:-2], "previous_contact_impulse", *FREE_RESULTS[-2:])

#: longest step of the world (s)
MAX_WORLD_STEP = 0.01

#: speed (m/s) that the water surface does not exceed vertically; its slope is at most 1
MAX_SURFACE_SPEED = 10.0

#: elements of a twist, and of a force with its torque
TWIST_SIZE = 6

#: largest impulse (N s) that counts as rounding; rounding errors are below 1e-14
IMPULSE_TOLERANCE = 1e-12


@dataclass(frozen=True)
class FreeContactMaps:
    """Contact functions of a free rigid body.

    The state begins with position, quaternion, velocity (world frame) and rates (body frame);
    contact does not change its further elements. The argument `principal_axes` is the orientation
    of Bullet's body in the body frame (quaternion x y z w).

    Attributes:
        model: Equations of the vehicle.
        rigid_body: Function from the constants to mass and inertia.
        observe: Function from the state to the published motion.
    """

    model: ContinuousModel
    rigid_body: Callable[[ca.SX], RigidBody]
    observe: Callable[[ca.SX], ca.SX]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [
            free_initialize_function(self.model),
            self._predict_function(),
            self._correct_function(),
        ]

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, end, step = arguments[0], predicted_state(self.model, *arguments[:5]), arguments[4]
        (axes,) = create_symbols(principal_axes=4)
        linear = (end[0:3] - state[0:3]) / step
        angular = (
            kinematics.rotation_vector(
                kinematics.quaternion_product(end[3:7], kinematics.conjugate(state[3:7]))
            )
            / step
        )
        # cancels the gyroscopic torque that Bullet adds to its body
        torque = ca.cross(
            angular, self.rigid_body(arguments[3]).inertia_in_world(state[3:7]) @ angular
        )
        twist, endpoints = ca.vertcat(linear, angular), ca.vertcat(state[0:3], end[0:3])
        may_fail = ca.logic_or(
            self._may_be_in_water(end, *arguments[2:5:2]), is_upside_down(end[3:7])
        )
        status = step_status(end, endpoints, arguments, may_fail)
        results = [state, end, twist, twist, torque, principal_pose(state, axes), endpoints, status]
        return ca.Function(
            "contact_predict",
            [*arguments, axes],
            results,
            [*PREDICT_ARGUMENTS, "principal_axes"],
            FREE_RESULTS,
        )

    def _may_be_in_water(self, end: ca.SX, environment_inputs: ca.SX, step: ca.SX) -> ca.SX:
        """Return whether the surface can reach the centre of mass in a step.

        Its level is that at the start of the step.
        """
        environment = [
            variable.name
            for variable in self.model.elements("input")
            if variable.name in ENVIRONMENT_INPUTS
        ]
        level = environment_inputs[environment.index("water_level")]
        return end[2] < level + step * (MAX_SURFACE_SPEED + ca.norm_2(end[7:10]))

    def _correct_function(self) -> ca.Function:
        start, predicted, twist, bullet_twist, constants, step = arguments = correct_symbols(
            self.model
        )
        linear, angular = ca.vertsplit(bullet_twist - twist, 3)
        rigid, to_body = self.rigid_body(constants), kinematics.rotation_matrix(predicted[3:7]).T
        rates = rigid.inverse_inertia @ (to_body @ (rigid.inertia_in_world(start[3:7]) @ angular))
        velocity, others = predicted[7:13] + ca.vertcat(linear, rates), predicted[13:]
        impulse = contact_impulse(rigid.mass * ca.norm_2(linear))
        rotation = kinematics.quaternion_from_rotation_vector(bullet_twist[3:6] * step)
        orientation = kinematics.quaternion_product(rotation, start[3:7])
        pose = ca.vertcat(
            start[0:3] + bullet_twist[0:3] * step, kinematics.normalised_quaternion(orientation)
        )
        published = ca.vertcat(
            pose,
            bullet_twist[0:3],
            kinematics.rotation_matrix(orientation).T @ bullet_twist[3:6],
            others,
        )
        corrected = ca.vertcat(pose, velocity, others)
        return correct_function(
            arguments,
            CORRECT_ARGUMENTS,
            impulse,
            predicted,
            corrected,
            self.observe,
            published,
        )


def free_initialize_function(model: ContinuousModel) -> ca.Function:
    """Return `contact_initialize` of a body whose state begins with that of a free rigid body."""
    parameters, constants = parameters_and_constants(model)
    (axes,) = create_symbols(principal_axes=4)
    state = model.initial_state(constants)
    twist = ca.vertcat(state[7:10], kinematics.rotation_matrix(state[3:7]) @ state[10:13])
    results = [constants, state, twist, twist, principal_pose(state, axes)]
    names = ["parameters", "principal_axes"], INITIALIZE_RESULTS
    return ca.Function("contact_initialize", [parameters, axes], results, *names)


def parameters_and_constants(model: ContinuousModel) -> tuple[ca.SX, ca.SX]:
    """Return symbols of the parameters, and the constants derived from them."""
    (parameters,) = create_symbols(parameters=len(model.elements("parameter")))
    return parameters, model.derived_parameters(
        parameters
    ) if model.derived_parameters else parameters


def predict_symbols(model: ContinuousModel) -> list[ca.SX]:
    """Return symbols of the arguments that every `contact_predict` has.

    These are state, inputs, environment inputs, constants, step size (s), and centre and half edges
    (m, world frame) of the box in which the vehicle cannot meet anything.
    """
    environment = sum(variable.name in ENVIRONMENT_INPUTS for variable in model.elements("input"))
    inputs = len(model.elements("input")) - environment
    vectors = create_symbols(state=len(model.states), inputs=inputs, environment_inputs=environment)
    return [
        *vectors,
        model.derived_parameter_symbols(),
        *create_symbols(step_size=1, reference_position=3, safe_distance=3),
    ]


def correct_symbols(model: ContinuousModel) -> list[ca.SX]:
    """Return symbols of the arguments that every `contact_correct` has.

    These are state at the start, predicted state at the end of the step, commanded twist, Bullet's
    twist, constants and step size (s).
    """
    count = len(model.states)
    vectors = create_symbols(
        start_state=count,
        predicted_state=count,
        commanded_twist=TWIST_SIZE,
        bullet_twist=TWIST_SIZE,
    )
    return [*vectors, model.derived_parameter_symbols(), *create_symbols(step_size=1)]


def predicted_state(
    model: ContinuousModel,
    state: ca.SX,
    inputs: ca.SX,
    environment_inputs: ca.SX,
    constants: ca.SX,
    step: ca.SX,
) -> ca.SX:
    """Return the state after a step (s) without contact."""
    sub_steps = round(MAX_WORLD_STEP / model.max_sub_step)
    return model.integrate(
        state, ca.vertcat(inputs, environment_inputs), constants, step, sub_steps
    )


def correct_function(
    arguments: list[ca.SX],
    names: Sequence[str],
    impulse: ca.SX,
    predicted: ca.SX,
    corrected: ca.SX,
    observe: Callable[[ca.SX], ca.SX],
    published: ca.SX,
    **further_results: ca.SX,
) -> ca.Function:
    """Return `contact_correct`, whose arguments have the given names.

    With contact it selects `corrected` and publishes `published`, else `predicted` for both.
    """
    state, observed = (
        ca.if_else(impulse > 0, in_contact, predicted) for in_contact in (corrected, published)
    )
    return ca.Function(
        "contact_correct",
        arguments,
        [state, impulse, observe(observed), *further_results.values()],
        names,
        [*CORRECT_RESULTS, *further_results],
    )


def create_symbols(**sizes: int) -> list[ca.SX]:
    """Return a column vector of symbols for each name and size."""
    return [ca.SX.sym(name, size) for name, size in sizes.items()]


def is_upside_down(orientation: ca.SX) -> ca.SX:
    """Return whether the up axis of a body points downwards."""
    return orientation[1] ** 2 + orientation[2] ** 2 > 0.5


def step_status(end: ca.SX, endpoints: ca.SX, arguments: list[ca.SX], may_fail: ca.SX) -> ca.SX:
    """Return the code (`step_status.py`) of a predicted step.

    Args:
        end: Predicted state.
        endpoints: Centre of mass at the start and the end of the step (m, world frame), shape (6,).
        arguments: Symbols of `predict_symbols`.
        may_fail: Condition of MAY_FAIL.
    """
    _, inputs, environment_inputs, _, _, reference_position, safe_distance = arguments
    magnitudes = ca.fabs(ca.vertcat(inputs, environment_inputs))
    valid = ca.logic_and(ca.sum1(magnitudes) < ca.inf, ca.norm_2(end) < MAX_STATE_NORM)
    distance = ca.fabs(endpoints - ca.vertcat(reference_position, reference_position))
    excess = distance - ca.vertcat(safe_distance, safe_distance)
    return ca.if_else(
        valid, LEAVES_SAFE_BOX * (ca.mmax(excess) > 0) + MAY_FAIL * may_fail, INVALID_STATE
    )


def contact_impulse(impulse: ca.SX) -> ca.SX:
    """Return the impulse (N s), with 0 in place of rounding errors; NaN remains NaN."""
    return ca.if_else(impulse <= IMPULSE_TOLERANCE, 0, impulse)


def principal_pose(state: ca.SX, axes: ca.SX) -> ca.SX:
    """Return the pose in Bullet of a body whose principal axes have the orientation `axes` in the body frame."""
    orientation = kinematics.quaternion_product(state[3:7], ca.vertcat(axes[3], axes[0:3]))
    return ca.vertcat(state[0:3], orientation[1:4], orientation[0])
