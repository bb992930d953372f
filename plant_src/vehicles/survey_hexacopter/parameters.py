"""Parameters of the survey hexacopter with their sources, in SI units.

Body frame: x forward, y left, z up, origin at the centre of mass. The vehicle is of the Tarot FY680 class (folding carbon fibre
frame, 0.68 m between opposite motors, 16 inch propellers) and carries a survey camera.

Sources: [eagle] multicopter parameters of the Hexarotor 680 of the eagle-mpc project of the Institut de Robòtica i Informàtica
Industrial, Barcelona (Martí-Saumell et al., "Full-body torque-level nonlinear model predictive control for aerial
manipulation", 2021): frame, propeller coefficients, largest thrust of Tarot 4008 motors with 1660 propellers; [mrs]
uavs/f550.yaml of ctu-mrs/mrs_multirotor_simulator; [rotors] component constants of ethz-asl/rotors_simulator. Values without a
source are assumptions, made by adding up components of this class.
"""

from __future__ import annotations

import math

import numpy as np

from ..multirotor.airframe import Airframe, Rotor, RotorEffects

#: distance of the motors from the middle of the frame [eagle] (m)
ARM = 0.68 / 2

#: height of the rotors above the centre of mass, assumed: batteries and camera hang below the frame (m)
ROTOR_HEIGHT = 0.10

ROTOR_RADIUS = 0.4064 / 2  # [eagle] (m)

_AIR_DENSITY = 1.22  # [eagle] (kg/m3)
_C_T, _C_P = 0.062, 0.02  # thrust = C_T rho (n / 2 pi)^2 D^4, power = C_P rho (n / 2 pi)^3 D^5 [eagle]
_DIAMETER = 2 * ROTOR_RADIUS

#: thrust over squared speed, 5.23e-5 [eagle] (N s2/rad2)
THRUST_COEFFICIENT = _C_T * _AIR_DENSITY * _DIAMETER**4 / (2 * math.pi) ** 2

#: torque over squared speed, from power over speed, 1.09e-6 [eagle] (N m s2/rad2)
TORQUE_COEFFICIENT = _C_P * _AIR_DENSITY * _DIAMETER**5 / (2 * math.pi) ** 3

#: speed at which the thrust of a rotor is the weight of 2.53 kg [eagle], 689 (rad/s)
MAX_ROTOR_SPEED = math.sqrt(2.53 * 9.81 / THRUST_COEFFICIENT)

#: masses assumed (kg): middle of the frame with electronics, batteries, camera on its gimbal; each arm; each motor with propeller
HUB_MASS, BATTERY_MASS, CAMERA_MASS, ARM_MASS, MOTOR_MASS = 1.40, 1.50, 0.50, 0.08, 0.15

MASS = HUB_MASS + BATTERY_MASS + CAMERA_MASS + 6 * (ARM_MASS + MOTOR_MASS)

#: heights of these above the middle plane of the arms, assumed (m)
_HEIGHTS = {"hub": 0.0, "battery": -0.06, "camera": -0.14, "arms": 0.0, "motors": 0.02}


def _inertia() -> np.ndarray:
    """Return the inertia tensor (kg m2) of a disc, a box, a sphere, six rods and six points about their common centre of mass."""
    masses = {"hub": HUB_MASS, "battery": BATTERY_MASS, "camera": CAMERA_MASS, "arms": 6 * ARM_MASS, "motors": 6 * MOTOR_MASS}
    centre = sum(masses[part] * _HEIGHTS[part] for part in masses) / MASS
    own = np.array(
        [
            HUB_MASS * 0.11**2 * np.array([1 / 4, 1 / 4, 1 / 2]),
            BATTERY_MASS / 12 * np.array([0.09**2 + 0.06**2, 0.15**2 + 0.06**2, 0.15**2 + 0.09**2]),
            CAMERA_MASS * 2 / 5 * 0.05**2 * np.ones(3),
            6 * ARM_MASS * ARM**2 / 3 * np.array([1 / 2, 1 / 2, 1.0]),
            6 * MOTOR_MASS * ARM**2 * np.array([1 / 2, 1 / 2, 1.0]),
        ]
    )
    steiner = sum(masses[part] * (_HEIGHTS[part] - centre) ** 2 for part in masses)
    x, y, z = own.sum(axis=0)
    return np.diag([x + steiner, y + steiner, z])


INERTIA = _inertia()

EFFECTS = RotorEffects(
    rotor_time_constant=0.05,  # assumed: 0.03 s for propellers of 9 inch [mrs], longer for heavier ones (s)
    rotor_inertia=3.5e-4,  # assumed: a rod of 22 g and 0.4064 m, and the bell of the motor (kg m2)
    rotor_drag=(8.06428e-5, 8.06428e-5, 0.0),  # [rotors], for propellers of 10 inch (kg/rad)
    body_drag=(0.031, 0.031, 0.049),  # assumed: areas of 0.05 m2 from the side and 0.08 m2 from above, drag coefficient 1 (kg/m)
    ground_effect=1.0,
)
_LABELS = ("front left", "left", "rear left", "rear right", "right", "front right")


def _rotor(number: int) -> Rotor:
    """Return a rotor; they follow counter-clockwise from 30 degrees left of the nose with alternating torque signs [eagle]."""
    angle = math.radians(30 + 60 * number)
    return Rotor(_LABELS[number], (ARM * math.cos(angle), ARM * math.sin(angle), ROTOR_HEIGHT), (-1.0) ** number)


AIRFRAME = Airframe(
    name="survey_hexacopter",
    mass=MASS,
    inertia=INERTIA,
    rotors=tuple(map(_rotor, range(6))),
    thrust_coefficient=THRUST_COEFFICIENT,
    torque_coefficient=TORQUE_COEFFICIENT,
    max_rotor_speed=MAX_ROTOR_SPEED,
    rotor_radius=ROTOR_RADIUS,
    effects=EFFECTS,
)

#: collision speed of a crash: a fall from 0.495 m, 1.5 times the 13 inches of a limit drop test. The landing gear of a small
#: rotorcraft must withstand it without collapsing (14 CFR 27.725 and 27.727) (m/s)
CRASH_SPEED = 3.1
