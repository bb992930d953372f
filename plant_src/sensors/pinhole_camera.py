"""Pinhole projection of a camera on a vehicle.

Camera axes: x to the right of the picture, y down, z along the view. A camera with tilt 0 looks
straight down, the nose of the vehicle at the top of the picture; with tilt pi/2 it looks ahead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .rotations import Quaternion, Vector, quaternion_product, to_body

#: quaternion of a camera that looks straight down: half a turn about the axis between forward and
#: right
_DOWNWARD_ATTITUDE = (0.0, math.sqrt(0.5), -math.sqrt(0.5), 0.0)


def camera_attitude(tilt: float) -> Quaternion:
    """Return the quaternion from camera axes to body axes for a tilt (rad)."""
    return quaternion_product(
        (math.cos(tilt / 2), 0.0, -math.sin(tilt / 2), 0.0), _DOWNWARD_ATTITUDE
    )


def to_camera_axes(
    eye: Sequence[float], attitude: Sequence[float], point: Sequence[float]
) -> Vector:
    """Transform a point (m, world) to the axes of a camera.

    Args:
        eye: Position of the camera (m, world).
        attitude: Unit quaternion from camera axes to world axes.
        point: Position of the point (m, world).

    Returns:
        Position of the point relative to the camera (m, camera axes).
    """
    return to_body(attitude, (point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]))


def project(point: Sequence[float], focal_length: float) -> tuple[float, float]:
    """Return the image of a point in camera axes.

    Pixels to the right of and below the centre of the picture.
    """
    return focal_length * point[0] / point[2], focal_length * point[1] / point[2]
