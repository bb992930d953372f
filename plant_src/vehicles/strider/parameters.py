"""Numbers of the catamaran, SI units, body frame x forward, y left, z up, origin at the centre of mass.

Sources: [model] the simulation model published with the paper "An Open Simulation Strategy for Rapid Control Design in Aerial
and Maritime Drone Teams" (github.com/OmarVelascoAnrar/UAV_USV_Simulator, commit 1eee757); [paper] its Table 2.
"""

from __future__ import annotations

import math

#: hull without the links of the original's joint rig [model] (kg)
MASS = 4.11

#: principal moments about x, y, z [model] (kg m2); only the last one matters in the plane
INERTIA = (0.4957, 0.2478, 0.6391)

#: height of the centre of mass above the water [model] (m)
CENTRE_OF_MASS_HEIGHT = 0.1245

HULL_COUNT = 2

#: derivatives of the side force Y and the yaw moment N of one hull, at about 1 m/s [model, paper]
Y_V = -3.899501881  # kg/s
Y_R = 1.774273356  # kg m/s
N_V = -1.774273356  # kg m/s
N_R = -0.807294377  # kg m2/s

#: X = -AIR_DRAG |u| u, and likewise in y; the model halves the 0.2 of the paper [model] (kg/m)
AIR_DRAG = 0.1

WATER_DENSITY = 998.0  # kg/m3 [paper]
RUDDER_AREA = 0.0064  # m2 [paper]

#: at and beyond the stall angle [paper]
RUDDER_MAX_LIFT_COEFFICIENT = 1.2

#: inflow angle from which on the lift no longer grows [model] (rad)
STALL_ANGLE = math.radians(30)

#: distance of the rudder behind the centre of mass [model] (m)
RUDDER_ARM = 0.34727

#: landing deck from the centre of mass: edges of the plate, and its top [model] (m)
DECK_X = (-0.364, 0.337)
DECK_Y = (-0.299, 0.303)
DECK_TOP = 0.1444
