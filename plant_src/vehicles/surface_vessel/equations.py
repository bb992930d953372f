"""Equations of all floating vessels that are given by data.

One binary, whose values are all parameters.
"""

from __future__ import annotations

import numpy as np

from cosim.export.fmu.block import Block

from ..vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS, Propeller
from .floating_equations import surface_vessel_block
from .surface_vessel import HullForm, SurfaceVessel

#: catamaran of 30 kg with two propellers; the start values of the FMU
VESSEL = SurfaceVessel(
    name="surface_vessel",
    mass=30.0,
    inertia=np.diag([3.0, 4.0, 6.0]),
    centre_of_mass=(0.0, 0.0, 0.0),
    added_mass=np.diag([2.0, 20.0, 30.0, 3.0, 3.0, 3.0]),
    coriolis_added_mass=np.diag([2.0, 20.0, 30.0, 3.0, 3.0, 3.0]),
    linear_damping=np.diag([10.0, 40.0, 100.0, 20.0, 30.0, 20.0]),
    quadratic_damping=np.diag([10.0, 40.0, 0.0, 0.0, 0.0, 10.0]),
    air_drag=(0.0, 0.0),
    air_centre=(0.0, 0.0, 0.0),
    deck_centre=(0.0, 0.0, 0.2),
    propellers=tuple(
        Propeller(label, (-0.5, y, -0.15), (1.0, 0.0, 0.0), 4e-3, 3e-3, 100.0, 100.0)
        for label, y in (("port", 0.3), ("starboard", -0.3))
    ),
    rudders=(),
    hull=HullForm(
        count=2,
        length=1.3,
        beam=0.2,
        offset=0.3,
        depth=0.25,
        bottom=-0.2,
        waterplane_centre=0.0,
        waterplane_coefficient=0.9,
        transverse_moment=0.044,
        longitudinal_moment=0.06,
    ),
)


def block() -> Block:
    """Return the floating vessel for export."""
    text = "Vessel afloat in six degrees of freedom with up to 16 propellers and 16 rudders"
    return surface_vessel_block(VESSEL, text, (MAX_PROPELLERS, MAX_RUDDERS))
