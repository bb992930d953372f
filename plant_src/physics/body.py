"""The shadow scheme: vehicles move by their own compiled equations, and Bullet resolves contact.

For each step the equations say where a vehicle would be after it if nothing were in the way. A rigid body moved with the
constant mean motion of the step arrives exactly there, so this is the velocity that Bullet is given, instead of forces.
Contact makes Bullet change it; the change is the contact impulse, which the equations take over, and the pose to which the
changed motion leads. Gravity is part of the equations and zero in Bullet.

Where nothing can be in the way there is nothing to ask, because what Bullet would answer is known: Bullet takes part only for
vehicles that are near something (`clearance.py`). The bodies of the others are parked meanwhile.

A step of the world is `predict` for every vehicle, then one step of Bullet for those near something, and at last `correct` for
every vehicle.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..vehicles.common.alarms import MAX_STATE_NORM
from ..vehicles.common.shapes import Body, Box
from .clearance import BoundingBox
from .client import pybullet
from .compiled_equations import bind_arrays, load_library

if TYPE_CHECKING:
    from ..placement import VehiclePlacement
    from ..vehicles.model import Model

#: friction of every surface; Bullet multiplies those of the two bodies in contact
FRICTION = 1.0

#: bodies that do not take part stand in a row from here on (m), where no vehicle can be
INACTIVE_POSITION, INACTIVE_SPACING, IDENTITY_QUATERNION = 2 * MAX_STATE_NORM, 100.0, (0.0, 0.0, 0.0, 1.0)

#: so fast a planar vessel may rise or sink in Bullet (m/s), and so far (m) before it is put back to its height
MAX_SINK_RATE, MAX_HEAVE = 1e-4, 1e-9

_MAX_VELOCITY = 1e6  # Bullet limits velocities silently, by default at 100 m/s and rad/s
_VERTICAL_VELOCITY = 2  # place of the vertical velocity in a motion
_MIN_SLOPE = 0.01  # of sinking over lift: M / (m + M) for a load of the mass m
_pack_vector = struct.Struct("3d").pack_into

ArrayNames = tuple[Sequence[str], Sequence[str]]  # of the arguments and of the results of a compiled function
_PREDICT_ARGUMENTS = ("state", "inputs", "surroundings", "constants", "step", "anchor", "leash")


class InvalidStateError(Exception):
    """A vehicle cannot go on: an input or its motion is not finite; the text names the variable."""


class ContactBody:
    """One vehicle: its body in Bullet and its compiled equations (`vehicles/shadow_maps.py`).

    `pieces` are its numbers by name, as many as `sizes` says, and "step" (s), which all vehicles share. `inputs` and `outputs`
    hold the real variables of the model in order; the outputs after the published motion are left to others, and the piece
    "surroundings" is the environment's. `predict` foresees the `motion` that Bullet would measure and leaves what to tell Bullet,
    `twist` and `torque`; Bullet's motion takes the place of the one foreseen.
    """

    ARRAY_SIZES: ClassVar[Mapping[str, int]] = {"twist": 6, "motion": 6, "pose": 7}  # name -> size
    INITIALIZE_ARRAYS: ClassVar[ArrayNames] = (("parameters",), ("constants", "predicted", "twist", "motion", "pose"))
    PREDICT_ARRAYS: ClassVar[ArrayNames]
    CORRECT_ARRAYS: ClassVar[ArrayNames] = (
        ("start", "predicted", "twist", "motion", "constants", "step"),
        ("state", "impulse", "outputs"),
    )
    #: Bullet takes half as long, but its saved states lack the inertia of such a body in world axes
    USE_MAXIMAL_COORDINATES = False

    def __init__(self, client: int, spawn: VehiclePlacement, arrays: Mapping[str, np.ndarray]):
        self.name, self.model, self._client = spawn.name, spawn.model, client
        constants = spawn.model.constant_count if spawn.model.constant_count is not None else len(spawn.parameters)
        given = {"parameters": np.array(spawn.parameters), "axes": np.array(spawn.body.axes)}
        self._arrays = arrays = {**arrays, **given, "constants": np.zeros(constants)}
        arrays["surroundings"][:] = [variable.start for variable in spawn.model.environment_inputs]
        self.inputs, self.outputs = arrays["inputs"], arrays["outputs"]
        self.environment_inputs = arrays["surroundings"]
        # memoryviews: numpy takes longer for so few numbers
        self.bullet_twist: Any = arrays["motion"].data
        self.twist: Any = arrays["twist"].data
        self.torque: Any = arrays["torque"].data if "torque" in arrays else None
        library = load_library(spawn.model.name)
        #: where a free step leads
        self.predict = self._bind(library.shadow_before, self.PREDICT_ARRAYS)
        #: take over what became of the step, and publish it
        self.correct = self._bind(library.shadow_after, self.CORRECT_ARRAYS)
        self._bind(library.shadow_spawn, self.INITIALIZE_ARRAYS)()
        self.correct()
        self.body_id = self._create_body(spawn.body)
        self.reset_pose()

    @classmethod
    def array_sizes(cls, model: Model) -> dict[str, int]:
        """How many numbers a vehicle has in which pieces."""
        slots = {"inputs": len(model.slots("input")), "outputs": len(model.slots("output"))}
        slots["surroundings"] = len(model.environment_inputs)
        states = dict.fromkeys(("state", "start", "predicted"), len(model.states))
        return {**states, **cls.ARRAY_SIZES, **slots, "path": 6, "anchor": 3, "leash": 3, "alarm": 1, "impulse": 1}

    def _bind(self, function: Callable[..., None], names: ArrayNames) -> Callable[[], None]:
        arguments, results = ([self._arrays[name] for name in side] for side in names)
        return bind_arrays(function, arguments, results)

    def _create_body(self, body: Body) -> int:
        """Make the body in Bullet; returns its number."""
        shape, maximal = create_compound_shape(body.boxes, self._client), self.USE_MAXIMAL_COORDINATES
        number = pybullet.createMultiBody(body.mass, shape, -1, useMaximalCoordinates=maximal, physicsClientId=self._client)
        set_dynamics(self._client, number, -1, body)
        return int(number)

    @staticmethod
    def bounding_box(body: Body) -> BoundingBox:
        """What holds the body in every attitude it can take."""
        radius = float(max(np.linalg.norm(box.corners(), axis=1).max() for box in body.boxes))
        return BoundingBox((-radius, -radius, -radius), (radius, radius, radius))

    def reset_pose(self) -> None:
        """Return the body in Bullet to where the step began."""
        pose = self._arrays["pose"].tolist()
        pybullet.resetBasePositionAndOrientation(self.body_id, pose[0:3], pose[3:7], self._client)

    def set_active(self, active: bool) -> None:
        """Let Bullet take part in the motion, or not any more."""
        if active:
            self.reset_pose()
        else:
            parked = [INACTIVE_POSITION + INACTIVE_SPACING * self.body_id, 0.0, 0.0]
            pybullet.resetBasePositionAndOrientation(self.body_id, parked, IDENTITY_QUATERNION, self._client)

    def describe_invalid_state(self) -> str:
        """What keeps the vehicle from going on: an input that is not finite, or where the free step leads."""
        names = [*self.model.slots("input"), *(variable.name for variable in self.model.environment_inputs)]
        for name, value in zip(names, np.concatenate([self.inputs, self._arrays["surroundings"]]), strict=True):
            if not math.isfinite(value):
                return f"{self.name}.{name} is {value}, expected a finite number"
        predicted = self._arrays["predicted"]
        worst = int(np.argmax(np.nan_to_num(np.abs(predicted), nan=np.inf)))
        return f"{self.name}.{self.model.states[worst]} became {predicted[worst]:g}: the motion has exploded"


class FreeBody(ContactBody):
    """A vehicle that moves freely in space; its frame in Bullet has the principal axes of inertia."""

    ARRAY_SIZES = {**ContactBody.ARRAY_SIZES, "torque": 3}
    INITIALIZE_ARRAYS: ClassVar[ArrayNames] = (("parameters", "axes"), ContactBody.INITIALIZE_ARRAYS[1])
    PREDICT_ARRAYS: ClassVar[ArrayNames] = (
        (*_PREDICT_ARGUMENTS, "axes"),
        ("start", "predicted", "twist", "motion", "torque", "pose", "path", "alarm"),
    )


class FloatingBody(ContactBody):
    """A vessel that moves freely in space; the contact impulse of a step is carried over to the next one."""

    ARRAY_SIZES = {**ContactBody.ARRAY_SIZES, "torque": 3, "carried": 6, "previous": 6}
    PREDICT_ARRAYS = (
        (*_PREDICT_ARGUMENTS, "carried"),
        ("start", "predicted", "twist", "motion", "torque", "pose", "previous", "path", "alarm"),
    )
    CORRECT_ARRAYS = ((*ContactBody.CORRECT_ARRAYS[0], "previous"), (*ContactBody.CORRECT_ARRAYS[1], "carried"))

    def elevation_function(self, wave_count: int, waves: np.ndarray) -> Callable[[float], float]:
        """Return a function of time (s) for the height of the water (m, above still water) at the vessel.

        Args:
            wave_count: Number of wave components.
            waves: Their table, as `environment.sea.Sea.table` gives it.
        """
        place, height = np.zeros(3), np.zeros(1)
        count = np.full(1, float(wave_count))
        call = bind_arrays(load_library(self.model.name).shadow_surface, [place, count, waves], [height])
        where, found, here = place.data, height.data, self.outputs.data

        def elevation(time: float) -> float:
            _pack_vector(where, 0, here[0], here[1], time)
            call()
            return found[0]

        return elevation


class PlanarBody(ContactBody):
    """A vessel in the horizontal plane: it has no roll and no pitch, and what presses on its deck does not move it.

    Bullet can hold its height only by lifting it as much as the load lets it sink. The load foreseen is that of the steps before;
    where Bullet finds another one, the step is made again with a better lift, found by the secant method.
    """

    ARRAY_SIZES = {**ContactBody.ARRAY_SIZES, "pressed": 3, "previous": 2}
    USE_MAXIMAL_COORDINATES = True  # the inertia about the world's z axis is always the same
    PREDICT_ARRAYS = (
        (*_PREDICT_ARGUMENTS, "pressed"),
        ("start", "predicted", "twist", "motion", "pose", "previous", "path", "alarm"),
    )
    CORRECT_ARRAYS = ((*ContactBody.CORRECT_ARRAYS[0], "previous"), (*ContactBody.CORRECT_ARRAYS[1], "pressed"))

    @staticmethod
    def bounding_box(body: Body) -> BoundingBox:
        corners = np.concatenate([box.corners() for box in body.boxes])
        radius = float(np.hypot(corners[:, 0], corners[:, 1]).max())
        low, high = float(corners[:, 2].min()), float(corners[:, 2].max())
        return BoundingBox((-radius, -radius, low), (radius, radius, high))

    def _create_body(self, body: Body) -> int:
        self._previous: Any = self._arrays["previous"].data
        #: lift and sinking (m/s) at the last attempt
        self._last_attempt = 0.0, 0.0
        never = 0.0  # Bullet's word for an infinite inertia
        return super()._create_body(body._replace(inertia=(never, never, body.inertia[2])))

    def height_converged(self, repeats: int) -> bool:
        """Whether the step of Bullet can stay as it is after so many repeats; otherwise the twist has a better lift now."""
        lift, sinking = self.twist[_VERTICAL_VELOCITY], -self.bullet_twist[_VERTICAL_VELOCITY]
        (last_lift, last_sinking), self._last_attempt = self._last_attempt, (lift, sinking)
        if not MAX_SINK_RATE < abs(sinking) < math.inf:
            return True
        slope = (last_sinking - sinking) / (lift - last_lift) if repeats and lift != last_lift else 1.0
        self.twist[_VERTICAL_VELOCITY] = lift + sinking / min(max(slope, _MIN_SLOPE), 1.0)
        return False

    def reset_height(self) -> None:
        """Before a step: undo what small heaves of the steps before have come to."""
        if abs(self._previous[1]) > MAX_HEAVE:
            self.reset_pose()
            self._previous[1] = 0.0


def body_class(model: Model) -> type[ContactBody]:
    """Return the class of bodies that move as the vehicles of `model` do."""
    if model.motion == "planar":
        return PlanarBody
    return FloatingBody if model.is_vessel else FreeBody


def create_compound_shape(boxes: Sequence[Box], client: int) -> int:
    """A collision shape made of boxes."""
    return pybullet.createCollisionShapeArray(
        [pybullet.GEOM_BOX] * len(boxes),
        halfExtents=[box.half_extents for box in boxes],
        collisionFramePositions=[box.position for box in boxes],
        collisionFrameOrientations=[box.orientation for box in boxes],
        physicsClientId=client,
    )


def set_dynamics(client: int, number: int, link: int, body: Body | None = None) -> None:
    """No damping, no sleep, the common friction, no restitution; mass and inertia of `body`."""
    pybullet.changeDynamics(
        number,
        link,
        lateralFriction=FRICTION,
        restitution=0,
        linearDamping=0,
        angularDamping=0,
        maxJointVelocity=_MAX_VELOCITY,
        activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
        physicsClientId=client,
    )
    if body:  # in two calls: setting the mass makes Bullet compute an inertia of its own
        pybullet.changeDynamics(number, link, mass=body.mass, physicsClientId=client)
        pybullet.changeDynamics(number, link, localInertiaDiagonal=body.inertia, physicsClientId=client)
