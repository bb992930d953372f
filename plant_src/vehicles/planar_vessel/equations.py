"""Equations of all planar vessels that are given by data.

One binary, whose values are all parameters.
"""

from __future__ import annotations

import numpy as np

from cosim.export.fmu.block import Block

from ..vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS, Propeller
from .planar_equations import planar_vessel_block
from .planar_vessel import PlanarVessel

_ZERO = np.zeros((3, 3))

#: vessel of 30 kg with two propellers; the start values of the FMU
VESSEL = PlanarVessel(
    name="planar_vessel",
    mass=30.0,
    yaw_inertia=6.0,
    centre_of_mass=(0.0, 0.0, 0.0),
    height=0.0,
    added_mass=np.diag([2.0, 20.0, 3.0]),
    coriolis_added_mass=np.diag([2.0, 20.0, 3.0]),
    linear_damping=np.diag([10.0, 40.0, 20.0]),
    quadratic_damping=(_ZERO, _ZERO, _ZERO),
    cubic_damping=(0.0, 0.0, 0.0),
    air_drag=(0.0, 0.0),
    air_centre=(0.0, 0.0, 0.0),
    deck_centre=(0.0, 0.0, 0.2),
    propellers=tuple(
        Propeller(label, (-0.5, y, -0.15), (1.0, 0.0, 0.0), 4e-3, 3e-3, 100.0, 100.0)
        for label, y in (("port", 0.3), ("starboard", -0.3))
    ),
    rudders=(),
)


def block() -> Block:
    """Return the planar vessel for export."""
    text = "Vessel in the horizontal plane with up to 16 propellers and 16 rudders"
    return planar_vessel_block(VESSEL, text, (MAX_PROPELLERS, MAX_RUDDERS))
