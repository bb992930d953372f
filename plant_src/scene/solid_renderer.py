"""Solids in a PyBullet client of their own, which draws them in memory by TinyRenderer. Physics never sees them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from ..physics.client import pybullet
from ..vehicles.common.shapes import Quaternion, Vector
from .cameras import FAR, NEAR, View, Window
from .parts import Part

SUN: Vector = (-0.45, -0.6, 0.66)  # direction to it
AMBIENT = DIFFUSE = 0.55  # light from everywhere, and from the sun


class Picture(NamedTuple):
    """What a view shows of solids: colour (height, width, 3) in bytes and depth along the view's axis (height, width) in m,
    infinite where there is nothing."""

    colour: np.ndarray
    depth: np.ndarray


class SolidRenderer:
    """Things made of parts, each of which can be placed as one. To be used in a `with` block."""

    def __init__(self, *things: Sequence[Part]):
        self.client = pybullet.connect(pybullet.DIRECT)
        self.objects = [[(self._create_body(part), part) for part in thing] for thing in things]
        parts = [part for thing in self.objects for _, part in thing]
        self._centres = np.array([part.position for part in parts]).reshape(-1, 3)  # in the order of Bullet's numbers: 0, 1, ...
        self._bounding_radii = np.array([part.bounding_radius() for part in parts])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pybullet.disconnect(self.client)

    def _create_body(self, part: Part) -> int:
        sizes: dict[str, object]
        match part.shape:
            case "box":
                sizes = {"shapeType": pybullet.GEOM_BOX, "halfExtents": [edge / 2 for edge in part.size]}
            case "cylinder":
                sizes = {"shapeType": pybullet.GEOM_CYLINDER, "radius": part.size[0], "length": part.size[1]}
            case "sphere":
                sizes = {"shapeType": pybullet.GEOM_SPHERE, "radius": part.size[0]}
        shape = pybullet.createVisualShape(**sizes, rgbaColor=[*part.colour, 1.0], physicsClientId=self.client)
        return int(
            pybullet.createMultiBody(
                baseVisualShapeIndex=shape,
                basePosition=part.position,
                baseOrientation=part.orientation,
                physicsClientId=self.client,
            )
        )

    def set_pose(self, thing: int, position: Sequence[float], orientation: Quaternion) -> None:
        """Put the frame of a thing to `position` (m, world) with `orientation` (x, y, z, w)."""
        for body, part in self.objects[thing]:
            pose = pybullet.multiplyTransforms(position, orientation, part.position, part.orientation)
            pybullet.resetBasePositionAndOrientation(body, *pose, physicsClientId=self.client)
            self._centres[body] = pose[0]

    def render(self, view: View, width: int, height: int, shadow: bool = False) -> Picture:
        """What `view` sees, in pixels; `shadow` lets things cast shadows on each other.

        Drawn is only where things are: TinyRenderer takes its time for every pixel.
        """
        whole = Picture(np.zeros((height, width, 3), np.uint8), np.full((height, width), np.inf, np.float32))
        window = view.bounding_window(self._centres, self._bounding_radii, width, height)
        if window.left < window.right and window.top < window.bottom:
            part = (slice(window.top, window.bottom), slice(window.left, window.right))
            whole.colour[part], whole.depth[part] = self._render_window(view, width, height, window, shadow)
        return whole

    def _render_window(self, view: View, width: int, height: int, window: Window, shadow: bool) -> Picture:
        columns, rows = window.right - window.left, window.bottom - window.top
        _, _, colour, depth, found = pybullet.getCameraImage(
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
        solid = np.asarray(found).reshape(rows, columns) >= 0
        metres = np.full((rows, columns), np.inf, np.float32)
        metres[solid] = FAR * NEAR / (FAR - (FAR - NEAR) * np.asarray(depth, np.float32).reshape(rows, columns)[solid])
        return Picture(np.asarray(colour, np.uint8).reshape(rows, columns, 4)[..., :3], metres)
