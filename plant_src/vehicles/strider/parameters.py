"""Parameters of the catamaran with their sources, and its rigid body, in SI units.

Body frame: x forward, y left, z up, origin at the centre of mass.

Sources: [model] the simulation model published with the paper "An Open Simulation Strategy for
Rapid Control Design in Aerial and Maritime Drone Teams"
(github.com/OmarVelascoAnrar/UAV_USV_Simulator, commit 1eee757); [paper] its Table 2.
"""

import math

from ..common.shapes import Body, Box

#: mass of the hull without the links of the original's joint rig [model] (kg)
MASS = 4.11

#: principal moments of inertia about x, y, z [model] (kg m2); planar motion uses the last one only
INERTIA = (0.4957, 0.2478, 0.6391)

#: height of the centre of mass above the water [model] (m)
CENTRE_OF_MASS_HEIGHT = 0.1245

#: change of velocity by a collision that counts as a crash [assumed]: twice the 0.3 m/s of a fast
#: berthing (m/s)
CRASH_SPEED = 0.6

HULL_COUNT = 2

#: dimensions of a hull from [model] (m), and distance of its centre line from the middle
HULL_LENGTH, HULL_BEAM, HULL_OFFSET = 0.979, 0.126, 0.533
HULL_BOTTOM, HULL_TOP = -0.144, -0.109

#: hydrodynamic derivatives of sway force Y and yaw moment N of one hull at about 1 m/s [model,
#: paper]
Y_V = -3.899501881  # kg/s
Y_R = 1.774273356  # kg m/s
N_V = -1.774273356  # kg m/s
N_R = -0.807294377  # kg m2/s

#: coefficient of X = -AIR_DRAG |u| u and Y = -AIR_DRAG |v| v (kg/m) [model]; the paper has 0.2
AIR_DRAG = 0.1

WATER_DENSITY = 998.0  # kg/m3 [paper]
VISCOSITY = 1.0034e-6  # kinematic, of fresh water at 20 degrees (m2/s)
GRAVITY = 9.81  # m/s2

DRAUGHT = -HULL_BOTTOM - CENTRE_OF_MASS_HEIGHT  # m
VOLUME = MASS / WATER_DENSITY  # displaced, m3

#: block coefficient C_B = 0.86: the hulls are nearly boxes
BLOCK_COEFFICIENT = VOLUME / (HULL_COUNT * HULL_LENGTH * HULL_BEAM * DRAUGHT)

#: waterplane coefficient of U-shaped sections, (1 + 2 C_B) / 3
#: (Schneekluth and Bertram 1998, Ship Design for Efficiency and Economy, section 1.6)
WATERPLANE_COEFFICIENT = (1 + 2 * BLOCK_COEFFICIENT) / 3

#: wetted surface of both hulls: bottoms and sides [estimated] (m2)
WETTED_SURFACE = HULL_COUNT * HULL_LENGTH * (WATERPLANE_COEFFICIENT * HULL_BEAM + 2 * DRAUGHT)

#: Reynolds number below which the friction coefficient is constant; here the hull moves at 0.01 m/s
MIN_REYNOLDS_NUMBER = 1e4

#: maximum of the residuary coefficient and its Froude number [estimated]: Michell's integral for
#: one wall-sided hull of these dimensions with waterlines 1 - |2 x / L|^6, within 12 % for Froude
#: numbers of 0.4 to 1.2. Below them the theory of thin ships exaggerates the waves of blunt ends.
RESIDUARY_PEAK, RESIDUARY_PEAK_FROUDE_NUMBER = 4.6e-3, 0.4
RUDDER_AREA = 0.0064  # m2 [paper]

#: lift coefficient at and beyond the stall angle [paper]
RUDDER_MAX_LIFT_COEFFICIENT = 1.2

#: angle of attack beyond which the lift is constant [model] (rad)
STALL_ANGLE = math.radians(30)

#: distance of the rudder behind the centre of mass [model] (m)
RUDDER_ARM = 0.34727

#: limits of the deck plate along x and y, and its top, from the centre of mass [model] (m)
DECK_X = (-0.364, 0.337)
DECK_Y = (-0.299, 0.303)
DECK_TOP = 0.1444


#: centre of the top of the landing deck (m)
DECK_CENTRE = (sum(DECK_X) / 2, sum(DECK_Y) / 2, DECK_TOP)

#: dimensions from the published simulation model (m)
PLATE_THICKNESS = 0.023
HOUSING_SIZE = (0.30, 0.30, 0.05)  # edges of the box under the deck plate


def _hull_box(side: float) -> Box:
    half_extents = (HULL_LENGTH / 2, HULL_BEAM / 2, (HULL_TOP - HULL_BOTTOM) / 2)
    return Box(half_extents, (0.0, side * HULL_OFFSET, (HULL_TOP + HULL_BOTTOM) / 2))


def _plate_box() -> Box:
    half_extents = ((DECK_X[1] - DECK_X[0]) / 2, (DECK_Y[1] - DECK_Y[0]) / 2, PLATE_THICKNESS / 2)
    return Box(half_extents, (DECK_CENTRE[0], DECK_CENTRE[1], DECK_TOP - PLATE_THICKNESS / 2))


def _housing_box() -> Box:
    x, y, z = HOUSING_SIZE
    return Box(
        (x / 2, y / 2, z / 2), (DECK_CENTRE[0], DECK_CENTRE[1], DECK_TOP - PLATE_THICKNESS - z / 2)
    )


BODY = Body(
    MASS,
    INERTIA,
    (_plate_box(), _hull_box(+1.0), _hull_box(-1.0), _housing_box()),
    CENTRE_OF_MASS_HEIGHT,
)
