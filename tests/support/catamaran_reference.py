"""Independent NumPy implementation of the Strider in six degrees of freedom.

Only the parameters of hull and sea are shared with the plant. The attitude is a rotation matrix,
mass and Coriolis terms are matrices (Fossen 2021, eqs. 3.60 and 6.43), and the equations are
integrated with an eighth-order method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from plant_src.environment.sea import CALM, Sea
from plant_src.vehicles.strider_6dof import parameters as p

GRAVITY, DENSITY, MASS, INERTIA, FLOAT_HEIGHT = (
    9.81,
    998.0,
    4.11,
    np.array([0.4957, 0.2478, 0.6391]),
    0.1245,
)
LENGTH, BEAM, OFFSET, DRAUGHT, VISCOSITY = 0.979, 0.126, 0.533, 0.144 - 0.1245, 1.0034e-6
BODY = np.diag([*[MASS] * 3, *INERTIA])
INVERSE = np.linalg.inv(BODY + p.ADDED_MASS)

FULLNESS = (1 + 2 * MASS / DENSITY / (2 * LENGTH * BEAM * DRAUGHT)) / 3
AREA = 2 * FULLNESS * LENGTH * BEAM
BOX_DRAUGHT, BOX_DEPTH, PROPELLER_DISC = MASS / DENSITY / AREA, BEAM, np.pi * 0.04**2
#: x, y of ten points with the area moments of the waterplane, y^2 = b^2 + B^2 / 12 and x^2 = C L^2
#: / 12 in the mean
STATION = np.sqrt(FULLNESS * LENGTH**2 / 12 / 2)
POINTS = np.column_stack(
    [
        np.tile((2, 1, 0, -1, -2), 2) * STATION,
        np.repeat((1, -1), 5) * np.sqrt(OFFSET**2 + BEAM**2 / 12),
    ]
)
MIDDLE = -FLOAT_HEIGHT - BOX_DRAUGHT + BOX_DEPTH / 2


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


@dataclass
class Water:
    """Elevation at the strips; linear velocity and acceleration; roll, pitch and yaw rate and
    acceleration.
    """

    elevations: np.ndarray
    velocity: np.ndarray
    rates: np.ndarray
    acceleration: np.ndarray
    turning: np.ndarray


def water_at(
    sea: Sea, points: np.ndarray, time: float, offsets: np.ndarray, beam: float, draught: float
) -> Water:
    """Motion of the water at points (n, 2) of the still surface; `offsets` are their places (n, 2)
    in the hull.
    """
    k, w = sea.frequency**2 / GRAVITY, sea.frequency
    along = np.array([np.cos(sea.direction), np.sin(sea.direction)])
    wave = sea.amplitude * np.exp(
        1j * (points @ (k * along) - w * time + sea.phase) - (k * beam) ** 2 / 24
    )
    elevations = wave.real.sum(axis=1)
    below = wave * np.exp(-k * draught / 2)
    flow = np.array([along[0] * w * below, along[1] * w * below, -1j * w * below])
    change = -1j * w * flow
    linear, accelerating = flow.real.sum(axis=2), change.real.sum(axis=2)
    x, y = offsets.T
    fit = np.array([y / (y @ y), -x / (x @ x)])
    rates, turning = (np.append(fit @ field[2], 0.0) for field in (linear, accelerating))
    return Water(elevations, linear.mean(axis=1), rates, accelerating.mean(axis=1), turning)


def rigid_coriolis(spin: np.ndarray) -> np.ndarray:
    matrix = np.zeros((6, 6))
    matrix[:3, :3], matrix[3:, 3:] = MASS * skew(spin), -skew(INERTIA * spin)
    return matrix


def flow_coriolis(relative: np.ndarray) -> np.ndarray:
    momentum, matrix = p.CORIOLIS_ADDED_MASS @ relative, np.zeros((6, 6))
    matrix[:3, 3:] = matrix[3:, :3] = -skew(momentum[:3])
    matrix[3:, 3:] = -skew(momentum[3:])
    return matrix


@dataclass
class Catamaran:
    """Constant inputs and environment."""

    sea: Sea = CALM
    thrust: float = 0.0
    rudder: float = 0.0
    current: tuple[float, float] = (0.0, 0.0)
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drag: float = 1.0
    race: bool = True

    def rate(self, time: float, state: np.ndarray) -> np.ndarray:
        """Return the time derivatives of position, rotation matrix and nu."""
        place, to_world, nu = state[:3], state[3:12].reshape(3, 3), state[12:]
        surface = np.column_stack([POINTS, np.full(10, -FLOAT_HEIGHT)]) @ to_world.T + place
        water = water_at(self.sea, surface[:, :2], time, POINTS, BEAM, BOX_DRAUGHT)
        spin, current = nu[3:], to_world.T @ [*self.current, 0.0]
        orbital, flow = to_world.T @ water.velocity, to_world.T @ water.acceleration
        drifting = nu - [*current, 0, 0, 0]
        relative = drifting - [*orbital, 0, 0, 0]
        lift, wetness = self.buoyancy(to_world, place[2], water.elevations)
        inertia_of_water = MASS * np.array(
            [(POINTS[:, 1] ** 2).mean(), (POINTS[:, 0] ** 2).mean(), 0]
        )
        pressure = MASS * np.concatenate(
            [flow, np.cross([0, 0, -FLOAT_HEIGHT - BOX_DRAUGHT / 2], flow)]
        )
        pressure[3:] += inertia_of_water * water.turning
        load = (
            lift
            + wetness * (self.loads(relative, water.rates) + pressure)
            + self.driving(nu[:3] - to_world.T @ self.wind)
        )
        load -= rigid_coriolis(spin) @ drifting + flow_coriolis(relative) @ relative
        load += p.ADDED_MASS @ [*(flow - skew(spin) @ orbital), *water.turning]
        acceleration = INVERSE @ load - [*(skew(spin) @ current), 0, 0, 0]
        return np.concatenate([to_world @ nu[:3], (to_world @ skew(spin)).ravel(), acceleration])

    def buoyancy(
        self, to_world: np.ndarray, height: float, elevations: np.ndarray
    ) -> tuple[np.ndarray, float]:
        """Sum over the boxes of buoyancy and its moment, with the weight, and the wetness."""
        up = to_world[2]
        load, wetness = np.concatenate([-MASS * GRAVITY * up, np.zeros(3)]), 0.0
        extent = max(BOX_DEPTH * abs(up[2]), BEAM * abs(up[1]), STATION * abs(up[0]))
        for (x, y), elevation in zip(POINTS, elevations, strict=True):
            box = np.array([x, y, MIDDLE])
            share = np.clip((elevation - height - up @ box) / extent + 0.5, 0, 1)
            centre = box - [0, 0, (1 - share) * BOX_DEPTH / 2 * BOX_DEPTH * up[2] / extent]
            force = DENSITY * GRAVITY * AREA / 10 * BOX_DEPTH * share * up
            load += np.concatenate([force, np.cross(centre, force)])
            wet = min(1.0, share * BOX_DEPTH / (BOX_DRAUGHT / 2))
            wetness += (1 - (1 - wet) ** 2) / 10
        return load, wetness

    def driving(self, air: np.ndarray) -> np.ndarray:
        return np.array([self.thrust, 0, 0, 0, 0, 0]) - [
            *(0.1 * np.abs(air[:2]) * air[:2]),
            0,
            0,
            0,
            0,
        ]

    def loads(self, relative: np.ndarray, rates: np.ndarray) -> np.ndarray:
        u, v, w, _, _, r = relative
        roll, pitch, _ = relative[3:] - rates
        load = np.zeros(6)
        load[2:5] -= np.array(p.DAMPING) * [w, roll, pitch]
        for x, y in p.DRAG_POINTS:
            speed = w + roll * y - pitch * x
            load += np.array([0, 0, 1, y, -x, 0]) * -p.POINT_DRAG * speed * abs(speed)
        side, moment = (
            2 * (-3.899501881 * v + 1.774273356 * r),
            2 * (-1.774273356 * v - 0.807294377 * r),
        )
        drag = self.resistance(u)
        load += [drag, side, 0, -p.HULL_FORCE_HEIGHT * side, p.HULL_FORCE_HEIGHT * drag, moment]
        square = u * abs(u) + (
            2 * max(self.thrust, 0.0) / DENSITY / PROPELLER_DISC if self.race else 0.0
        )
        angle = self.rudder - np.arctan2(np.sign(square) * (v - 0.34727 * r), np.sqrt(abs(square)))
        lift = (
            DENSITY
            / 2
            * 1.2
            * 0.0064
            * square
            * np.sin(np.pi / 2 * max(-1.0, min(1.0, angle / np.deg2rad(30))))
        )
        ahead, abeam = -lift * np.sin(self.rudder), lift * np.cos(self.rudder)
        load += [
            ahead,
            abeam,
            0,
            -p.RUDDER_HEIGHT * abeam,
            p.RUDDER_HEIGHT * ahead,
            -0.34727 * abeam,
        ]
        return load

    def resistance(self, u: float) -> float:
        """ITTC-57 and the residuary curve, on bottoms and sides of both hulls."""
        friction = 0.075 / (np.log10(max(abs(u) * LENGTH / VISCOSITY, 1e4)) - 2) ** 2
        froude = u / np.sqrt(GRAVITY * LENGTH)
        residuary = 2 * 4.6e-3 / ((froude / 0.4) ** 2 + (0.4 / froude) ** 2) if froude else 0.0
        wetted = 2 * LENGTH * (FULLNESS * BEAM + 2 * DRAUGHT)
        return self.drag * -DENSITY / 2 * wetted * (friction + residuary) * u * abs(u)

    def simulate(self, nu: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Positions at these times, from rest attitude in the origin."""
        start = np.concatenate([[0, 0, FLOAT_HEIGHT], np.eye(3).ravel(), nu])
        solution = solve_ivp(
            self.rate, (0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12
        )
        return solution.y[:3].T
