"""Equations of motion of the survey hexacopter: those of `multirotor_equations.py` for its airframe."""

from __future__ import annotations

from cosim.export.fmu.block import Block

from ..multirotor import multirotor_equations
from .parameters import AIRFRAME


def block() -> Block:
    """Return the survey hexacopter for export."""
    return multirotor_equations.multirotor_block(AIRFRAME, "Survey hexacopter of the class of the Tarot FY680 in free flight")
