"""Renderer for solids in a separate PyBullet client, drawn in memory by TinyRenderer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from ..physics.client import pybullet
from ..vehicles.common.shapes import Quaternion, Vector
from .cameras import FAR, NEAR, View, Window
from .parts import Part

SUN: Vector = (-0.45, -0.6, 0.66)  # direction to the sun, world axes
AMBIENT = DIFFUSE = 0.55  # coefficients of ambient light and of light from the sun


class Picture(NamedTuple):
    """Solids in a view.

    `colour`, uint8 (height, width, 3), and `depth` along the axis of the view (m), shape (height,
    width).

    The depth is infinite in pixels without a solid.
    """

    colour: np.ndarray
    depth: np.ndarray


class SolidRenderer:
    """Renderer of rigid objects made of parts.

    A context manager that disconnects its Bullet client at the end.

    Args:
        objects: Parts of each object, in the frame of the object.
    """

    def __init__(self, *objects: Sequence[Part]):
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self.objects = [[(self._create_body(part), part) for part in parts] for parts in objects]
        parts = [part for bodies in self.objects for _, part in bodies]
        self._centres = np.array([part.position for part in parts]).reshape(
            -1, 3
        )  # indexed by Bullet's body numbers 0, 1, ...
        self._bounding_radii = np.array([part.bounding_radius() for part in parts])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Disconnect the Bullet client; further calls have no effect."""
        if self.client >= 0:
            pybullet.disconnect(self.client)
            self.client = -1

    def _create_body(self, part: Part) -> int:
        sizes: dict[str, object]
        match part.shape:
            case "box":
                sizes = {
                    "shapeType": pybullet.GEOM_BOX,
                    "halfExtents": [edge / 2 for edge in part.size],
                }
            case "cylinder":
                sizes = {
                    "shapeType": pybullet.GEOM_CYLINDER,
                    "radius": part.size[0],
                    "length": part.size[1],
                }
            case "sphere":
                sizes = {"shapeType": pybullet.GEOM_SPHERE, "radius": part.size[0]}
            case "mesh":
                sizes = {"shapeType": pybullet.GEOM_MESH, **_triangles(part.size)}
        shape = pybullet.createVisualShape(
            **sizes, rgbaColor=[*part.colour, 1.0], physicsClientId=self.client
        )
        return int(
            pybullet.createMultiBody(
                baseVisualShapeIndex=shape,
                basePosition=part.position,
                baseOrientation=part.orientation,
                physicsClientId=self.client,
            )
        )

    def set_pose(self, index: int, position: Sequence[float], orientation: Quaternion) -> None:
        """Move object `index` to `position` (m, world) with `orientation` (x, y, z, w)."""
        for body, part in self.objects[index]:
            pose = pybullet.multiplyTransforms(
                position, orientation, part.position, part.orientation
            )
            pybullet.resetBasePositionAndOrientation(body, *pose, physicsClientId=self.client)
            self._centres[body] = pose[0]

    def render(self, view: View, width: int, height: int, shadow: bool = False) -> Picture:
        """Render a view.

        TinyRenderer draws only the window that contains solids, because its time grows with the
        number of pixels.

        Args:
            view: The view.
            width: Width of the picture (pixels).
            height: Height of the picture (pixels).
            shadow: True if solids cast shadows on each other.

        Returns:
            Colour and depth of the solids.
        """
        whole = Picture(
            np.zeros((height, width, 3), np.uint8), np.full((height, width), np.inf, np.float32)
        )
        window = view.bounding_window(self._centres, self._bounding_radii, width, height)
        if window.left < window.right and window.top < window.bottom:
            part = (slice(window.top, window.bottom), slice(window.left, window.right))
            whole.colour[part], whole.depth[part] = self._render_window(
                view, width, height, window, shadow
            )
        return whole

    def _render_window(
        self, view: View, width: int, height: int, window: Window, shadow: bool
    ) -> Picture:
        columns, rows = window.right - window.left, window.bottom - window.top
        _, _, colour, depth, body = pybullet.getCameraImage(
            columns,
            rows,
            view.matrix(),
            view.projection(width, height, window),
            lightDirection=SUN,
            lightDistance=60.0,
            lightAmbientCoeff=AMBIENT,
            lightDiffuseCoeff=DIFFUSE,
            lightSpecularCoeff=0.05,
            shadow=int(shadow),
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        solid = np.asarray(body).reshape(rows, columns) >= 0
        metres = np.full((rows, columns), np.inf, np.float32)
        metres[solid] = (
            FAR
            * NEAR
            / (FAR - (FAR - NEAR) * np.asarray(depth, np.float32).reshape(rows, columns)[solid])
        )
        return Picture(np.asarray(colour, np.uint8).reshape(rows, columns, 4)[..., :3], metres)


def _triangles(corners: Sequence[float]) -> dict[str, object]:
    """Return vertices, vertex numbers and normals of a mesh.

    Its triangles are seen from both sides.
    """
    triangles = np.reshape(corners, (-1, 3, 3))
    both = np.concatenate([triangles, triangles[:, ::-1]])
    normals = np.cross(both[:, 1] - both[:, 0], both[:, 2] - both[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    return {
        "vertices": both.reshape(-1, 3).tolist(),
        "indices": list(range(3 * len(both))),
        "normals": np.repeat(normals, 3, axis=0).tolist(),
    }
