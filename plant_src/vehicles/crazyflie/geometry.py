"""What Bullet knows of the nano quadcopter, in the principal-axis frame at the centre of mass."""

from __future__ import annotations

import numpy as np

from ..common.shapes import Box, level_box
from .parameters import AIRFRAME

#: distance of the motor mounts, on which it stands, along x and y: the rotors' [pybullet-drones] (m)
EDGE = 0.056

#: bottom of the motor mounts and top of the battery from the centre of mass: 29 mm in all [bitcraze], the share below assumed (m)
FEET_HEIGHT, TOP_HEIGHT = -0.012, 0.017


def boxes(to_body: np.ndarray) -> tuple[Box, ...]:
    """The shapes in a frame that `to_body` (3, 3) turns into the body frame."""
    return (level_box(to_body, (EDGE, EDGE), FEET_HEIGHT, TOP_HEIGHT),)


BODY = AIRFRAME.body(boxes)
