"""Compiled part of the contact scheme (`plant_src/physics/body.py`), as CasADi functions.

A vehicle's binary exports them:

`contact_initialize`
    Parameters -> constants (of `ContinuousModel.derived_parameters`, or the parameters), initial
    state as the predicted state of a step, its twist (twice) and its pose in Bullet.
`contact_predict`
    State, inputs, environment inputs (the last inputs of the model), constants, step size,
    reference position, safe distance -> state, predicted state after a step without contact, the
    constant twist that leads there, that twist again, pose in Bullet, endpoints of the centre of
    mass, step status.
`contact_correct`
    State at the start, predicted state, commanded twist, Bullet's twist, constants, step size ->
    state, magnitude of the contact impulse (0 without contact), outputs.

Each kind of body has further arguments and results: a free body the orientation of its principal
axes, a planar one its vertical load, a body in water its contact impulse. Floating vessels also
export `water_elevation` (`water_surface.py`), and multirotors `surroundings`
(`multirotor/surroundings.py`).

The twist that Bullet changes in contact, times the mass and inertia of Bullet's body, gives the
contact impulse. Divided by the mass and inertia of the vehicle it is added to the predicted
velocity. In contact the published velocity is Bullet's mean velocity of the step; the velocity of
the equations belongs to the end of the step and is not zero at rest. The pose in contact follows
from Bullet's twist, because Bullet moves a body with its velocity at the end of the step.

A vehicle in water responds to a load differently from Bullet's free body: the water adds mass,
restoring and damping. Therefore the contact impulse of the previous step acts as a constant force
while the equations predict (constant in world axes, which conserves momentum), and Bullet receives
the predicted twist without its effect. Bullet then finds the whole impulse again, and the
difference to the previous one changes the velocity by the mass matrix with the added mass. In
steady contact both are equal, so that the motion is that of the equations with the contact force
included.

A pose in Bullet is (position, quaternion x y z w), a twist (velocity, angular velocity), both in
the world frame.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from cosim.export.equations.model import ContinuousModel

from . import kinematics
from .interface import (
    ENVIRONMENT_INPUTS,
    INVALID_STATE,
    LEAVES_SAFE_BOX,
    MAX_STATE_NORM,
    MAY_FAIL,
)
from .rigid_body import RigidBody, motion_of_state

#: symbols by the names of the arguments of a function
Symbols = dict[str, SX]

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
    """

    model: ContinuousModel
    rigid_body: Callable[[SX], RigidBody]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [
            free_initialize_function(self.model),
            self._predict_function(),
            self._correct_function(),
        ]

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model) | create_symbols(principal_axes=4)
        state, end = arguments["state"], predicted_state(self.model, arguments)
        twist = mean_twist(state, end, arguments["step_size"])
        inertia = self.rigid_body(arguments["constants"]).inertia_in_world(state[3:7])
        # the surface can reach the centre of mass from its level at the start of the step
        names = [variable.name for variable in self.model.elements("input")]
        environment = [name for name in names if name in ENVIRONMENT_INPUTS]
        level = arguments["environment_inputs"][environment.index("water_level")]
        speed = MAX_SURFACE_SPEED + ca.norm_2(end[7:10])
        may_be_in_water = end[2] < level + arguments["step_size"] * speed
        return predict_function(
            arguments,
            end,
            twist,
            ca.vertcat(state[0:3], end[0:3]),
            ca.logic_or(may_be_in_water, is_upside_down(end[3:7])),
            compensating_torque=gyroscopic_torque(inertia, twist[3:6]),
            bullet_pose=principal_pose(state, arguments["principal_axes"]),
        )

    def _correct_function(self) -> ca.Function:
        arguments = correct_symbols(self.model)
        start, predicted, twist, bullet_twist, constants, step = arguments.values()
        linear, angular = ca.vertsplit(bullet_twist - twist, 3)
        rigid, to_body = self.rigid_body(constants), kinematics.rotation_matrix(predicted[3:7]).T
        rates = rigid.inverse_inertia @ (to_body @ (rigid.inertia_in_world(start[3:7]) @ angular))
        velocity, others = predicted[7:13] + ca.vertcat(linear, rates), predicted[13:]
        impulse = contact_impulse(rigid.mass * ca.norm_2(linear))
        position, orientation = moved_pose(start, bullet_twist, step)
        pose = ca.vertcat(position, kinematics.normalised_quaternion(orientation))
        rates_in_contact = kinematics.rotation_matrix(orientation).T @ bullet_twist[3:6]
        published = ca.vertcat(pose, bullet_twist[0:3], rates_in_contact, others)
        corrected = ca.vertcat(pose, velocity, others)
        return correct_function(arguments, impulse, corrected, published, motion_of_state)


@dataclass(frozen=True)
class SubmergedContactMaps(FreeContactMaps):
    """Contact functions of a free rigid body in water.

    The environment inputs of the model are the current (x, y) and the water level. The argument
    `contact_impulse` is the impulse in the last step (N s, N m s about the centre of mass, world
    frame).

    Attributes:
        velocity_change: Function from the upward axis of the world (body frame), the depth of the
            centre of mass (m), the constants and an impulse (6, body frame) to the change of
            velocity and rates (6, body frame), with the added mass.
    """

    velocity_change: Callable[[SX, SX, SX, SX], SX]

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model) | create_symbols(
            principal_axes=4, contact_impulse=TWIST_SIZE
        )
        state, inputs, step = arguments["state"], arguments["inputs"], arguments["step_size"]
        impulse = arguments["contact_impulse"]
        # the external loads are the first inputs
        loaded = ca.vertcat(inputs[:TWIST_SIZE] + impulse / step, inputs[TWIST_SIZE:])
        end = predicted_state(self.model, arguments, loaded)
        moved = mean_twist(state, end, step)
        body = self.rigid_body(arguments["constants"])
        to_world = kinematics.rotation_matrix(state[3:7])
        turned = to_world @ (body.inverse_inertia @ (to_world.T @ impulse[3:6]))
        twist = moved - ca.vertcat(impulse[0:3] / body.mass, turned)
        return predict_function(
            arguments,
            end,
            twist,
            ca.vertcat(state[0:3], end[0:3]),
            SX(0),
            compensating_torque=gyroscopic_torque(body.inertia_in_world(state[3:7]), twist[3:6]),
            bullet_pose=principal_pose(state, arguments["principal_axes"]),
            previous_contact_impulse=impulse,
        )

    def _correct_function(self) -> ca.Function:
        arguments = correct_symbols(self.model)
        start, predicted, twist, bullet_twist, constants, step = arguments.values()
        arguments |= create_symbols(environment_inputs=3, previous_contact_impulse=TWIST_SIZE)
        previous = arguments["previous_contact_impulse"]
        body, to_world = self.rigid_body(constants), kinematics.rotation_matrix(predicted[3:7])
        inertia = body.inertia_in_world(start[3:7])
        impulse, magnitude = impulse_of_twist(bullet_twist - twist, body.mass, inertia)
        surplus = impulse - previous
        surplus = ca.vertcat(to_world.T @ surplus[0:3], to_world.T @ surplus[3:6])
        up, depth = to_world[2, :].T, arguments["environment_inputs"][-1] - predicted[2]
        gained = self.velocity_change(up, depth, constants, surplus)
        position, orientation = moved_pose(start, bullet_twist, step)
        orientation = kinematics.normalised_quaternion(orientation)
        velocity = predicted[7:13] + ca.vertcat(to_world @ gained[0:3], gained[3:6])
        corrected = ca.vertcat(position, orientation, velocity, predicted[13:])
        rates = kinematics.rotation_matrix(orientation).T @ bullet_twist[3:6]
        mean = ca.vertcat(bullet_twist[0:3], rates)
        return impulse_correct_function(
            arguments, impulse, magnitude, corrected, mean, motion_of_state
        )


def named_function(
    name: str, arguments: Mapping[str, SX], results: Mapping[str, SX]
) -> ca.Function:
    """Return the function of symbols to expressions, whose names the binary exports."""
    return ca.Function(name, [*arguments.values()], [*results.values()], [*arguments], [*results])


def create_symbols(**sizes: int) -> Symbols:
    """Return a column vector of symbols for each name and size."""
    return {name: SX.sym(name, size) for name, size in sizes.items()}


def initialize_function(
    model: ContinuousModel,
    twist: Callable[[SX, SX], SX],
    pose: Callable[[SX, SX], SX],
    **further_arguments: SX,
) -> ca.Function:
    """Return `contact_initialize`.

    Args:
        model: Equations of the vehicle.
        twist: Function from state and constants to the twist.
        pose: Function from state and constants to the pose in Bullet.
        **further_arguments: Symbols of further arguments.
    """
    (parameters,) = create_symbols(parameters=len(model.elements("parameter"))).values()
    constants = model.derived_parameters(parameters) if model.derived_parameters else parameters
    state = model.initial_state(constants)
    moving = twist(state, constants)
    results = {
        "constants": constants,
        "predicted_state": state,
        "commanded_twist": moving,
        "bullet_twist": moving,
        "bullet_pose": pose(state, constants),
    }
    arguments = {"parameters": parameters, **further_arguments}
    return named_function("contact_initialize", arguments, results)


def free_initialize_function(model: ContinuousModel) -> ca.Function:
    """Return `contact_initialize` of a body whose state begins with that of a free rigid body."""
    axes = create_symbols(principal_axes=4)

    def twist(state: SX, _constants: SX) -> SX:
        return ca.vertcat(state[7:10], kinematics.rotation_matrix(state[3:7]) @ state[10:13])

    def pose(state: SX, _constants: SX) -> SX:
        return principal_pose(state, axes["principal_axes"])

    return initialize_function(model, twist, pose, **axes)


def predict_symbols(model: ContinuousModel) -> Symbols:
    """Return symbols of the arguments that every `contact_predict` has.

    `reference_position` and `safe_distance` are centre and half edges (m, world frame) of the box
    in which the vehicle cannot meet anything.
    """
    environment = sum(variable.name in ENVIRONMENT_INPUTS for variable in model.elements("input"))
    inputs = len(model.elements("input")) - environment
    return {
        **create_symbols(state=len(model.states), inputs=inputs, environment_inputs=environment),
        "constants": model.derived_parameter_symbols(),
        **create_symbols(step_size=1, reference_position=3, safe_distance=3),
    }


def correct_symbols(model: ContinuousModel) -> Symbols:
    """Return symbols of the arguments that every `contact_correct` has."""
    return {
        **create_symbols(
            start_state=len(model.states),
            predicted_state=len(model.states),
            commanded_twist=TWIST_SIZE,
            bullet_twist=TWIST_SIZE,
        ),
        "constants": model.derived_parameter_symbols(),
        **create_symbols(step_size=1),
    }


def predicted_state(model: ContinuousModel, arguments: Symbols, inputs: SX | None = None) -> SX:
    """Return the state after a step without contact, with other inputs if these are given."""
    sub_steps = round(MAX_WORLD_STEP / model.max_sub_step)
    inputs = arguments["inputs"] if inputs is None else inputs
    all_inputs = ca.vertcat(inputs, arguments["environment_inputs"])
    state, constants, step = arguments["state"], arguments["constants"], arguments["step_size"]
    return model.integrate(state, all_inputs, constants, step, sub_steps)


def predict_function(
    arguments: Symbols,
    end: SX,
    twist: SX,
    endpoints: SX,
    may_fail: SX,
    **further_results: SX,
) -> ca.Function:
    """Return `contact_predict`.

    Args:
        arguments: Symbols of `predict_symbols` and further ones.
        end: Predicted state.
        twist: Twist that Bullet receives.
        endpoints: Centre of mass at the start and the end of the step (m, world frame), shape (6,).
        may_fail: Condition of MAY_FAIL.
        **further_results: Results between the twists and the endpoints.
    """
    results = {
        "start_state": arguments["state"],
        "predicted_state": end,
        "commanded_twist": twist,
        "bullet_twist": twist,
        **further_results,
        "endpoints": endpoints,
        "step_status": step_status(end, endpoints, arguments, may_fail),
    }
    return named_function("contact_predict", arguments, results)


def correct_function(
    arguments: Symbols,
    impulse: SX,
    corrected: SX,
    published: SX,
    observe: Callable[[SX], SX],
    **further_results: SX,
) -> ca.Function:
    """Return `contact_correct` of a body that forgets the impulse of the last step.

    With contact it selects `corrected` and publishes `published`, else the predicted state for
    both.
    """
    predicted = arguments["predicted_state"]
    state, observed = (
        ca.if_else(impulse > 0, in_contact, predicted) for in_contact in (corrected, published)
    )
    results = {"state": state, "impulse_magnitude": impulse, "motion": observe(observed)}
    return named_function("contact_correct", arguments, results | further_results)


def impulse_correct_function(
    arguments: Symbols,
    impulse: SX,
    magnitude: SX,
    corrected: SX,
    mean_velocity: SX,
    observe: Callable[[SX], SX],
) -> ca.Function:
    """Return `contact_correct` of a body on which the impulse of the last step acts.

    Args:
        arguments: Symbols of `correct_symbols` and `previous_contact_impulse`.
        impulse: Impulse of this step, shape (6,).
        magnitude: Its magnitude (N s).
        corrected: State if there is an impulse in this step or was one in the last.
        mean_velocity: Velocity and rates in this step, which are published in contact, shape (6,).
        observe: Function from the state to the published motion.
    """
    predicted, previous = arguments["predicted_state"], arguments["previous_contact_impulse"]
    in_contact = ca.logic_or(magnitude > 0, ca.norm_2(previous) > 0)
    state = ca.if_else(in_contact, corrected, predicted)
    velocity = ca.if_else(magnitude > 0, mean_velocity, state[7:13])
    motion = observe(ca.vertcat(state[0:7], velocity, state[13:]))
    results = {
        "state": state,
        "impulse_magnitude": magnitude,
        "motion": motion,
        "contact_impulse": impulse,
    }
    return named_function("contact_correct", arguments, results)


def is_upside_down(orientation: SX) -> SX:
    """Return whether the up axis of a body points downwards."""
    return orientation[1] ** 2 + orientation[2] ** 2 > 0.5


def step_status(end: SX, endpoints: SX, arguments: Symbols, may_fail: SX) -> SX:
    """Return the code (`interface.py`) of a predicted step; see `predict_function`."""
    magnitudes = ca.fabs(ca.vertcat(arguments["inputs"], arguments["environment_inputs"]))
    valid = ca.logic_and(ca.sum1(magnitudes) < ca.inf, ca.norm_2(end) < MAX_STATE_NORM)
    distance = ca.fabs(endpoints - ca.repmat(arguments["reference_position"], 2))
    excess = distance - ca.repmat(arguments["safe_distance"], 2)
    return ca.if_else(
        valid, LEAVES_SAFE_BOX * (ca.mmax(excess) > 0) + MAY_FAIL * may_fail, INVALID_STATE
    )


def contact_impulse(impulse: SX) -> SX:
    """Return the impulse (N s), with 0 in place of rounding errors; NaN remains NaN."""
    return ca.if_else(impulse <= IMPULSE_TOLERANCE, 0, impulse)


def principal_pose(state: SX, axes: SX) -> SX:
    """Return the pose in Bullet of a body whose principal axes have the orientation `axes`.

    The orientation is that in the body frame (quaternion x y z w).
    """
    orientation = kinematics.quaternion_product(state[3:7], ca.vertcat(axes[3], axes[0:3]))
    return ca.vertcat(state[0:3], orientation[1:4], orientation[0])


def mean_twist(start: SX, end: SX, step: SX) -> SX:
    """Return the constant twist (6) that moves a body from the pose of one state to another's."""
    turn = kinematics.quaternion_product(end[3:7], kinematics.conjugate(start[3:7]))
    return ca.vertcat((end[0:3] - start[0:3]) / step, kinematics.rotation_vector(turn) / step)


def moved_pose(start: SX, twist: SX, step: SX) -> tuple[SX, SX]:
    """Return position and quaternion, of about unit length, after a step with a constant twist."""
    rotation = kinematics.quaternion_from_rotation_vector(twist[3:6] * step)
    return start[0:3] + twist[0:3] * step, kinematics.quaternion_product(rotation, start[3:7])


def gyroscopic_torque(inertia: SX, rates: SX) -> SX:
    """Return the torque (N m) that cancels the gyroscopic torque which Bullet adds to its body."""
    return ca.cross(rates, inertia @ rates)


def impulse_of_twist(change: SX, mass: SX, inertia: SX) -> tuple[SX, SX]:
    """Return the impulse (6) that changes the twist of Bullet's body, and its magnitude.

    Args:
        change: Change of the twist, shape (6,).
        mass: Mass of the body (kg).
        inertia: Its inertia (kg m2, world frame), shape (3, 3).

    Returns:
        Impulse (N s, N m s), 0 if it is a rounding error, and the magnitude of its linear part.
    """
    linear, angular = mass * change[0:3], inertia @ change[3:6]
    magnitude = contact_impulse(ca.norm_2(linear))
    impulse = ca.if_else(magnitude > 0, ca.vertcat(linear, angular), SX.zeros(TWIST_SIZE))
    return impulse + 0 * magnitude, magnitude  # NaN remains NaN
