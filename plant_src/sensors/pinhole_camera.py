"""A pinhole camera on a vehicle.

Axes of the camera: x to the right of the picture, y down in it, z along the view. A camera with tilt 0 looks straight down, the
nose of the vehicle at the top of the picture; with pi/2 it looks ahead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .rotations import Quaternion, Vector, quaternion_product, to_body

#: x right, y back, z down in body axes: half a turn about the axis between ahead and right
_DOWNWARD_ATTITUDE = (0.0, math.sqrt(0.5), -math.sqrt(0.5), 0.0)


def camera_attitude(tilt: float) -> Quaternion:
    """From camera axes to body axes."""
    return quaternion_product((math.cos(tilt / 2), 0.0, -math.sin(tilt / 2), 0.0), _DOWNWARD_ATTITUDE)


def to_camera_axes(place: Sequence[float], attitude: Sequence[float], point: Sequence[float]) -> Vector:
    """A point (m, world) in the axes of a camera at `place` whose axes `attitude` turns into the world's."""
    return to_body(attitude, (point[0] - place[0], point[1] - place[1], point[2] - place[2]))


def project(point: Sequence[float], focal_length: float) -> tuple[float, float]:
    """Where a point in camera axes appears: pixels to the right of and below the middle of the picture."""
    return focal_length * point[0] / point[2], focal_length * point[1] / point[2]
