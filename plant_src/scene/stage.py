"""Solids in a PyBullet client of their own, which draws them in memory by TinyRenderer. Physics never sees them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

from ..bullet import pybullet
from ..vehicles.shapes import Quaternion, Vector
from .cameras import FAR, NEAR, View
from .models import Part

SUN: Vector = (-0.45, -0.6, 0.66)  # direction to it


class Picture(NamedTuple):
    """What a view shows of solids: colour (height, width, 3) in bytes and depth along the view's axis (height, width) in m,
    infinite where there is nothing."""

    colour: np.ndarray
    depth: np.ndarray


class Stage:
    """Things made of parts, each of which can be placed as one. To be used in a `with` block."""

    def __init__(self, *things: Sequence[Part]):
        self.client = pybullet.connect(pybullet.DIRECT)
        self.things = [[(self._create(part), part) for part in thing] for thing in things]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pybullet.disconnect(self.client)

    def _create(self, part: Part) -> int:
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

    def place(self, thing: int, position: Sequence[float], orientation: Quaternion) -> None:
        """Put the frame of a thing to `position` (m, world) with `orientation` (x, y, z, w)."""
        for body, part in self.things[thing]:
            pose = pybullet.multiplyTransforms(position, orientation, part.position, part.orientation)
            pybullet.resetBasePositionAndOrientation(body, *pose, physicsClientId=self.client)

    def picture(self, view: View, width: int, height: int, shadow: bool = False) -> Picture:
        """What `view` sees, in pixels; `shadow` lets things cast shadows on each other."""
        _, _, colour, depth, found = pybullet.getCameraImage(
            width,
            height,
            view.matrix(),
            view.projection(width / height),
            lightDirection=SUN,
            lightDistance=60.0,
            lightAmbientCoeff=0.55,
            lightDiffuseCoeff=0.55,
            lightSpecularCoeff=0.05,
            shadow=int(shadow),
            renderer=pybullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        solid = np.asarray(found).reshape(height, width) >= 0
        metres = np.full((height, width), np.inf, np.float32)
        metres[solid] = FAR * NEAR / (FAR - (FAR - NEAR) * np.asarray(depth, np.float32).reshape(height, width)[solid])
        return Picture(np.asarray(colour, np.uint8).reshape(height, width, 4)[..., :3], metres)
