"""Equations of motion of the quadcopter: those of `multirotor_equations.py` for its airframe."""

from __future__ import annotations

from cosim.export.fmu.block import Block

from ..multirotor import multirotor_equations
from .parameters import AIRFRAME


def block() -> Block:
    """Return the quadcopter for export."""
    return multirotor_equations.multirotor_block(AIRFRAME, "AR.Drone 2.0 quadcopter in free flight")
