"""The shadow scheme: vehicles move by their own compiled equations, and Bullet resolves contact.

For each step the equations say where a vehicle would be after it if nothing were in the way. A rigid body moved with the
constant mean motion of the step arrives exactly there, so this is the velocity that Bullet is given, instead of forces.
Contact makes Bullet change it; the change is the contact impulse, which the equations take over. The pose belongs to Bullet,
because contact may change it; the velocity belongs to the vehicle. Gravity is part of the equations and zero in Bullet.

A step of the world is `predict` and then `push` for every vehicle, one step of Bullet, and `correct` for every vehicle.
"""

from __future__ import annotations

import ctypes
import math
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from .binary import bound, load
from .bullet import pybullet
from .vehicles.shapes import Body, Box

if TYPE_CHECKING:
    from .catalogue import Model

#: a state beyond this (m, m/s, rad/s) is an explosion
LARGEST_STATE = 1e5

#: friction of every surface; Bullet multiplies those of the two bodies in contact
FRICTION = 1.0

_MAX_VELOCITY = 1e6  # Bullet limits velocities silently, by default at 100 m/s and rad/s
_DOUBLE = struct.calcsize("d")
_vector = struct.Struct("3d").unpack_from
_write_body = struct.Struct("13d").pack_into
_write_joints = struct.Struct("6d").pack_into

Names = tuple[Sequence[str], Sequence[str]]  # of the arguments and of the results of a compiled function


class UnsoundError(Exception):
    """A vehicle cannot go on: an input or its motion is not finite; the text names the variable."""


class Shadow(ABC):
    """One vehicle: its body in Bullet and its compiled equations (`vehicles/shadow_maps.py`).

    All its numbers lie in one block, `memory`, in named pieces: a copy of it is a snapshot. `inputs` and `outputs` hold the
    real variables of the model in order; the outputs after the published motion are left to others. `step` (s) is shared.
    """

    PIECES: ClassVar[Mapping[str, int]]  # name -> size
    BEFORE: ClassVar[Names]
    AFTER: ClassVar[Names]

    def __init__(self, client: int, name: str, model: Model, initial: Sequence[float], step: np.ndarray):
        self.name, self.model, self._client = name, model, client
        self._sizes = {**self.PIECES, "inputs": len(model.slots("input")), "outputs": len(model.slots("output"))}
        self.memory = bytearray(_DOUBLE * sum(self._sizes.values()))
        self._arrays = {**self._pieces(), "step": step, "initial": np.array(initial, np.float64)}
        self.inputs, self.outputs = self._arrays["inputs"], self._arrays["outputs"]
        library = load(model.name)
        self._before = self._bound(library.shadow_before, self.BEFORE)
        self._after = self._bound(library.shadow_after, self.AFTER)
        self._soundness = ctypes.c_double.from_buffer(self.memory, self._place("soundness"))
        self._impulse = ctypes.c_double.from_buffer(self.memory, self._place("impulse"))
        self._bound(library.shadow_spawn, (("initial",), ("measured", "predicted")))()
        self.body = self._create(model.body, self._arrays["measured"].tolist())
        self._start()

    def _pieces(self) -> dict[str, np.ndarray]:
        return {name: np.frombuffer(self.memory, np.float64, n, self._place(name)) for name, n in self._sizes.items()}

    def _place(self, piece: str) -> int:
        """Where a piece begins in the memory, in bytes."""
        names = list(self._sizes)
        return _DOUBLE * sum(self._sizes[name] for name in names[: names.index(piece)])

    def _bound(self, function: Callable[..., None], names: Names) -> Callable[[], None]:
        arguments, results = ([self._arrays[name] for name in side] for side in names)
        return bound(function, arguments, results)

    def _start(self) -> None:
        """Publish the initial values, as if a free step had led to them."""
        self._measure()
        twist = self._arrays["twist"]
        twist[:] = self._arrays["measured"][-len(twist) :]
        self._after()

    def predict(self) -> None:
        """Where a free step leads. Raises UnsoundError when an input or that is not finite; nothing has moved then."""
        self._before()
        if not self._soundness.value < LARGEST_STATE:
            raise UnsoundError(self._fault())

    @abstractmethod
    def push(self) -> None:
        """Give Bullet the mean motion of the step."""

    def correct(self) -> bool:
        """Take over what Bullet made of the step, and publish. Returns whether there was contact; may raise UnsoundError."""
        self._measure()
        self._after()
        impulse = self._impulse.value
        if impulse == 0.0:
            return False
        if math.isnan(impulse):
            raise UnsoundError(f"{self.name}: the contact forces are not finite")
        return True

    @abstractmethod
    def _measure(self) -> None:
        """Read pose and velocity from Bullet."""

    @abstractmethod
    def _create(self, body: Body, measured: Sequence[float]) -> int:
        """Make the body in Bullet, with the pose and velocity it has to measure; returns its number."""

    def _fault(self) -> str:
        for name, value in zip(self.model.slots("input"), self.inputs, strict=True):
            if not math.isfinite(value):
                return f"{self.name}.{name} is {value}, expected a finite number"
        sizes = np.nan_to_num(np.abs(self._arrays["predicted"]), nan=np.inf)
        worst = int(np.argmax(sizes))
        return f"{self.name}.{self.model.states[worst]} became {self._arrays['predicted'][worst]:g}: the motion has exploded"


class FreeBody(Shadow):
    """A vehicle that moves freely in space; its frame in Bullet has the principal axes of inertia."""

    PIECES = {
        "measured": 13,
        "velocity": 6,
        "predicted": 13,
        "twist": 6,
        "torque": 3,
        "start": 4,
        "soundness": 1,
        "impulse": 1,
    }
    BEFORE = (("measured", "velocity", "inputs", "step"), ("predicted", "twist", "torque", "start", "soundness"))
    AFTER = (("measured", "predicted", "twist", "start"), ("velocity", "impulse", "outputs"))

    def _create(self, body: Body, measured: Sequence[float]) -> int:
        number = pybullet.createMultiBody(
            body.mass, compound(body.boxes, self._client), -1, measured[0:3], measured[3:7], physicsClientId=self._client
        )
        set_dynamics(self._client, number, -1, body)
        self._linear = self._place("twist")
        self._angular, self._torque = self._linear + 3 * _DOUBLE, self._place("torque")
        return number

    def push(self) -> None:
        memory, client = self.memory, self._client
        pybullet.resetBaseVelocity(self.body, _vector(memory, self._linear), _vector(memory, self._angular), client)
        pybullet.applyExternalTorque(self.body, -1, _vector(memory, self._torque), pybullet.WORLD_FRAME, client)

    def _measure(self) -> None:
        position, orientation = pybullet.getBasePositionAndOrientation(self.body, self._client)
        linear, angular = pybullet.getBaseVelocity(self.body, self._client)
        _write_body(self.memory, 0, *position, *orientation, *linear, *angular)


class PlanarChain(Shadow):
    """A vessel in the horizontal plane: a chain of joints x, y and yaw with massless links, so that only the hull has inertia.

    The joints carry heave, roll and pitch; loads in these directions have no effect.
    """

    PIECES = {"measured": 6, "velocity": 3, "predicted": 6, "twist": 3, "effort": 3, "soundness": 1, "impulse": 1}
    BEFORE = (("measured", "velocity", "inputs", "step"), ("predicted", "twist", "effort", "soundness"))
    AFTER = (("measured", "predicted", "twist"), ("velocity", "impulse", "outputs"))
    _JOINTS = (0, 1, 2)

    def _create(self, body: Body, measured: Sequence[float]) -> int:
        number = self._create_chain(body)
        for joint in self._JOINTS:
            options = {"physicsClientId": self._client}
            pybullet.setJointMotorControl2(number, joint, pybullet.VELOCITY_CONTROL, force=0, **options)
            pybullet.resetJointState(number, joint, measured[joint], measured[3 + joint], **options)
            pybullet.changeDynamics(number, joint, jointDamping=0, **options)
        for joint in (-1, *self._JOINTS[:2]):
            set_dynamics(self._client, number, joint)
        set_dynamics(self._client, number, self._JOINTS[2], body)
        self._effort = self._place("effort")
        return number

    def _create_chain(self, body: Body) -> int:
        origin, upright = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]
        return pybullet.createMultiBody(
            0,
            -1,
            -1,
            [0.0, 0.0, body.height],
            upright,
            linkMasses=[0, 0, body.mass],
            linkCollisionShapeIndices=[-1, -1, compound(body.boxes, self._client)],
            linkVisualShapeIndices=[-1] * 3,
            linkPositions=[origin] * 3,
            linkOrientations=[upright] * 3,
            linkInertialFramePositions=[origin] * 3,
            linkInertialFrameOrientations=[upright] * 3,
            linkParentIndices=[0, 1, 2],
            linkJointTypes=[pybullet.JOINT_PRISMATIC, pybullet.JOINT_PRISMATIC, pybullet.JOINT_REVOLUTE],
            linkJointAxis=[[1, 0, 0], [0, 1, 0], [0, 0, 1]],
            physicsClientId=self._client,
        )

    def push(self) -> None:
        pybullet.setJointMotorControlArray(
            self.body,
            self._JOINTS,
            pybullet.TORQUE_CONTROL,
            forces=_vector(self.memory, self._effort),
            physicsClientId=self._client,
        )

    def _measure(self) -> None:
        x, y, yaw = pybullet.getJointStates(self.body, self._JOINTS, self._client)
        _write_joints(self.memory, 0, x[0], y[0], yaw[0], x[1], y[1], yaw[1])


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
    """No damping, the common friction, no restitution; mass and inertia of `body`."""
    pybullet.changeDynamics(
        number,
        link,
        lateralFriction=FRICTION,
        restitution=0,
        linearDamping=0,
        angularDamping=0,
        maxJointVelocity=_MAX_VELOCITY,
        physicsClientId=client,
    )
    if body:  # in two calls: setting the mass makes Bullet compute an inertia of its own
        pybullet.changeDynamics(number, link, mass=body.mass, physicsClientId=client)
        pybullet.changeDynamics(number, link, localInertiaDiagonal=body.inertia, physicsClientId=client)
