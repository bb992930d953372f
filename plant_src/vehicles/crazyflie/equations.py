"""Equations of motion of the nano quadcopter: those of `multirotor_equations.py` for its airframe."""

from __future__ import annotations

from cosim.export.fmu.block import Block

from ..multirotor import multirotor_equations
from .parameters import AIRFRAME


def block() -> Block:
    """Return the nano quadcopter for export."""
    return multirotor_equations.multirotor_block(AIRFRAME, "Crazyflie 2.x nano quadcopter in free flight")
