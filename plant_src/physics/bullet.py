"""PyBullet: its import, clients, collision shapes, contact properties, and fixed bodies.

The import suppresses the build date that PyBullet writes to the standard error stream. Bullet reads
the meshes of a compound shape from files, so convex pieces are written to the cache.
"""

from __future__ import annotations

import os
import weakref
from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from types import ModuleType
from typing import NamedTuple

import numpy as np

from cosim.core import resources
from cosim.results.files import writing_atomically

from ..placement import DRY, ContactSurface, Obstacle, Platform
from ..vehicles.common.shapes import Body, Box, ConvexPiece, Shape, outermost_points
from .clearance import BoundingBox

_STANDARD_ERROR = 2

_MISSING = (
    "PyBullet is not installed, and the world needs it; use Python 3.11 to 3.13, for which wheels "
    "exist, "
    'build it with `pip install pybullet`, or replace the world by a plant FMU ("fmu" for "python")'
)


def _import_without_stderr() -> ModuleType:
    """Return the module `pybullet`.

    Raises:
        ModuleNotFoundError: If PyBullet is not installed; the message names the ways out.
    """
    saved, null = os.dup(_STANDARD_ERROR), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, _STANDARD_ERROR)
    try:
        import pybullet
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(_MISSING, name="pybullet") from error
    finally:
        os.dup2(saved, _STANDARD_ERROR)
        os.close(saved)
        os.close(null)
    module: ModuleType = pybullet
    return module


pybullet = _import_without_stderr()

#: parameters of a new client, some of which a reset keeps; the order of pairs must not depend on
#: their history
_ENGINE_PARAMETERS = {
    "fixedTimeStep": 1 / 240,
    "numSubSteps": 0,
    "deterministicOverlappingPairs": 1,
}


#: largest number of bodies for the exact broad phase, whose time grows with its square
MAX_EXACT_BODIES = 100


class _SpareClient(NamedTuple):
    """Connected client without owner; the flags of its broad phase, or None if it must be reset."""

    number: int
    flags: int | None


#: connected clients without owner; at most one is kept
_spare_clients: list[_SpareClient] = []


def connect(owner: object, body_count: int = 0) -> tuple[int, weakref.finalize[[int], object]]:
    """Connect a Bullet client, or take the spare one.

    The client holds 60 MB that Python's garbage collector does not count, so it is also released
    when `owner` is collected.

    Args:
        owner: Object for which the client is connected.
        body_count: Number of bodies that it will get.

    Returns:
        Number of the client, which has no bodies, and a function without arguments that releases it
        once.
    """
    client = _take_client(_broad_phase(body_count))
    release = weakref.finalize(owner, _release, client)
    release.atexit = False
    return client, release


def _broad_phase(body_count: int) -> int:
    """Return the flags of a reset for a number of bodies.

    Bullet's default keeps pairs of bodies that are apart for some steps. They join islands, and
    saved states do not contain them.
    """
    return int(pybullet.RESET_USE_SIMPLE_BROADPHASE) if body_count <= MAX_EXACT_BODIES else 0


def _take_client(flags: int) -> int:
    """Return an empty client: a reset takes 1 ms, a connection 5 to 10 ms."""
    client, present = (
        _spare_clients.pop()
        if _spare_clients
        else _SpareClient(int(pybullet.connect(pybullet.DIRECT)), None)
    )
    if present != flags:
        pybullet.resetSimulation(flags, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(**_ENGINE_PARAMETERS, physicsClientId=client)
    return client


def _release(client: int) -> None:
    """Keep one client for the next owner, who resets it, because most processes end before.

    Disconnect the others.
    """
    if _spare_clients:
        pybullet.disconnect(client)
    else:
        _spare_clients.append(_SpareClient(client, None))


def preconnect() -> None:
    """Connect a Bullet client that forked processes inherit; this saves most of 25 ms per run."""
    flags = _broad_phase(0)
    _spare_clients.append(_SpareClient(_take_client(flags), flags))


_MAX_VELOCITY = 1e6  # m/s, rad/s; Bullet silently limits velocities to 100 by default


def mesh_file(piece: ConvexPiece) -> str:
    """Return the path of an OBJ file in the user's cache directory, whose convex hull is the piece.

    Bullet uses the vertices only; the faces make it read them.
    """
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in piece.points]
    lines += [f"f 1 {number} {number + 1}" for number in range(2, len(piece.points))]
    content = "\n".join([*lines, ""]).encode()
    path = resources.cache_directory() / "meshes" / f"{sha256(content).hexdigest()[:20]}.obj"
    if not path.exists():
        with writing_atomically(path) as temporary:
            temporary.write_bytes(content)
    return str(path)


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
    """Set mass and inertia of `body`, friction and restitution of a body in Bullet.

    It has no damping and never sleeps.
    """
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


class FixedBodies(NamedTuple):
    """Fixed bodies.

    Attributes:
        paths: Path in the arguments of the world by the number in Bullet, for example
            "platforms.start".
        names: Name by the number in Bullet.
        boxes: Bounding boxes of platforms and of the parts of obstacles.
    """

    paths: dict[int, str]
    names: Mapping[int, str]
    boxes: Sequence[BoundingBox]


def create_fixed_bodies(
    client: int, platforms: Sequence[Platform], obstacles: Sequence[Obstacle]
) -> FixedBodies:
    """Create all platforms and obstacles in Bullet."""
    bodies = {
        create_platform(client, platform): f"platforms.{platform.name}" for platform in platforms
    }
    for obstacle in obstacles:
        for shape in _shapes(client, obstacle):
            number = pybullet.createMultiBody(0, shape, -1, physicsClientId=client)
            set_dynamics(client, number, -1, obstacle.surface)
            bodies[int(number)] = f"obstacles.{obstacle.name}"
    names = {number: path.partition(".")[2] for number, path in bodies.items()}
    return FixedBodies(bodies, names, _bounding_boxes(platforms, obstacles))


def _shapes(client: int, obstacle: Obstacle) -> Iterator[int]:
    """Create the collision shapes of an obstacle.

    A convex hull for each part, or one of all triangles.
    """
    if obstacle.is_convex:
        for part in obstacle.parts:
            points = outermost_points(np.unique(part.reshape(-1, 3), axis=0))
            yield create_compound_shape([ConvexPiece(tuple(map(tuple, points.tolist())))], client)
        return
    vertices, faces = np.unique(obstacle.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    yield int(
        pybullet.createCollisionShape(
            pybullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=faces.ravel().tolist(),
            flags=pybullet.GEOM_FORCE_CONCAVE_TRIMESH,
            physicsClientId=client,
        )
    )


def _bounding_boxes(
    platforms: Sequence[Platform], obstacles: Sequence[Obstacle]
) -> list[BoundingBox]:
    boxes = []
    for platform in platforms:
        x, y, z = platform.position
        half_x, half_y, half_z = (edge / 2 for edge in platform.size)
        low, high = (x - half_x, y - half_y, z - half_z), (x + half_x, y + half_y, z + half_z)
        boxes.append(BoundingBox(low, high))
    parts = [part.reshape(-1, 3) for obstacle in obstacles for part in obstacle.parts]
    return boxes + [
        BoundingBox(tuple(part.min(axis=0).tolist()), tuple(part.max(axis=0).tolist()))
        for part in parts
    ]
