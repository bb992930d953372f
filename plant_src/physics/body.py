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
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..placement import DRY, ContactSurface
from ..vehicles.common.interface import MAX_STATE_NORM
from ..vehicles.common.shapes import Body, Box, ConvexPiece, Shape
from .clearance import BoundingBox
from .client import pybullet
from .convex_pieces import mesh_file

if TYPE_CHECKING:
    from ..placement import Platform, VehiclePlacement
    from ..vehicles.model import Model
    from .compiled_equations import CompiledEquations

#: first x coordinate of inactive bodies (m), beyond the reach of any vehicle, and distance between
#: them (m)
INACTIVE_POSITION, INACTIVE_SPACING = 2 * MAX_STATE_NORM, 100.0
IDENTITY_QUATERNION = (0.0, 0.0, 0.0, 1.0)

_MAX_VELOCITY = 1e6  # m/s, rad/s; Bullet silently limits velocities to 100 by default

#: arrays of the compiled equations that are no state of a vehicle, or a part of another array
_FIXED_ARRAYS = ("constants", "principal_axes", "step_size", "motion")


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
        equations: Its compiled equations.
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

    #: maximal coordinates halve Bullet's time, but its saved states lack the inertia of such a body
    #: in world axes
    USE_MAXIMAL_COORDINATES = False

    def __init__(
        self,
        client: int,
        vehicle: VehiclePlacement,
        equations: CompiledEquations,
        arrays: Mapping[str, np.ndarray],
    ):
        """Create the body in Bullet and initialize the equations.

        Args:
            client: Number of the Bullet client.
            vehicle: Vehicle to create.
            equations: Compiled equations of its model.
            arrays: Arrays of the sizes that `state_sizes` returns, and "step_size" (s), which all
                vehicles share.
        """
        self.name, self.model, self._client = vehicle.name, vehicle.model, client
        self.equations = equations
        self._arrays = arrays = {
            **arrays,
            "parameters": np.array(vehicle.model.equation_parameters(vehicle.parameters)),
            "principal_axes": np.array(vehicle.body.axes),
            "constants": np.zeros(equations.sizes["constants"]),
            "motion": arrays["outputs"][: equations.sizes["motion"]],
        }
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
        self.predict = equations.bind("contact_predict", arrays)
        self.correct = equations.bind("contact_correct", arrays)
        equations.bind("contact_initialize", arrays)()
        self.correct()
        self.body_id = self._create_body(vehicle)
        self.reset_pose()

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


def state_sizes(model: Model, equations: CompiledEquations) -> dict[str, int]:
    """Return the arrays that hold the state of a vehicle in a world, as name to size."""
    functions = equations.functions
    sizes = functions["contact_predict"].sizes | functions["contact_correct"].sizes
    own = {name: size for name, size in sizes.items() if name not in _FIXED_ARRAYS}
    return own | {"outputs": len(model.slots("output"))}


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
