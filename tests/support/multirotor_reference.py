"""Independent implementation of the multirotors from their data sheets; no code is shared with the
plant.

The attitude is a rotation matrix, the body frame is forward-right-down at the centre of mass, and
the rotor speeds are states that lag behind their commands. The ground effect is the published
formula for a square of rotors and its counterpart for a hexagon; the air speed in the plane of a
rotor over its induced velocity in hover reduces it (Cheeseman and Bennett). The equations are
integrated with an eighth-order method and tight tolerances.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81
AIR_DENSITY = 1.225
FLIP = np.diag([1.0, -1.0, -1.0])  # forward-right-down <-> forward-left-up


@dataclass(frozen=True)
class Vehicle:
    """Data sheet, body frame forward-left-up; `spin_directions` of the rotors seen from above: +1
    counter-clockwise.
    """

    mass: float
    inertia: np.ndarray
    rotors: np.ndarray
    spin_directions: Sequence[int]
    thrust: float
    torque: float
    max_rotor_speed: float
    radius: float
    inflow_reduction: Callable[
        [float], float
    ]  # height (m) -> relative reduction of the inflow by the surface
    time_constant: float
    rotor_inertia: float
    rotor_drag: np.ndarray
    body_drag: np.ndarray

    @property
    def hover_speed(self) -> float:
        return float(np.sqrt(self.mass * GRAVITY / len(self.rotors) / self.thrust))


def square_ground_effect(radius: float, side: float) -> Callable[[float], float]:
    """Sanchez-Cuevas, Heredia and Ollero 2017, equation 4, for four rotors at the corners of a
    square.
    """

    def inflow_reduction(z: float) -> float:
        own, beside = (radius / (4 * z)) ** 2, radius**2 * z / np.sqrt((side**2 + 4 * z**2) ** 3)
        return own + beside + radius**2 / 2 * z / np.sqrt((2 * side**2 + 4 * z**2) ** 3)

    return inflow_reduction


def hexagon_ground_effect(radius: float, arm: float) -> Callable[[float], float]:
    """Ground effect of six rotors on a hexagon: two neighbours at one arm length, two at sqrt(3)
    and one at 2.
    """

    def inflow_reduction(z: float) -> float:
        image = lambda d: radius**2 / 2 * z / (d**2 + 4 * z**2) ** 1.5  # noqa: E731
        return (
            (radius / (4 * z)) ** 2 + 2 * image(arm) + 2 * image(np.sqrt(3) * arm) + image(2 * arm)
        )

    return inflow_reduction


def _hexagon_inertia() -> np.ndarray:
    """Inertia of the survey hexacopter from its components, by moments about the frame's centre and
    the parallel axis theorem.
    """
    hub, battery, camera, arm, motor, length = 1.4, 1.5, 0.5, 0.08, 0.15, 0.34
    mass = hub + battery + camera + 6 * (arm + motor)
    centre = (battery * -0.06 + camera * -0.14 + 6 * motor * 0.02) / mass
    ring = 6 * (arm / 3 + motor) * length**2
    z = hub * 0.11**2 / 2 + battery * (0.15**2 + 0.09**2) / 12 + camera * 0.4 * 0.05**2 + ring
    level = hub * 0.11**2 / 4 + camera * 0.4 * 0.05**2 + ring / 2
    level += battery * 0.06**2 + camera * 0.14**2 + 6 * motor * 0.02**2 - mass * centre**2
    x, y = (level + battery * (edge**2 + 0.06**2) / 12 for edge in (0.09, 0.15))
    return np.diag([x, y, z])


_ANGLES = np.deg2rad([30, 90, 150, 210, 270, 330])
_KF = 0.062 * 1.22 * 0.4064**4 / (4 * np.pi**2)
VEHICLES = {
    "crazyflie": Vehicle(
        mass=0.027,
        inertia=np.array(
            [
                [16.571710, 0.830806, 0.718277],
                [0.830806, 16.655602, 1.800197],
                [0.718277, 1.800197, 29.261652],
            ]
        )
        * 1e-6,
        rotors=np.array(
            [
                [0.028, -0.028, 0.008],
                [-0.028, -0.028, 0.008],
                [-0.028, 0.028, 0.008],
                [0.028, 0.028, 0.008],
            ]
        ),
        spin_directions=(1, -1, 1, -1),
        thrust=2.218e-8,
        torque=1.63e-10,
        max_rotor_speed=2501.0,
        radius=0.0225,
        inflow_reduction=square_ground_effect(0.0225, 0.056),
        time_constant=0.072,
        rotor_inertia=5e-8,
        rotor_drag=np.array([10.2506e-7, 10.2506e-7, 7.553e-7]),
        body_drag=np.zeros(3),
    ),
    "survey_hexacopter": Vehicle(
        mass=4.78,
        inertia=_hexagon_inertia(),
        rotors=np.array([0.34 * np.cos(_ANGLES), 0.34 * np.sin(_ANGLES), np.full(6, 0.10)]).T,
        spin_directions=(-1, 1, -1, 1, -1, 1),
        thrust=_KF,
        torque=_KF * 0.02 * 0.4064 / (0.062 * 2 * np.pi),
        max_rotor_speed=float(np.sqrt(2.53 * GRAVITY / _KF)),
        radius=0.2032,
        inflow_reduction=hexagon_ground_effect(0.2032, 0.34),
        time_constant=0.05,
        rotor_inertia=3.5e-4,
        rotor_drag=np.array([8.06428e-5, 8.06428e-5, 0.0]),
        body_drag=np.array([0.031, 0.031, 0.049]),
    ),
}


@dataclass(frozen=True)
class HeldInputs:
    """Constant inputs during a segment of a flight: commands, loads and wind (world frame), height
    above a surface (m).
    """

    duration: float
    command: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    wind: np.ndarray
    height: float


def initial_state(
    position: Sequence[float],
    velocity: Sequence[float],
    rates: Sequence[float],
    speed: float,
    count: int,
) -> np.ndarray:
    """Return the state of a level vehicle heading along x; velocity in the world frame, rates
    forward-left-up.
    """
    return np.concatenate([position, velocity, FLIP.ravel(), FLIP @ rates, np.full(count, speed)])


#: function of segment number, velocity (world), up axis and rates (forward-left-up) at its start ->
#: inputs
InputFunction = Callable[[int, np.ndarray, np.ndarray, np.ndarray], HeldInputs]


def simulate_flight(
    vehicle: Vehicle, state: np.ndarray, count: int, pilot: InputFunction
) -> np.ndarray:
    """Return the state after each of `count` segments."""
    states = []
    for k in range(count):
        held = pilot(k, state[3:6], FLIP @ state[12:15], FLIP @ state[15:18])
        rate = lambda _t, x, held=held: _rate(vehicle, x, held)  # noqa: E731
        state = solve_ivp(rate, (0, held.duration), state, "DOP853", rtol=1e-11, atol=1e-11).y[
            :, -1
        ]
        states.append(state)
    return np.array(states)


def _rate(vehicle: Vehicle, state: np.ndarray, held: HeldInputs) -> np.ndarray:
    velocity, to_world, rates, speeds = (
        state[3:6],
        state[6:15].reshape(3, 3),
        state[15:18],
        state[18:],
    )
    speed_rates = (
        np.clip(held.command, 0, vehicle.max_rotor_speed) - speeds
    ) / vehicle.time_constant
    air = to_world.T @ (held.wind - velocity)  # velocity of the air over the body
    places, turning, spin = vehicle.rotors @ FLIP, np.array(vehicle.spin_directions), _cross(rates)
    flow, thrust = air - places @ spin.T, vehicle.thrust * speeds**2
    carried_away = (
        1
        + (flow[:, 0] ** 2 + flow[:, 1] ** 2) * 2 * AIR_DENSITY * np.pi * vehicle.radius**2 / thrust
    )
    gain = 1 / (1 - vehicle.inflow_reduction(max(held.height, vehicle.radius / 2)) / carried_away)
    loads = speeds[:, None] * vehicle.rotor_drag * flow
    loads[:, 2] -= gain * thrust
    force = loads.sum(axis=0) + np.sqrt(air @ air) * vehicle.body_drag * air
    swirl = (
        places.T @ loads
    )  # its antisymmetric part is the sum of the moments of the rotors' loads
    torque = np.array(
        [swirl[1, 2] - swirl[2, 1], swirl[2, 0] - swirl[0, 2], swirl[0, 1] - swirl[1, 0]]
    )
    torque[2] += turning @ (vehicle.torque * speeds**2 + vehicle.rotor_inertia * speed_rates)
    inertia = FLIP @ vehicle.inertia @ FLIP
    momentum = inertia @ rates - np.array(
        [0, 0, vehicle.rotor_inertia * (turning @ speeds)]
    )  # z points down
    acceleration = (to_world @ force + held.force) / vehicle.mass - [0, 0, GRAVITY]
    angular = np.linalg.solve(inertia, torque + to_world.T @ held.torque - spin @ momentum)
    return np.concatenate([velocity, acceleration, (to_world @ spin).ravel(), angular, speed_rates])


def _cross(a: np.ndarray) -> np.ndarray:
    """The matrix that takes b to the cross product of a and b."""
    x, y, z = a
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
