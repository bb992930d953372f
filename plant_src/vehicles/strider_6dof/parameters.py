"""Parameters of the catamaran beyond those of the planar model (`strider/parameters.py`).

SI units. The original moves in the plane, so nothing is published about heave, roll and pitch. All
values here are computed from the mass and the main dimensions of the model, or marked [assumed].
The draught follows from the geometry: the bottom of the hulls is 0.144 m below the centre of mass,
which floats 0.1245 m above the water. The height of the rigid body is part of the state.
"""

import math
from itertools import product

import numpy as np

from ..strider import parameters as geometry
from ..strider.parameters import (
    CENTRE_OF_MASS_HEIGHT,
    DRAUGHT,
    GRAVITY,
    HULL_BEAM,
    HULL_BOTTOM,
    HULL_COUNT,
    HULL_LENGTH,
    HULL_OFFSET,
    INERTIA,
    MASS,
    RUDDER_AREA,
    VOLUME,
    WATER_DENSITY,
    WATERPLANE_COEFFICIENT,
)

WATERPLANE_AREA = HULL_COUNT * WATERPLANE_COEFFICIENT * HULL_LENGTH * HULL_BEAM  # m2

#: second moments of the waterplane of both hulls (m4); the longitudinal one is reduced by the
#: square of the coefficient
TRANSVERSE_MOMENT = WATERPLANE_AREA * (HULL_OFFSET**2 + HULL_BEAM**2 / 12)
LONGITUDINAL_MOMENT = WATERPLANE_COEFFICIENT * WATERPLANE_AREA * HULL_LENGTH**2 / 12

#: draught of boxes with this waterplane and volume (m)
MEAN_DRAUGHT = VOLUME / WATERPLANE_AREA

#: depth of the hulls [assumed]: as deep as wide (m). The published model ends 35 mm above the
#: bottom; a hull that shallow could not carry the vessel alone. The righting moment is limited to m
#: g times the offset of the hulls,
#: 21.5 N m, for greater depths.
HULL_DEPTH = HULL_BEAM

#: transverse and longitudinal metacentric height (m); the centre of buoyancy is at half of the mean
#: draught
_BUOYANCY_BELOW_CENTRE = CENTRE_OF_MASS_HEIGHT + MEAN_DRAUGHT / 2
METACENTRIC_HEIGHTS = tuple(
    moment / VOLUME - _BUOYANCY_BELOW_CENTRE for moment in (TRANSVERSE_MOMENT, LONGITUDINAL_MOMENT)
)

#: restoring stiffness of heave (N/m), roll and pitch (N m/rad)
STIFFNESS = (
    WATER_DENSITY * GRAVITY * WATERPLANE_AREA,
    *(WATER_DENSITY * GRAVITY * VOLUME * height for height in METACENTRIC_HEIGHTS),
)

#: added mass of both hulls per length (kg/m) by strip theory: sections are half circles with the
#: radius of the draught in sway, flat plates at the surface in heave (Newman 1977, Marine
#: Hydrodynamics, table 4.3)
_SWAY_ADDED_MASS = HULL_COUNT * WATER_DENSITY * math.pi / 2 * DRAUGHT**2
_HEAVE_ADDED_MASS = HULL_COUNT * WATER_DENSITY * math.pi / 8 * HULL_BEAM**2

#: added mass in surge over the mass [assumed]; slender bodies have 3 to 8 %
SURGE_ADDED_MASS_SHARE = 0.05

#: M_A, shape (6, 6) (kg, kg m2)
ADDED_MASS = np.diag(
    [
        SURGE_ADDED_MASS_SHARE * MASS,
        _SWAY_ADDED_MASS * HULL_LENGTH,
        _HEAVE_ADDED_MASS * HULL_LENGTH,
        _HEAVE_ADDED_MASS * HULL_LENGTH * HULL_OFFSET**2,
        _HEAVE_ADDED_MASS * HULL_LENGTH**3 / 12,
        _SWAY_ADDED_MASS * HULL_LENGTH**3 / 12 + SURGE_ADDED_MASS_SHARE * MASS * HULL_OFFSET**2,
    ]
)

#: part of M_A in the Coriolis loads; the hydrodynamic derivatives, measured at speed, contain those
#: of surge, sway and yaw
CORIOLIS_ADDED_MASS = ADDED_MASS * np.diag([0.0, 0.0, 1.0, 1.0, 1.0, 0.0])

#: damping ratios of heave, roll and pitch [assumed], equal to those of Fossen's model of the Otter
DAMPING_RATIOS = (0.3, 0.2, 0.4)

_OSCILLATING_INERTIA = np.array([MASS, *INERTIA[:2]]) + np.diag(ADDED_MASS)[2:5]

#: natural frequencies of heave, roll and pitch (rad/s)
NATURAL_FREQUENCIES = np.sqrt(np.array(STIFFNESS) / _OSCILLATING_INERTIA)

#: linear damping of heave (kg/s), roll and pitch (kg m2/s)
DAMPING = tuple(
    (2 * np.array(DAMPING_RATIOS) * NATURAL_FREQUENCIES * _OSCILLATING_INERTIA).tolist()
)

#: drag coefficient of a plate normal to the flow, for vertical motion [assumed] (Hoerner 1965,
#: Fluid-Dynamic Drag, chapter 3)
PLATE_DRAG_COEFFICIENT = 1.2

#: points of the vertical drag (m), two on each hull, with the mean squared distance of the hull
#: from midships
_DRAG_REACH = HULL_LENGTH / 12**0.5
DRAG_POINTS = tuple(product((-_DRAG_REACH, _DRAG_REACH), (-HULL_OFFSET, HULL_OFFSET)))

#: drag over squared velocity at each point (N s2/m2)
POINT_DRAG = WATER_DENSITY / 2 * PLATE_DRAG_COEFFICIENT * WATERPLANE_AREA / len(DRAG_POINTS)

#: heights of the side forces on hulls and rudder above the centre of mass (m); the rudder is square
#: [assumed]
HULL_FORCE_HEIGHT = HULL_BOTTOM + DRAUGHT / 2
RUDDER_HEIGHT = -CENTRE_OF_MASS_HEIGHT - RUDDER_AREA**0.5 / 2


BODY = geometry.BODY._replace(height=0.0)
