"""Contact bodies: vehicles that move by their own compiled equations, with contact resolved by Bullet.

A step of the world has three parts:

1. `predict`: the equations integrate each vehicle over the step without contact. Bullet receives the constant velocity and
   angular velocity that lead a rigid body to the predicted pose.
2. Bullet makes one step. Contact changes the velocities.
3. `correct`: the change of velocity times Bullet's mass and inertia is the contact impulse. The equations apply it to the
   predicted velocity and take over the pose to which Bullet's motion leads.

Gravity is part of the equations and zero in Bullet. A vehicle far from everything else needs no contact solution, and its motion
is known without Bullet: Bullet steps only bodies that are near something (`clearance.py`). Inactive bodies wait in a remote row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..placement import DRY, ContactSurface
from ..vehicles.common.shapes import Body, Box, ConvexPiece, Shape
from ..vehicles.common.step_status import MAX_STATE_NORM
from .clearance import BoundingBox
from .client import pybullet
from .compiled_equations import bind_arrays, load_library
from .convex_pieces import mesh_file

if TYPE_CHECKING:
    from ctypes import _NamedFuncPointer

    from ..placement import Platform, VehiclePlacement
    from ..vehicles.model import Model

#: first x coordinate of inactive bodies (m), beyond the reach of any vehicle, and distance between
#: them (m)
INACTIVE_POSITION, INACTIVE_SPACING = 2 * MAX_STATE_NORM, 100.0
IDENTITY_QUATERNION = (0.0, 0.0, 0.0, 1.0)

_MAX_VELOCITY = 1e6  # m/s, rad/s; Bullet silently limits velocities to 100 by default

#: names of the arrays that are arguments and results of a compiled function
ArrayNames = tuple[Sequence[str], Sequence[str]]

#: arguments and results that all vehicles' `contact_predict` have in common
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


class InvalidStateError(Exception):
    """An input or the motion of a vehicle is not finite or too large.

    The text names the variable.
    """


class ContactBody:
    """One vehicle in a world.

    Its body in Bullet and its compiled equations (`vehicles/common/contact_maps.py`).

    Twists are (velocity, angular velocity) in m/s and rad/s, world frame.

    Attributes:
        name: Name of the vehicle.
        model: Model of the vehicle.
        body_id: Number of the body in Bullet.
        inputs: Real inputs of the model in order, in one or several parts.
        outputs: Real outputs in order; `correct` writes the motion, `contacts.py` the contact
            force.
        environment_inputs: Inputs that the environment writes, in order.
        commanded_twist: Twist to set in Bullet before its step, shape (6,).
        bullet_twist: Twist that Bullet computed, shape (6,). `predict` writes the one expected
            without contact.
        compensating_torque: Torque (N m, world frame) that cancels Bullet's gyroscopic torque, or
            None.
        predict: Function without arguments: integrate the equations over the step without contact.
        correct: Function without arguments: apply Bullet's twist and publish the outputs.
    """

    ARRAY_SIZES: ClassVar[Mapping[str, int]] = {
        "commanded_twist": 6,
        "bullet_twist": 6,
        "bullet_pose": 7,
    }
    INITIALIZE_ARRAYS: ClassVar[ArrayNames] = (
        ("parameters",),
        ("constants", "predicted_state", "commanded_twist", "bullet_twist", "bullet_pose"),
    )
    PREDICT_ARRAYS: ClassVar[ArrayNames]
    CORRECT_ARRAYS: ClassVar[ArrayNames] = (
        (*PREDICT_RESULTS, "constants", "step_size"),
        ("state", "impulse_magnitude", "outputs"),
    )
    #: maximal coordinates halve Bullet's time, but its saved states lack the inertia of such a body
    #: in world axes
    USE_MAXIMAL_COORDINATES = False

    def __init__(self, client: int, vehicle: VehiclePlacement, arrays: Mapping[str, np.ndarray]):
        """Create the body in Bullet and initialize the equations.

        Args:
            client: Number of the Bullet client.
            vehicle: Vehicle to create.
            arrays: Arrays of the sizes that `array_sizes` returns, and "step_size" (s), which all
                vehicles share.
        """
        self.name, self.model, self._client = vehicle.name, vehicle.model, client
        parameters = np.array(vehicle.model.equation_parameters(vehicle.parameters))
        constants = (
            vehicle.model.constant_count
            if vehicle.model.constant_count is not None
            else len(parameters)
        )
        fixed = {"parameters": parameters, "principal_axes": np.array(vehicle.body.axes)}
        self._arrays = arrays = {**arrays, **fixed, "constants": np.zeros(constants)}
        self.inputs = [arrays["inputs"][place] for place in vehicle.model.input_places]
        self.outputs = arrays["outputs"]
        self.parameters = np.array(vehicle.parameters)
        self.environment_inputs = arrays["environment_inputs"]
        self.environment_inputs[:] = [
            variable.start for variable in vehicle.model.environment_inputs
        ]
        # memoryviews: access to a few numbers is faster than with NumPy
        self.bullet_twist: Any = arrays["bullet_twist"].data
        self.commanded_twist: Any = arrays["commanded_twist"].data
        self.compensating_torque: Any = (
            arrays["compensating_torque"].data if "compensating_torque" in arrays else None
        )
        library = load_library(vehicle.model.binary)
        self.predict = self._bind(library.contact_predict, self.PREDICT_ARRAYS)
        self.correct = self._bind(library.contact_correct, self.CORRECT_ARRAYS)
        self._bind(library.contact_initialize, self.INITIALIZE_ARRAYS)()
        self.correct()
        self.body_id = self._create_body(vehicle)
        self.reset_pose()

    @classmethod
    def array_sizes(cls, model: Model) -> dict[str, int]:
        """Return the arrays of a vehicle in a world, as name to size."""
        inputs = {"inputs": model.input_count, "environment_inputs": len(model.environment_inputs)}
        states = dict.fromkeys(("state", "start_state", "predicted_state"), len(model.states))
        clearance = {"endpoints": 6, "reference_position": 3, "safe_distance": 3}
        scalars = {"step_status": 1, "impulse_magnitude": 1}
        return {
            **states,
            **cls.ARRAY_SIZES,
            **inputs,
            "outputs": len(model.slots("output")),
            **clearance,
            **scalars,
        }

    def _bind(self, function: _NamedFuncPointer, names: ArrayNames) -> Callable[[], None]:
        arguments, results = ([self._arrays[name] for name in side] for side in names)
        return bind_arrays(function, arguments, results)

    def _create_body(self, vehicle: VehiclePlacement) -> int:
        """Create the body in Bullet and return its number."""
        body = vehicle.body
        shape, maximal = (
            create_compound_shape(body.boxes, self._client),
            self.USE_MAXIMAL_COORDINATES,
        )
        number = pybullet.createMultiBody(
            body.mass, shape, -1, useMaximalCoordinates=maximal, physicsClientId=self._client
        )
        set_dynamics(self._client, number, -1, vehicle.surface, body)
        return int(number)

    @staticmethod
    def bounding_box(body: Body) -> BoundingBox:
        """Return a box around the centre of mass that contains the body at every attitude."""
        radius = float(max(np.linalg.norm(box.corners(), axis=1).max() for box in body.boxes))
        return BoundingBox((-radius, -radius, -radius), (radius, radius, radius))

    def reset_pose(self) -> None:
        """Move the body in Bullet to its pose at the start of the step."""
        pose = self._arrays["bullet_pose"].tolist()
        pybullet.resetBasePositionAndOrientation(self.body_id, pose[0:3], pose[3:7], self._client)

    def set_active(self, active: bool) -> None:
        """Move the body in Bullet to its pose, or out of the reach of all vehicles."""
        if active:
            self.reset_pose()
        else:
            position = [INACTIVE_POSITION + INACTIVE_SPACING * self.body_id, 0.0, 0.0]
            pybullet.resetBasePositionAndOrientation(
                self.body_id, position, IDENTITY_QUATERNION, self._client
            )

    def describe_invalid_state(self) -> str:
        """Return a message that names the first input that is not finite, or the predicted state with the largest value."""
        names = [
            *self.model.slots("input"),
            *(variable.name for variable in self.model.environment_inputs),
        ]
        for name, value in zip(
            names, np.concatenate([*self.inputs, self.environment_inputs]), strict=True
        ):
            if not math.isfinite(value):
                return f"{self.name}.{name} is {value}, expected a finite number"
        predicted = self._arrays["predicted_state"]
        worst = int(np.argmax(np.nan_to_num(np.abs(predicted), nan=np.inf)))
        return (
            f"{self.name}.{self.model.states[worst]} became {predicted[worst]:g}: the motion has "
            "diverged"
        )


class FreeBody(ContactBody):
    """A vehicle in six degrees of freedom.

    Its frame in Bullet has the principal axes of inertia.
    """

    ARRAY_SIZES = {**ContactBody.ARRAY_SIZES, "compensating_torque": 3}
    INITIALIZE_ARRAYS: ClassVar[ArrayNames] = (
        ("parameters", "principal_axes"),
        ContactBody.INITIALIZE_ARRAYS[1],
    )
    PREDICT_ARRAYS: ClassVar[ArrayNames] = (
        (*PREDICT_ARGUMENTS, "principal_axes"),
        (*PREDICT_RESULTS, "compensating_torque", "bullet_pose", "endpoints", "step_status"),
    )


def create_compound_shape(boxes: Sequence[Shape], client: int) -> int:
    """Create a collision shape of boxes and convex pieces in Bullet and return its number."""
    is_piece = [isinstance(box, ConvexPiece) for box in boxes]
    centred = [
        (0.0, 0.0, 0.0) if piece else box.position
        for box, piece in zip(boxes, is_piece, strict=True)
    ]
    names = [mesh_file(box) if isinstance(box, ConvexPiece) else "" for box in boxes]
    number = pybullet.createCollisionShapeArray(
        [pybullet.GEOM_MESH if piece else pybullet.GEOM_BOX for piece in is_piece],
        halfExtents=[box.half_extents for box in boxes],
        collisionFramePositions=centred,
        collisionFrameOrientations=[box.orientation for box in boxes],
        **({"fileNames": names, "meshScales": [[1.0] * 3] * len(boxes)} if any(is_piece) else {}),
        physicsClientId=client,
    )
    return int(number)


def create_platform(client: int, platform: Platform) -> int:
    """Create a fixed box in Bullet and return the number of its body."""
    x, y, z = platform.size
    shape = create_compound_shape([Box((x / 2, y / 2, z / 2), (0.0, 0.0, 0.0))], client)
    number = pybullet.createMultiBody(0, shape, -1, platform.position, physicsClientId=client)
    set_dynamics(client, number, -1, platform.surface)
    return int(number)


def set_dynamics(
    client: int, number: int, link: int, surface: ContactSurface = DRY, body: Body | None = None
) -> None:
    """Set mass and inertia of `body`, friction and restitution, no damping and no sleeping for a Bullet body."""
    pybullet.changeDynamics(
        number,
        link,
        lateralFriction=surface.friction,
        restitution=surface.restitution,
        linearDamping=0,
        angularDamping=0,
        maxJointVelocity=_MAX_VELOCITY,
        activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )
    if body:  # in two calls: setting the mass overwrites the inertia
        pybullet.changeDynamics(number, link, mass=body.mass, physicsClientId=client)
        pybullet.changeDynamics(
            number, link, localInertiaDiagonal=body.inertia, physicsClientId=client
        )
