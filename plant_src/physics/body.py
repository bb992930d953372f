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

from ..vehicles.common.alarms import LARGEST_STATE
from ..vehicles.common.shapes import Body, Box
from .clearance import Enclosure
from .client import pybullet
from .compiled_equations import bound, load

if TYPE_CHECKING:
    from ..placement import Spawn
    from ..vehicles.model import Model

#: friction of every surface; Bullet multiplies those of the two bodies in contact
FRICTION = 1.0

#: bodies that do not take part stand in a row from here on (m), where no vehicle can be
PARKING, PARKING_SPACE, UPRIGHT = 2 * LARGEST_STATE, 100.0, (0.0, 0.0, 0.0, 1.0)

#: so fast a planar vessel may rise or sink in Bullet (m/s), and so far (m) before it is put back to its height
SINKING, LARGEST_HEAVE = 1e-4, 1e-9

_MAX_VELOCITY = 1e6  # Bullet limits velocities silently, by default at 100 m/s and rad/s
_LIFT = 2  # place of the vertical velocity in a motion
_LEAST_SLOPE = 0.01  # of sinking over lift: M / (m + M) for a load of the mass m
_write_vector = struct.Struct("3d").pack_into

Names = tuple[Sequence[str], Sequence[str]]  # of the arguments and of the results of a compiled function
_BEFORE = ("state", "inputs", "surroundings", "constants", "step", "anchor", "leash")


class UnsoundError(Exception):
    """A vehicle cannot go on: an input or its motion is not finite; the text names the variable."""


class Shadow:
    """One vehicle: its body in Bullet and its compiled equations (`vehicles/shadow_maps.py`).

    `pieces` are its numbers by name, as many as `sizes` says, and "step" (s), which all vehicles share. `inputs` and `outputs`
    hold the real variables of the model in order; the outputs after the published motion are left to others, and the piece
    "surroundings" is the environment's. `predict` foresees the `motion` that Bullet would measure and leaves what to tell Bullet,
    `twist` and `torque`; Bullet's motion takes the place of the one foreseen.
    """

    PIECES: ClassVar[Mapping[str, int]] = {"twist": 6, "motion": 6, "pose": 7}  # name -> size
    SPAWN: ClassVar[Names] = (("parameters",), ("constants", "predicted", "twist", "motion", "pose"))
    BEFORE: ClassVar[Names]
    AFTER: ClassVar[Names] = (("start", "predicted", "twist", "motion", "constants", "step"), ("state", "impulse", "outputs"))
    #: Bullet takes half as long, but its saved states lack the inertia of such a body in world axes
    IN_MAXIMAL_COORDINATES = False

    def __init__(self, client: int, spawn: Spawn, pieces: Mapping[str, np.ndarray]):
        self.name, self.model, self._client = spawn.name, spawn.model, client
        constants = spawn.model.constants if spawn.model.constants is not None else len(spawn.parameters)
        given = {"parameters": np.array(spawn.parameters), "axes": np.array(spawn.body.axes)}
        self._pieces = pieces = {**pieces, **given, "constants": np.zeros(constants)}
        pieces["surroundings"][:] = [variable.start for variable in spawn.model.surroundings]
        self.inputs, self.outputs = pieces["inputs"], pieces["outputs"]
        self.surroundings = pieces["surroundings"]
        # memoryviews: numpy takes longer for so few numbers
        self.motion: Any = pieces["motion"].data
        self.twist: Any = pieces["twist"].data
        self.torque: Any = pieces["torque"].data if "torque" in pieces else None
        library = load(spawn.model.name)
        #: where a free step leads
        self.predict = self._bound(library.shadow_before, self.BEFORE)
        #: take over what became of the step, and publish it
        self.correct = self._bound(library.shadow_after, self.AFTER)
        self._bound(library.shadow_spawn, self.SPAWN)()
        self.correct()
        self.body = self._create(spawn.body)
        self.go_back()

    @classmethod
    def sizes(cls, model: Model) -> dict[str, int]:
        """How many numbers a vehicle has in which pieces."""
        slots = {"inputs": len(model.slots("input")), "outputs": len(model.slots("output"))}
        slots["surroundings"] = len(model.surroundings)
        states = dict.fromkeys(("state", "start", "predicted"), len(model.states))
        return {**states, **cls.PIECES, **slots, "path": 6, "anchor": 3, "leash": 3, "alarm": 1, "impulse": 1}

    def _bound(self, function: Callable[..., None], names: Names) -> Callable[[], None]:
        arguments, results = ([self._pieces[name] for name in side] for side in names)
        return bound(function, arguments, results)

    def _create(self, body: Body) -> int:
        """Make the body in Bullet; returns its number."""
        shape, maximal = compound(body.boxes, self._client), self.IN_MAXIMAL_COORDINATES
        number = pybullet.createMultiBody(body.mass, shape, -1, useMaximalCoordinates=maximal, physicsClientId=self._client)
        set_dynamics(self._client, number, -1, body)
        return int(number)

    @staticmethod
    def enclosure(body: Body) -> Enclosure:
        """What holds the body in every attitude it can take."""
        radius = float(max(np.linalg.norm(box.corners(), axis=1).max() for box in body.boxes))
        return Enclosure((-radius, -radius, -radius), (radius, radius, radius))

    def go_back(self) -> None:
        """Return the body in Bullet to where the step began."""
        pose = self._pieces["pose"].tolist()
        pybullet.resetBasePositionAndOrientation(self.body, pose[0:3], pose[3:7], self._client)

    def engage(self, engaged: bool) -> None:
        """Let Bullet take part in the motion, or not any more."""
        if engaged:
            self.go_back()
        else:
            parked = [PARKING + PARKING_SPACE * self.body, 0.0, 0.0]
            pybullet.resetBasePositionAndOrientation(self.body, parked, UPRIGHT, self._client)

    def fault(self) -> str:
        """What keeps the vehicle from going on: an input that is not finite, or where the free step leads."""
        names = [*self.model.slots("input"), *(variable.name for variable in self.model.surroundings)]
        for name, value in zip(names, np.concatenate([self.inputs, self._pieces["surroundings"]]), strict=True):
            if not math.isfinite(value):
                return f"{self.name}.{name} is {value}, expected a finite number"
        predicted = self._pieces["predicted"]
        worst = int(np.argmax(np.nan_to_num(np.abs(predicted), nan=np.inf)))
        return f"{self.name}.{self.model.states[worst]} became {predicted[worst]:g}: the motion has exploded"


class FreeBody(Shadow):
    """A vehicle that moves freely in space; its frame in Bullet has the principal axes of inertia."""

    PIECES = {**Shadow.PIECES, "torque": 3}
    SPAWN: ClassVar[Names] = (("parameters", "axes"), Shadow.SPAWN[1])
    BEFORE: ClassVar[Names] = (
        (*_BEFORE, "axes"),
        ("start", "predicted", "twist", "motion", "torque", "pose", "path", "alarm"),
    )


class FloatingBody(Shadow):
    """A vessel that moves freely in space; the contact impulse of a step is carried over to the next one."""

    PIECES = {**Shadow.PIECES, "torque": 3, "carried": 6, "previous": 6}
    BEFORE = (
        (*_BEFORE, "carried"),
        ("start", "predicted", "twist", "motion", "torque", "pose", "previous", "path", "alarm"),
    )
    AFTER = ((*Shadow.AFTER[0], "previous"), (*Shadow.AFTER[1], "carried"))

    def surface(self, wave_count: int, waves: np.ndarray) -> Callable[[float], float]:
        """Return a function of time (s) for the height of the water (m, above still water) at the vessel.

        Args:
            wave_count: Number of wave components.
            waves: Their table, as `environment.sea.Sea.table` gives it.
        """
        place, height = np.zeros(3), np.zeros(1)
        count = np.full(1, float(wave_count))
        call = bound(load(self.model.name).shadow_surface, [place, count, waves], [height])
        where, found, here = place.data, height.data, self.outputs.data

        def elevation(time: float) -> float:
            _write_vector(where, 0, here[0], here[1], time)
            call()
            return found[0]

        return elevation


class PlanarBody(Shadow):
    """A vessel in the horizontal plane: it has no roll and no pitch, and what presses on its deck does not move it.

    Bullet can hold its height only by lifting it as much as the load lets it sink. The load foreseen is that of the steps before;
    where Bullet finds another one, the step is made again with a better lift, found by the secant method.
    """

    PIECES = {**Shadow.PIECES, "pressed": 3, "previous": 2}
    IN_MAXIMAL_COORDINATES = True  # the inertia about the world's z axis is always the same
    BEFORE = (
        (*_BEFORE, "pressed"),
        ("start", "predicted", "twist", "motion", "pose", "previous", "path", "alarm"),
    )
    AFTER = ((*Shadow.AFTER[0], "previous"), (*Shadow.AFTER[1], "pressed"))

    @staticmethod
    def enclosure(body: Body) -> Enclosure:
        corners = np.concatenate([box.corners() for box in body.boxes])
        radius = float(np.hypot(corners[:, 0], corners[:, 1]).max())
        low, high = float(corners[:, 2].min()), float(corners[:, 2].max())
        return Enclosure((-radius, -radius, low), (radius, radius, high))

    def _create(self, body: Body) -> int:
        self._previous: Any = self._pieces["previous"].data
        #: lift and sinking (m/s) at the last attempt
        self._tried = 0.0, 0.0
        never = 0.0  # Bullet's word for an infinite inertia
        return super()._create(body._replace(inertia=(never, never, body.inertia[2])))

    def held(self, repeats: int) -> bool:
        """Whether the step of Bullet can stay as it is after so many repeats; otherwise the twist has a better lift now."""
        lift, sinking = self.twist[_LIFT], -self.motion[_LIFT]
        (last_lift, last_sinking), self._tried = self._tried, (lift, sinking)
        if not SINKING < abs(sinking) < math.inf:
            return True
        slope = (last_sinking - sinking) / (lift - last_lift) if repeats and lift != last_lift else 1.0
        self.twist[_LIFT] = lift + sinking / min(max(slope, _LEAST_SLOPE), 1.0)
        return False

    def keep_height(self) -> None:
        """Before a step: undo what small heaves of the steps before have come to."""
        if abs(self._previous[1]) > LARGEST_HEAVE:
            self.go_back()
            self._previous[1] = 0.0


def body_class(model: Model) -> type[Shadow]:
    """Return the class of bodies that move as the vehicles of `model` do."""
    if model.motion == "planar":
        return PlanarBody
    return FloatingBody if model.is_vessel else FreeBody


def compound(boxes: Sequence[Box], client: int) -> int:
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
