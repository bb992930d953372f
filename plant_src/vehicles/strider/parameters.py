"""Parameters of the catamaran with their sources, in SI units.

Body frame: x forward, y left, z up, origin at the centre of mass.

Sources: [model] the simulation model published with the paper "An Open Simulation Strategy for Rapid Control Design in Aerial
and Maritime Drone Teams" (github.com/OmarVelascoAnrar/UAV_USV_Simulator, commit 1eee757); [paper] its Table 2.
"""

from __future__ import annotations

import math

#: mass of the hull without the links of the original's joint rig [model] (kg)
MASS = 4.11

#: principal moments of inertia about x, y, z [model] (kg m2); planar motion uses the last one only
INERTIA = (0.4957, 0.2478, 0.6391)

#: height of the centre of mass above the water [model] (m)
CENTRE_OF_MASS_HEIGHT = 0.1245

#: change of velocity by a collision that counts as a crash [assumed]: twice the 0.3 m/s of a fast berthing (m/s)
CRASH_SPEED = 0.6

HULL_COUNT = 2

#: hydrodynamic derivatives of sway force Y and yaw moment N of one hull at about 1 m/s [model, paper]
Y_V = -3.899501881  # kg/s
Y_R = 1.774273356  # kg m/s
N_V = -1.774273356  # kg m/s
N_R = -0.807294377  # kg m2/s

#: coefficient of X = -AIR_DRAG |u| u and Y = -AIR_DRAG |v| v (kg/m) [model]; the paper has 0.2
AIR_DRAG = 0.1

WATER_DENSITY = 998.0  # kg/m3 [paper]
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
