"""Parameters of the nano quadcopter with their sources, in SI units.

Body frame: x forward, y left, z up, origin at the centre of mass.

Sources: [foerster] J. Förster, "System Identification of the Crazyflie 2.0 Nano Quadrocopter", ETH Zurich, 2015; [rotorpy]
rotorpy/vehicles/crazyflie_params.py of Folk, Paulos and Kumar, "RotorPy" (github.com/spencerfolk/rotorpy), which cites
[foerster]; [pybullet-drones] assets/cf2x.urdf of Panerati et al., "Learning to Fly", IROS 2021 (github.com/utiasDSL/gym-
pybullet-drones); [rotors] crazyflie2.xacro of ethz-asl/rotors_simulator; [bitcraze] the maker's data sheet. Values without a
source are assumptions.
"""

from __future__ import annotations

import math

import numpy as np

from ..multirotor.airframe import Airframe, Rotor, RotorEffects

#: mass with battery [pybullet-drones, bitcraze] (kg)
MASS = 0.027

#: inertia tensor about the centre of mass, measured at a mass of 0.028 kg [foerster] (kg m2)
INERTIA = np.array(
    [
        [16.571710e-6, 0.830806e-6, 0.718277e-6],
        [0.830806e-6, 16.655602e-6, 1.800197e-6],
        [0.718277e-6, 1.800197e-6, 29.261652e-6],
    ]
)

#: distance of the rotors from the x and y axes [pybullet-drones] (m)
ARM = 0.028

#: height of the rotors above the centre of mass, assumed: about the top of the motors (m)
ROTOR_HEIGHT = 0.008

#: half of the diameter of 45 mm [bitcraze, rotors] (m)
ROTOR_RADIUS = 0.0225

_PER_RPM_SQUARED = (60 / (2 * math.pi)) ** 2  # rpm2 in a rad2/s2

#: 3.16e-10 N/rpm2 [pybullet-drones] (N s2/rad2)
THRUST_COEFFICIENT = 3.16e-10 * _PER_RPM_SQUARED

#: 7.94e-12 N m/rpm2 [pybullet-drones] (N m s2/rad2)
TORQUE_COEFFICIENT = 7.94e-12 * _PER_RPM_SQUARED

#: speed at which the thrust is 2.25 times the weight [pybullet-drones], 2274 (rad/s)
MAX_ROTOR_SPEED = math.sqrt(2.25 * MASS * 9.81 / (4 * THRUST_COEFFICIENT))

EFFECTS = RotorEffects(
    rotor_time_constant=0.072,  # [rotorpy] (s)
    rotor_inertia=5e-8,  # assumed: a rod of 0.3 g [about bitcraze] and 45 mm (kg m2)
    rotor_drag=(10.2506e-7, 10.2506e-7, 7.553e-7),  # [foerster, rotorpy] (kg/rad)
    ground_effect=1.0,
)

#: rotors 1 to 4 in the maker's order, clockwise from the front right seen from above; 1 and 3 turn counter-clockwise, so that
#: their reaction torque on the body is clockwise [bitcraze]
AIRFRAME = Airframe(
    name="crazyflie",
    mass=MASS,
    inertia=INERTIA,
    rotors=(
        Rotor("front right", (ARM, -ARM, ROTOR_HEIGHT), -1.0),
        Rotor("rear right", (-ARM, -ARM, ROTOR_HEIGHT), 1.0),
        Rotor("rear left", (-ARM, ARM, ROTOR_HEIGHT), -1.0),
        Rotor("front left", (ARM, ARM, ROTOR_HEIGHT), 1.0),
    ),
    thrust_coefficient=THRUST_COEFFICIENT,
    torque_coefficient=TORQUE_COEFFICIENT,
    max_rotor_speed=MAX_ROTOR_SPEED,
    rotor_radius=ROTOR_RADIUS,
    effects=EFFECTS,
)

#: collision speed of a crash [assumed]: a fall from 1.3 m; so light a vehicle survives more than a large one (m/s)
CRASH_SPEED = 5.0
