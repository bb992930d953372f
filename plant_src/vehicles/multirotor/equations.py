"""Equations of motion of all multirotors.

One binary for up to MAX_ROTORS rotors, whose values are all parameters.
"""

from __future__ import annotations

import numpy as np

from cosim.export.fmu.block import Block

from .airframe import MAX_ROTORS, Airframe, Rotor
from .multirotor_equations import multirotor_block

#: quadcopter of 1 kg whose rotors turn at 350 rad/s in hover; the start values of the FMU
AIRFRAME = Airframe(
    name="multirotor",
    mass=1.0,
    inertia=np.diag([0.01, 0.01, 0.02]),
    rotors=tuple(
        Rotor(label, (x, y, 0.0), sign, 2e-5, 3e-7)
        for label, x, y, sign in (
            ("front", 0.2, 0.0, 1.0),
            ("left", 0.0, 0.2, -1.0),
            ("rear", -0.2, 0.0, 1.0),
            ("right", 0.0, -0.2, -1.0),
        )
    ),
    max_rotor_speed=600.0,
    rotor_radius=0.1,
)


def block() -> Block:
    """Return the multirotor for export."""
    return multirotor_block(AIRFRAME, "Multirotor with up to 16 rotors in free flight", MAX_ROTORS)
