"""What the controllers in Python share: the counterpart of the Modelica package Fleet."""

from __future__ import annotations

import math
from enum import IntEnum

SAMPLE_PERIOD = 0.01  # s, of every controller
GRAVITY = 9.81  # m/s2
DEGREES_PER_RADIAN = 180 / math.pi  # deg/rad
MAX_ROTOR_SPEED = 5000 * 0.10471976  # rad/s, at full throttle: 5000 rpm
MAX_WAYPOINTS = 32


class FlightMode(IntEnum):
    """Phases of a flight."""

    IDLE = 1
    TAKE_OFF = 2
    FOLLOW = 3
    APPROACH = 4
    DESCEND = 5
    LANDED = 6


class EndPolicy(IntEnum):
    """What a vessel does after its last waypoint."""

    STOP = 1
    REPEAT = 2
    KEEP_COURSE = 3


def limit(value: float, lower: float, upper: float) -> float:
    """Value kept between two bounds."""
    return min(upper, max(lower, value))


def wrap_angle(angle: float) -> float:
    """The same angle (rad) between -pi and pi."""
    return angle if abs(angle) <= math.pi else math.atan2(math.sin(angle), math.cos(angle))


def horizontal_norm(x: float, y: float) -> float:
    """Euclidean norm in the horizontal plane; rounds as the Modelica function does, which math.hypot does not."""
    return math.sqrt(x * x + y * y)
