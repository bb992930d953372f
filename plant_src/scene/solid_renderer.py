"""Views, and a renderer of solids in a separate PyBullet client.

TinyRenderer, the software renderer of Bullet, draws in memory: it needs no display or graphics
card. It transforms, clips and shades triangles one after the other, so its time grows with the
number of pixels and triangles. Sky, water and land are therefore computed in NumPy
(`landscape.py`), and only the window around the solids is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import NamedTuple, Self

import numpy as np

from ..physics.bullet import pybullet
from ..vehicles.common.shapes import BODY_UP, Quaternion, Vector
from .parts import Part

NEAR, FAR = 0.4, 900.0  # m, clipping planes

SUN: Vector = (-0.45, -0.6, 0.66)  # direction to the sun, world axes
AMBIENT = DIFFUSE = 0.55  # coefficients of ambient light and of light from the sun


class Window(NamedTuple):
    """Rectangle of pixels; `right` and `bottom` are exclusive."""

    left: int
    right: int
    top: int
    bottom: int


@dataclass(frozen=True)
class View:
    """Perspective view from `eye` to `target` (m, world).

    `field_of_view` is the vertical one (rad), `up` the direction that is up in the picture.
    """

    eye: np.ndarray
    target: np.ndarray
    field_of_view: float = 0.6
    up: Vector = BODY_UP

    def matrix(self) -> list[float]:
        """Return the view matrix (world to camera) of OpenGL and Bullet.

        Its 16 numbers are given column by column.
        """
        return list(pybullet.computeViewMatrix(self.eye.tolist(), self.target.tolist(), self.up))

    def projection(self, width: int, height: int, window: Window) -> list[float]:
        """Return the projection matrix of a window of a picture of `width` by `height` pixels.

        A window that is not in the middle gives an asymmetric frustum. The 16 numbers are given
        column by column.
        """
        pixel = 2 * NEAR * math.tan(self.field_of_view / 2) / height
        left, right = ((x - width / 2) * pixel for x in (window.left, window.right))
        bottom, top = ((height / 2 - y) * pixel for y in (window.bottom, window.top))
        return list(pybullet.computeProjectionMatrix(left, right, bottom, top, NEAR, FAR))

    def axes(self) -> np.ndarray:
        """Return the right, up and forward axes of the camera in the world, shape (3, 3).

        Each row is one axis.
        """
        forward = (self.target - self.eye) / np.linalg.norm(self.target - self.eye)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def pixels(self, points: np.ndarray, width: int, height: int) -> np.ndarray:
        """Project points in front of the camera to pixels.

        Args:
            points: Points (m, world), shape (n, 3).
            width: Width of the picture (pixels).
            height: Height of the picture (pixels).

        Returns:
            Pixels from the left and the top, shape (n, 2).
        """
        right, up, forward = ((points - self.eye) @ self.axes().T).T
        scale = height / (2 * math.tan(self.field_of_view / 2))
        return np.stack(
            [width / 2 + scale * right / forward, height / 2 - scale * up / forward], axis=1
        )

    def bounding_window(
        self, centres: np.ndarray, radii: np.ndarray, width: int, height: int
    ) -> Window:
        """Return the smallest window that contains the visible parts of spheres.

        Args:
            centres: Centres of the spheres (m, world), shape (n, 3).
            radii: Radii of the spheres (m), shape (n,).
            width: Width of the picture (pixels).
            height: Height of the picture (pixels).

        Returns:
            The window; empty if no sphere is visible.
        """
        positions = (centres - self.eye) @ self.axes().T
        visible = self._in_frustum(positions, radii, width / height)
        if not visible.any():
            return Window(0, 0, 0, 0)
        (right, up, forward), radii = positions[visible].T, radii[visible]
        if (forward - radii).min() <= NEAR:
            return Window(0, width, 0, height)
        scale = height / (2 * math.tan(self.field_of_view / 2))
        across, down = (_tangent_range(values, radii, forward) * scale for values in (right, -up))
        return Window(*_pixel_range(across, width), *_pixel_range(down, height))

    def _in_frustum(self, positions: np.ndarray, radii: np.ndarray, aspect: float) -> np.ndarray:
        """Return a mask (n,) of the spheres that intersect the viewing frustum.

        `positions` (n, 3) are those of their centres in camera axes. A sphere is outside if its
        centre is farther than its radius from one of the four side planes.
        """
        right, up, forward = positions.T
        upwards = self.field_of_view / 2
        sideways = math.atan(aspect * math.tan(upwards))
        visible: np.ndarray = forward + radii > NEAR
        for distance, angle in ((np.abs(right), sideways), (np.abs(up), upwards)):
            visible &= distance * math.cos(angle) - forward * math.sin(angle) < radii
        return visible

    def mirrored(self) -> View:
        """Return the view mirrored at the water.

        Its picture, upside down, is the reflection in the water.
        """
        flip = np.array([1.0, 1.0, -1.0])
        return View(self.eye * flip, self.target * flip, self.field_of_view)


def _tangent_range(sideways: np.ndarray, radii: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Return the smallest and largest tangent of the viewing angles of spheres.

    Each sphere is replaced by the box around it, whose corners give the bounds.
    """
    ends = np.stack([sideways - radii, sideways + radii])
    tangents = np.stack([ends / (forward - radii), ends / (forward + radii)])
    return np.array([tangents.min(), tangents.max()])


def _pixel_range(spread: np.ndarray, count: int) -> list[int]:
    """Return the pixels (first, end) out of `count` that contain a `spread` of pixels.

    The spread is given relative to the middle.
    """
    low, high = math.floor(spread[0] + count / 2) - 1, math.ceil(spread[1] + count / 2) + 1
    return [max(0, min(low, count)), max(0, min(high, count))]


class Picture(NamedTuple):
    """Solids in a view.

    Attributes:
        colour: Colours, uint8 (height, width, 3).
        depth: Distances along the axis of the view (m), shape (height, width), infinite in pixels
            without a solid.
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
        parts = [*chain.from_iterable(objects)]
        bodies = iter([(self._create_body(part), part) for part in parts])
        self.objects = [list(islice(bodies, len(each))) for each in objects]
        # indexed by Bullet's body numbers 0, 1, ...
        self._centres = np.array([part.position for part in parts]).reshape(-1, 3)
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
                kind, sizes = pybullet.GEOM_BOX, {"halfExtents": [edge / 2 for edge in part.size]}
            case "cylinder":
                kind = pybullet.GEOM_CYLINDER
                sizes = {"radius": part.size[0], "length": part.size[1]}
            case "sphere":
                kind, sizes = pybullet.GEOM_SPHERE, {"radius": part.size[0]}
            case "mesh":
                kind, sizes = pybullet.GEOM_MESH, _triangles(part.size)
        colour = [*part.colour, 1.0]
        shape = pybullet.createVisualShape(
            kind, **sizes, rgbaColor=colour, physicsClientId=self.client
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
        share = np.asarray(depth, np.float32).reshape(rows, columns)[solid]
        # inverse of the depth buffer of OpenGL, whose value at the distance z is
        # (1 / NEAR - 1 / z) / (1 / NEAR - 1 / FAR)
        metres = np.full((rows, columns), np.inf, np.float32)
        metres[solid] = FAR * NEAR / (FAR - (FAR - NEAR) * share)
        return Picture(np.asarray(colour, np.uint8).reshape(rows, columns, 4)[..., :3], metres)


def _triangles(corners: Sequence[float]) -> dict[str, object]:
    """Return vertices, vertex numbers and normals of a mesh.

    TinyRenderer draws a triangle only if its corners appear counter-clockwise. Each triangle is
    given in both orders, so that it is seen from both sides.
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
