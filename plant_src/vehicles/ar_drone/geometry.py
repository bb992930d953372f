"""Collision shape of the quadcopter in its principal axes, because Bullet requires a diagonal inertia."""

from __future__ import annotations

import math

import numpy as np

from ..common.shapes import Box, quaternion_from_matrix
from .parameters import AIRFRAME, CENTRE_OF_MASS

#: bottom of the motor cylinders, on which the vehicle stands, and top of the hull, in the frame of the published model (m)
FEET_HEIGHT, TOP_HEIGHT = -0.0566, 0.03

#: edge of the square whose corners are the feet (m); they are 0.1612 m from its centre
EDGE = 0.228


def boxes(to_body: np.ndarray) -> tuple[Box, ...]:
    """Return the collision shape in the frame from which `to_body` (3, 3) rotates into the body frame.

    It is one box whose lower corners are the feet at the ends of the arms; its edges are diagonal to the body axes. Four
    spheres or a convex hull of the same size creep more, and their contact cannot be restored bit by bit.
    """
    centre = to_body.T @ (np.array([0.0, 0.0, (TOP_HEIGHT + FEET_HEIGHT) / 2]) - CENTRE_OF_MASS)
    half = math.sqrt(0.5)
    diagonal = np.array([[half, half, 0.0], [-half, half, 0.0], [0.0, 0.0, 1.0]])
    half_extents = (EDGE / 2, EDGE / 2, (TOP_HEIGHT - FEET_HEIGHT) / 2)
    return (Box(half_extents, tuple(centre.tolist()), quaternion_from_matrix(to_body.T @ diagonal)),)


BODY = AIRFRAME.body(boxes)
