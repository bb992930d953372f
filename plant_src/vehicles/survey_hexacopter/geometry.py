"""Collision shape of the survey hexacopter in its principal axes, because Bullet requires a diagonal inertia."""

from __future__ import annotations

import numpy as np

from ..common.shapes import Box, level_box
from .parameters import AIRFRAME

#: distance of the ends of the landing skids along x and y, assumed from skids of this class of frame (m)
SKID_TRACK = (0.30, 0.36)

#: bottom of the skids and top of the frame from the centre of mass, assumed (m)
FEET_HEIGHT, TOP_HEIGHT = -0.22, 0.12


def boxes(to_body: np.ndarray) -> tuple[Box, ...]:
    """Return the collision shape in the frame from which `to_body` (3, 3) rotates into the body frame."""
    return (level_box(to_body, SKID_TRACK, FEET_HEIGHT, TOP_HEIGHT),)


BODY = AIRFRAME.body(boxes)
