"""Independent implementation of the AR.Drone and the planar Strider from the fact sheet of the
original system.

No code is shared with the plant. The quadcopter uses the original's body frame (x forward, y right,
z down) and a rotation matrix instead of a quaternion. Both vehicles are integrated with an
eighth-order method and tight tolerances.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
FLIP = np.diag([1.0, -1.0, -1.0])  # forward-right-down <-> forward-left-up

QUADCOPTER_MASS = 0.443892
_PRODUCTS = {"xy": -0.000978, "xz": -0.000116, "yz": -0.000111}
_INERTIA = np.array(
    [
        [0.002835, _PRODUCTS["xy"], _PRODUCTS["xz"]],
        [_PRODUCTS["xy"], 0.002821, _PRODUCTS["yz"]],
        [_PRODUCTS["xz"], _PRODUCTS["yz"], 0.005131],
    ]
)
_ROTORS = np.array(
    [
        [0.181777, 0.000828, -0.006153],
        [0.000096, -0.181531, -0.006153],
        [-0.181505, -0.000016, -0.006153],
        [0.000096, 0.181499, -0.006153],
    ]
)
_UP_TORQUE = (1, -1, 1, -1)
MAX_ROTOR_SPEED = 5000 * 0.10471976
#: N s2/rad2, identified from a flight (docs/validation_measurements.md); the original system has
#: 9.148e-6
THRUST_COEFFICIENT = 8.24e-6
HOVER_SPEED = np.sqrt(QUADCOPTER_MASS * GRAVITY / 4 / THRUST_COEFFICIENT)

Segments = Sequence[tuple[float, np.ndarray]]  # (duration, held inputs)


def integrate(
    rate: Callable[[np.ndarray, np.ndarray], np.ndarray], state: np.ndarray, segments: Segments
) -> np.ndarray:
    """Return the state at the end of each segment."""
    states = []
    for duration, inputs in segments:
        held = lambda _t, x, inputs=inputs: rate(x, inputs)  # noqa: E731
        state = solve_ivp(held, (0, duration), state, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
        states.append(state)
    return np.array(states)


def quadcopter_state(
    position: Sequence[float], yaw: float, velocity: Sequence[float], rates: Sequence[float]
) -> np.ndarray:
    """Return position and velocity (world), rotation matrix and rates (forward-right-down); `rates`
    are forward-left-up.
    """
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return np.concatenate([position, velocity, (turn @ FLIP).ravel(), FLIP @ rates])


def quadcopter_rate(state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Return the time derivative by Newton-Euler; inputs: four rotor speeds, external force and
    torque (world).
    """
    velocity, to_world, rates = state[3:6], state[6:15].reshape(3, 3), state[15:18]
    squared = np.clip(inputs[:4], 0, MAX_ROTOR_SPEED) ** 2
    force, torque = np.zeros(3), np.zeros(3)
    for arm, sense, square in zip(_ROTORS, _UP_TORQUE, squared, strict=True):
        thrust = np.array([0, 0, -THRUST_COEFFICIENT * square])
        force += thrust
        torque += np.cross(arm, thrust) + np.array([0, 0, -sense * 2.38e-7 * square])
    acceleration = (to_world @ force + inputs[4:7]) / QUADCOPTER_MASS - np.array([0, 0, GRAVITY])
    torque += to_world.T @ inputs[7:10]
    p, q, r = rates
    spin = np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]])
    angular = np.linalg.solve(_INERTIA, torque - np.cross(rates, _INERTIA @ rates))
    return np.concatenate([velocity, acceleration, (to_world @ spin).ravel(), angular])


def rotational_energy(rates: np.ndarray) -> float:
    """Return the rotational energy (J) of the quadcopter for rates in forward-left-up."""
    flipped = FLIP @ rates
    return float(flipped @ _INERTIA @ flipped) / 2


VESSEL_MASS, VESSEL_MOMENT = 4.11, 0.6391


def vessel_rate(state: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Return the time derivative of x, y, yaw, surge, sway, yaw rate; inputs: thrust, rudder angle,
    force and torque (world).
    """
    yaw, u, v, r = state[2:]
    thrust, delta = inputs[:2]
    heading = np.array([np.cos(yaw), np.sin(yaw)])
    abeam = np.array([-np.sin(yaw), np.cos(yaw)])
    angle = delta - np.arctan((v - 0.34727 * r) / u)
    saturated = max(-1.0, min(1.0, angle / np.deg2rad(30)))
    lift = 0.5 * 998 * 1.2 * 0.0064 * u**2 * np.sin(np.pi / 2 * saturated)
    side = lift * np.cos(delta)
    surge_force = thrust - lift * np.sin(delta) - 0.1 * np.sign(u) * u**2 + heading @ inputs[2:4]
    side_force = (
        side
        - 0.1 * np.sign(v) * v**2
        + 2 * (-3.899501881 * v + 1.774273356 * r)
        + abeam @ inputs[2:4]
    )
    moment = -0.34727 * side + 2 * (-1.774273356 * v - 0.807294377 * r) + inputs[7]
    x_rate, y_rate = u * heading + v * abeam
    return np.array(
        [
            x_rate,
            y_rate,
            r,
            surge_force / VESSEL_MASS + v * r,
            side_force / VESSEL_MASS - u * r,
            moment / VESSEL_MOMENT,
        ]
    )
