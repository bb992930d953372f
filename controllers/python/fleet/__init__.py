"""Constants, enumerations and functions of the controllers in Python.

The counterpart of the Modelica package Fleet.
"""

from __future__ import annotations

import math
from enum import IntEnum

SAMPLE_PERIOD = 0.01  # s
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
    """Behaviour of a vessel after its last waypoint."""

    STOP = 1
    REPEAT = 2
    KEEP_COURSE = 3


def limit(value: float, lower: float, upper: float) -> float:
    """Return `value` limited to the range from `lower` to `upper`."""
    return min(upper, max(lower, value))


def wrap_angle(angle: float) -> float:
    """Return the angle (rad) wrapped to -pi ... pi."""
    return angle if abs(angle) <= math.pi else math.atan2(math.sin(angle), math.cos(angle))


def horizontal_norm(x: float, y: float) -> float:
    """Return the Euclidean norm with the rounding of the Modelica function.

    math.hypot rounds differently.
    """
    return math.sqrt(x * x + y * y)
