"""Parameters of the Otter with their sources, and its rigid body, in SI units.

Body frame: x forward, y left, z up, origin O midships on the centre line at the waterline.

Source: the model `otter` of the Marine Systems Simulator (github.com/cybergalactic/MSS, MIT
licence, revision of 2026-06-27) by T. I. Fossen; Fossen 2021, Handbook of Marine Craft
Hydrodynamics and Motion Control, 2nd edition. The values are converted from the frame x forward, y
right, z down: y and z of vectors change their sign. Values from elsewhere are marked [assumed].
"""

import math

from ..common.shapes import Body, Box

GRAVITY = 9.81  # m/s2
WATER_DENSITY = 1025.0  # kg/m3

LENGTH, BEAM = 2.0, 1.08  # m

#: change of velocity by a collision that counts as a crash [assumed]: twice the 0.3 m/s of a fast
#: berthing (m/s)
CRASH_SPEED = 0.6

#: hull without payload: mass (kg), centre of mass (m), radii of gyration about x, y, z (m)
HULL_MASS = 55.0
HULL_CENTRE = (0.2, 0.0, 0.2)
RADII_OF_GYRATION = (0.4 * BEAM, 0.25 * LENGTH, 0.25 * LENGTH)

#: pontoons: beam and lateral position (m), waterplane and block coefficient
PONTOON_BEAM = 0.25
PONTOON_OFFSET = 0.395
WATERLINE_COEFFICIENT = 0.75
BLOCK_COEFFICIENT = 0.4

#: area (m2), transverse and longitudinal second moment (m4) of the waterplane of both pontoons
WATERPLANE_AREA = 2 * WATERLINE_COEFFICIENT * LENGTH * PONTOON_BEAM
_FULLNESS = (
    6 * WATERLINE_COEFFICIENT**3 / ((1 + WATERLINE_COEFFICIENT) * (1 + 2 * WATERLINE_COEFFICIENT))
)
TRANSVERSE_MOMENT = (
    2 * LENGTH * PONTOON_BEAM**3 / 12 * _FULLNESS + WATERPLANE_AREA * PONTOON_OFFSET**2
)
_BOX_MOMENT = 2 * PONTOON_BEAM * LENGTH**3 / 12
MSS_LONGITUDINAL_MOMENT = 0.8 * _BOX_MOMENT

#: the same for the strips: with this share of a box, the trim under the payload of 25 kg is the
#: 1.49063 degrees of MSS, whose stiffness counts the height of the payload twice
LONGITUDINAL_MOMENT = 0.767776 * _BOX_MOMENT

#: centre of the waterplane (m)
CENTRE_OF_FLOTATION = (-0.2, 0.0, 0.0)

#: draughts of the hull without payload (m): mean, and of five stations from bow to stern. The hull
#: floats level, so that its centre of buoyancy is below its centre of mass, 0.4 m ahead of the
#: centre of the waterplane: the bottoms rise linearly towards the stern. The largest draught is
#: 1.97 times the mean one; block
#: and waterplane coefficient of
#: MSS give 1.88.
MEAN_DRAUGHT = HULL_MASS / WATER_DENSITY / WATERPLANE_AREA
_STATION_SPACING = math.sqrt(LONGITUDINAL_MOMENT / WATERPLANE_AREA / 2)
_RISE = MEAN_DRAUGHT * (HULL_CENTRE[0] - CENTRE_OF_FLOTATION[0]) / (2 * _STATION_SPACING)
STATION_DRAUGHTS = tuple(MEAN_DRAUGHT + station * _RISE for station in (2, 1, 0, -1, -2))

#: centre of buoyancy of the hull without payload (m)
HULL_CENTRE_OF_BUOYANCY = (
    HULL_CENTRE[0],
    0.0,
    -sum(d * d for d in STATION_DRAUGHTS) / (10 * MEAN_DRAUGHT),
)

#: added mass in surge (kg, Soeding 1982), of sway and heave over the mass of the hull, of roll,
#: pitch and yaw over the moments of inertia
SURGE_ADDED_MASS = 2.7 * WATER_DENSITY * (HULL_MASS / WATER_DENSITY) ** (5 / 3) / LENGTH**2
ADDED_MASS_SHARES = (1.5, 1.0)
ADDED_INERTIA_SHARES = (0.2, 0.8, 1.7)

#: maximum speed of 6 knots (m/s) and the thrust (N) that the surge damping balances at this speed
MAX_SPEED = 6 * 0.5144
MAX_THRUST = 24.4 * GRAVITY

#: damping: time constants of sway and yaw (s), damping ratios of heave, roll and pitch, growth in
#: yaw with |r| (s/rad)
DAMPING_TIME_CONSTANTS = (1.0, 1.0)
DAMPING_RATIOS = (0.3, 0.2, 0.4)
YAW_DAMPING_GROWTH = 10.0

#: number of stations along the hull for the cross-flow drag
STATION_COUNT = 21

#: (beam / (2 draught), cross-flow drag coefficient of a section), Hoerner's curve
CROSS_FLOW_DRAG_CURVE = (
    (0.0109, 1.966),
    (0.1766, 1.9657),
    (0.3530, 1.8976),
    (0.4519, 1.7872),
    (0.4728, 1.5837),
    (0.4929, 1.2786),
    (0.4933, 1.2108),
    (0.5585, 1.0836),
    (0.6464, 0.9986),
    (0.8336, 0.8796),
    (0.9880, 0.8284),
    (1.3081, 0.7599),
    (1.6392, 0.6914),
    (1.8600, 0.6571),
    (2.3129, 0.6307),
    (2.6000, 0.5962),
    (3.0088, 0.5868),
    (3.4508, 0.5859),
    (3.7379, 0.5599),
    (4.0031, 0.5593),
)

#: propeller: thrust over speed |speed| ahead and astern (N s2/rad2), limits of the speed (rad/s)
THRUST_AHEAD, THRUST_ASTERN = 0.02216 / 2, 0.01289 / 2
MAX_PROPELLER_SPEED = math.sqrt(0.5 * MAX_THRUST / THRUST_AHEAD)
MIN_PROPELLER_SPEED = -math.sqrt(0.5 * 13.6 * GRAVITY / THRUST_ASTERN)

#: wind load [assumed]: density (kg/m3), frontal and lateral projected area (m2), drag coefficients
#: of the order of Fossen (2021), section 10.1, height of the load above O (m); the drag of still
#: air is part of the surge damping
AIR_DENSITY = 1.225
PROJECTED_AREAS = (0.35, 0.55)
WIND_COEFFICIENTS = (0.7, 0.9)
WIND_HEIGHT = 0.25

#: landing deck [assumed], a plate over both pontoons instead of mast and antennas: centre of its
#: top and edges (m)
DECK_CENTRE = (0.0, 0.0, 0.4)
DECK_SIZE = (1.2, 1.0, 0.02)

#: top and bottom of the pontoons above O [assumed] (m); the bottom is at the draught with 25 kg of
#: payload
PONTOON_TOP, PONTOON_BOTTOM = 0.15, -0.195


def _pontoon_box(side: float) -> Box:
    half_extents = (LENGTH / 2, PONTOON_BEAM / 2, (PONTOON_TOP - PONTOON_BOTTOM) / 2)
    return Box(half_extents, (0.0, side * PONTOON_OFFSET, (PONTOON_TOP + PONTOON_BOTTOM) / 2))


_DECK_BOX = Box(
    (DECK_SIZE[0] / 2, DECK_SIZE[1] / 2, DECK_SIZE[2] / 2),
    (*DECK_CENTRE[:2], DECK_CENTRE[2] - DECK_SIZE[2] / 2),
)
_ROLL, _PITCH, _YAW = (HULL_MASS * radius**2 for radius in RADII_OF_GYRATION)
BODY = Body(HULL_MASS, (_ROLL, _PITCH, _YAW), (_DECK_BOX, _pontoon_box(+1.0), _pontoon_box(-1.0)))
