"""Parameters of the quadcopter with their sources, in SI units. Body frame: x forward, y left, z up.

Sources: [model] the simulation model published with the paper "An Open Simulation Strategy for Rapid Control Design in Aerial
and Maritime Drone Teams" (github.com/OmarVelascoAnrar/UAV_USV_Simulator, commit 1eee757), converted from its body frame
x forward, y right, z down: y and z of vectors and the products of inertia Ixy, Ixz change their sign. "Forward" is the arm
of rotor 1; the hull lies along the diagonal between two arms, hence the large Ixy. [maker] Parrot's data sheet of the
AR.Drone 2.0.
"""

from __future__ import annotations

import numpy as np

from ..multirotor.airframe import Airframe, Rotor

#: mass of body and four propellers [model]: 0.4038924 kg + 4 * 0.010 kg as summed there (kg)
MASS = 0.443892

#: inertia tensor about the centre of mass with locked propellers [model] (kg m2)
INERTIA = np.array(
    [
        [0.002835, 0.000978, 0.000116],
        [0.000978, 0.002821, -0.000111],
        [0.000116, -0.000111, 0.005131],
    ]
)

#: centre of mass in the body frame of the published model [model] (m)
CENTRE_OF_MASS = np.array([-0.003329, 0.001981, -0.000577])

#: positions of the rotors front, left, rear, right from the centre of mass [model] (m)
ROTORS = np.array(
    [
        [0.181777, -0.000828, 0.006153],
        [0.000096, 0.181531, 0.006153],
        [-0.181505, 0.000016, 0.006153],
        [0.000096, -0.181499, 0.006153],
    ]
)

#: sign of the reaction torque of each rotor on the body about its z axis [model]
ROTOR_SENSES = (1.0, -1.0, 1.0, -1.0)

#: thrust = THRUST_COEFFICIENT * speed^2 [model; Table 2 of the paper misprints the power] (N s2/rad2)
THRUST_COEFFICIENT = 9.148e-6

#: torque = TORQUE_COEFFICIENT * speed^2 [model; the paper's 2.38e-9 cannot turn the vehicle] (N m s2/rad2)
TORQUE_COEFFICIENT = 2.38e-7

#: 5000 revolutions per minute, rounded as in the model [model, paper] (rad/s)
MAX_ROTOR_SPEED = 5000 * 0.10471976

#: radius of the 8 inch propellers [maker], used by the ground effect only (m)
ROTOR_RADIUS = 0.1016

#: gravitational acceleration [model] (m/s2)
GRAVITY = 9.81

#: collision speed of a crash: a fall from 0.495 m, 1.5 times the 13 inches of a limit drop test. The landing gear of a small
#: rotorcraft must withstand it without collapsing (14 CFR 27.725 and 27.727) (m/s)
CRASH_SPEED = 3.1


AIRFRAME = Airframe(
    name="ar_drone",
    mass=MASS,
    inertia=INERTIA,
    rotors=tuple(
        Rotor(label, tuple(position), sign)
        for label, position, sign in zip(("front", "left", "rear", "right"), ROTORS.tolist(), ROTOR_SENSES, strict=True)
    ),
    thrust_coefficient=THRUST_COEFFICIENT,
    torque_coefficient=TORQUE_COEFFICIENT,
    max_rotor_speed=MAX_ROTOR_SPEED,
    rotor_radius=ROTOR_RADIUS,
    gravity=GRAVITY,
)
