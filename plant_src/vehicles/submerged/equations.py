"""Equations of all submerged vehicles.

One binary for up to MAX_THRUSTERS thrusters, whose values are all parameters.
"""

from __future__ import annotations

import numpy as np

from cosim.export.fmu.block import Block

from .craft import MAX_THRUSTERS, Craft, Thruster
from .submerged_equations import submerged_block

#: neutrally buoyant vehicle of 10.25 kg with four horizontal thrusters at 45 degrees; the start
#: values of the FMU
CRAFT = Craft(
    name="submerged",
    mass=10.25,
    inertia=np.diag([0.2, 0.2, 0.2]),
    displaced_volume=0.01,
    centre_of_buoyancy=(0.0, 0.0, 0.02),
    size=(0.4, 0.3, 0.25),
    added_mass=np.diag([5.0, 10.0, 15.0, 0.1, 0.1, 0.1]),
    linear_damping=np.diag([4.0, 6.0, 5.0, 0.1, 0.1, 0.1]),
    quadratic_damping=np.diag([20.0, 40.0, 40.0, 1.0, 1.0, 1.0]),
    thrusters=tuple(
        Thruster(label, (0.15 * x, 0.1 * y, 0.0), (0.5**0.5, -x * y * 0.5**0.5, 0.0), 4e-4, 3e-4)
        for label, x, y in (
            ("front left", 1, 1),
            ("front right", 1, -1),
            ("rear left", -1, 1),
            ("rear right", -1, -1),
        )
    ),
    max_thruster_speed=300.0,
    thruster_radius=0.04,
)


def block() -> Block:
    """Return the submerged vehicle for export."""
    return submerged_block(
        CRAFT, "Submerged vehicle with up to 16 thrusters in open water", MAX_THRUSTERS
    )
