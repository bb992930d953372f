"""The equations of motion of the nano quadcopter: those of `multirotor.py` for its airframe."""

from __future__ import annotations

from cosim.export.block import Block

from .. import multirotor
from .parameters import AIRFRAME


def block() -> Block:
    """The nano quadcopter in free flight."""
    return multirotor.block(AIRFRAME, "Crazyflie 2.x nano quadcopter in free flight")
