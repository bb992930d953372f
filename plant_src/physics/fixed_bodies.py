"""Fixed bodies of a world in Bullet: platforms and obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..obstacles import Obstacle
from ..placement import Platform
from ..vehicles.common.shapes import ConvexPiece, outermost_points
from .body import create_compound_shape, create_platform, set_dynamics
from .clearance import BoundingBox
from .client import pybullet


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
    boxes = [_platform_bounding_box(platform) for platform in platforms]
    parts = [part.reshape(-1, 3) for obstacle in obstacles for part in obstacle.parts]
    return boxes + [
        BoundingBox(tuple(part.min(axis=0).tolist()), tuple(part.max(axis=0).tolist()))
        for part in parts
    ]


def _platform_bounding_box(platform: Platform) -> BoundingBox:
    x, y, z = platform.position
    half_x, half_y, half_z = (edge / 2 for edge in platform.size)
    return BoundingBox((x - half_x, y - half_y, z - half_z), (x + half_x, y + half_y, z + half_z))
