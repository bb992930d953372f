"""Collision shape of the nano quadcopter in its principal axes, because Bullet requires a diagonal inertia."""

from __future__ import annotations

import numpy as np

from ..common.shapes import Box, level_box
from .parameters import AIRFRAME

#: distance of the motor mounts, on which it stands, along x and y, equal to that of the rotors [pybullet-drones] (m)
EDGE = 0.056

#: bottom of the motor mounts and top of the battery from the centre of mass (m): height 29 mm [bitcraze], the lower part assumed
FEET_HEIGHT, TOP_HEIGHT = -0.012, 0.017


def boxes(to_body: np.ndarray) -> tuple[Box, ...]:
    """Return the collision shape in the frame from which `to_body` (3, 3) rotates into the body frame."""
    return (level_box(to_body, (EDGE, EDGE), FEET_HEIGHT, TOP_HEIGHT),)


BODY = AIRFRAME.body(boxes)
