"""The equations of motion of the survey hexacopter: those of `multirotor.py` for its airframe."""

from __future__ import annotations

from cosim.export.block import Block

from .. import multirotor
from .parameters import AIRFRAME


def block() -> Block:
    """The survey hexacopter in free flight."""
    return multirotor.block(AIRFRAME, "Survey hexacopter of the class of the Tarot FY680 in free flight")
