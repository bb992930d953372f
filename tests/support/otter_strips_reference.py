"""Independent NumPy implementation of the Otter whose pontoons are cut by the surface; body axes
forward-left-up.

The data of hull, payload and propellers are those of `otter_reference.py`; from the plant come only
the form of the pontoons and the coefficients of the wind. The attitude is a rotation matrix, mass
and Coriolis terms are matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from boat_reference import coriolis, load_at
from catamaran_reference import skew, water_at
from otter_reference import (
    BEAM,
    C_B,
    HOERNER,
    HULL_MASS,
    K_AHEAD,
    K_ASTERN,
    N_MAX,
    N_MIN,
    PONTOON_OFFSET,
    RADII,
    RHO,
    G,
    L,
)
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from plant_src.environment.sea import CALM, Sea
from plant_src.vehicles.otter import parameters as p

AREA, TOP, HULL_CENTRE = 0.75 * 2 * L * BEAM, 0.15, np.array([0.2, 0.0, 0.2])
SPACING = np.sqrt(p.LONGITUDINAL_MOMENT / AREA / 2)
OFFSET = np.sqrt(p.TRANSVERSE_MOMENT / AREA)
#: places of the strips ahead and to port of the centre of flotation, and the heights of their
#: bottoms above O
POINTS = np.column_stack([np.tile((2, 1, 0, -1, -2), 2) * SPACING, np.repeat((1, -1), 5) * OFFSET])
BOTTOMS = -np.tile(HULL_MASS / RHO / AREA * (1 + np.arange(2, -3, -1) * 0.4 / (2 * SPACING)), 2)
DEPTHS, PLACES = TOP - BOTTOMS, POINTS + np.array([-0.2, 0.0])


@dataclass
class OtterOnStrips:
    """Constant environment and shaft speeds."""

    payload: float = 25.0
    sea: Sea = CALM
    current: tuple[float, float] = (0.0, 0.0)
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shafts: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        place = np.array([0.05, 0.0, 0.35])
        self.mass = HULL_MASS + self.payload
        self.volume = self.mass / RHO
        self.centre = (HULL_MASS * HULL_CENTRE + self.payload * place) / self.mass
        inertia = HULL_MASS * np.diag(RADII**2)
        for mass, point in ((HULL_MASS, HULL_CENTRE), (self.payload, place)):
            inertia -= mass * np.linalg.matrix_power(skew(point - self.centre), 2)
        self.rest = fsolve(self._unbalanced, [-0.02, 0.0, 0.01], xtol=1e-12)
        self.to_level = Rotation.from_euler("ZYX", [0, *self.rest[:0:-1]]).as_matrix()
        _, moment, _ = self.displaced(self.to_level[2], self.rest[0], np.zeros(10))
        self.level_centre, self.buoyancy_centre = (
            self.to_level @ self.centre,
            self.to_level @ (moment / self.volume),
        )
        self.inertia = self.to_level @ inertia @ self.to_level.T
        self.draughts = -self.rest[0] - np.column_stack([PLACES, BOTTOMS]) @ self.to_level[2]
        self._set_up_mass(inertia)

    def _set_up_mass(self, inertia: np.ndarray) -> None:
        to_centre = np.block([[np.eye(3), -skew(self.level_centre)], [np.zeros((3, 3)), np.eye(3)]])
        body = np.zeros((6, 6))
        body[:3, :3], body[3:, 3:] = self.mass * np.eye(3), self.inertia
        surge = 2.7 * RHO * (HULL_MASS / RHO) ** (5 / 3) / L**2
        self.added = np.diag(
            [surge, 1.5 * HULL_MASS, HULL_MASS, *(np.array([0.2, 0.8, 1.7]) * np.diag(inertia))]
        )
        self.mass_matrix = to_centre.T @ body @ to_centre + self.added
        lever = self.volume * (self.buoyancy_centre[2] - self.level_centre[2])
        self.stiffness = (
            RHO * G * np.array([AREA, p.TRANSVERSE_MOMENT + lever, p.LONGITUDINAL_MOMENT + lever])
        )
        m = np.diag(self.mass_matrix)
        natural = np.sqrt(self.stiffness / m[2:5])
        self.linear = np.array(
            [
                24.4 * G / (6 * 0.5144),
                m[1],
                *(2 * np.array([0.3, 0.2, 0.4]) * natural * m[2:5]),
                m[5],
            ]
        )
        self.draught = self.volume / (2 * C_B * BEAM * L)
        self.drag = (
            RHO / 2 * self.draught * np.interp(BEAM / (2 * self.draught), *HOERNER.T) * L / 20
        )

    def _unbalanced(self, rest: np.ndarray) -> np.ndarray:
        up = Rotation.from_euler("ZYX", [0, rest[2], rest[1]]).as_matrix()[2]
        volume, moment, _ = self.displaced(up, rest[0], np.zeros(10))
        turning = np.cross(RHO * moment - self.mass * self.centre, up)
        return np.array([RHO * volume - self.mass, *turning[:2]])

    def displaced(
        self, up: np.ndarray, height: float, elevations: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Return volume (m3), volume times centre (m4) and the immersed shares of the boxes."""
        extents = np.maximum(
            np.maximum(DEPTHS * abs(up[2]), BEAM * abs(up[1])), SPACING * abs(up[0])
        )
        middles = np.column_stack([PLACES, TOP - DEPTHS / 2])
        shares = np.clip((elevations - height - middles @ up) / extents + 0.5, 0, 1)
        volumes = AREA / 10 * DEPTHS * shares
        down = (1 - shares) * DEPTHS / 2 * DEPTHS * up[2] / extents
        return volumes.sum(), volumes @ (middles - np.outer(down, [0, 0, 1])), shares

    def rate(
        self, time: float, place: np.ndarray, attitude: np.ndarray, nu: np.ndarray
    ) -> np.ndarray:
        """Return nu' in level axes; the attitude is the rotation matrix from hull to world."""
        to_world, spin = attitude @ self.to_level.T, nu[3:]
        surface = np.column_stack([PLACES, np.zeros(10)]) @ attitude.T + place
        water = water_at(self.sea, surface[:, :2], time, POINTS, BEAM, self.volume / AREA)
        current, orbital = to_world.T @ [*self.current, 0.0], to_world.T @ water.velocity
        drifting = nu - [*current, 0, 0, 0]
        flow = drifting - [*orbital, 0, 0, 0]
        up = attitude[2]
        volume, moment, shares = self.displaced(up, place[2], water.elevations)
        static = G * np.concatenate(
            [(RHO * volume - self.mass) * up, np.cross(RHO * moment - self.mass * self.centre, up)]
        )
        wet = np.minimum(1, shares * DEPTHS / (np.maximum(self.draughts, 1e-3) / 2))
        weights = np.maximum(self.draughts, 1e-3)
        wetness = (1 - (1 - wet) ** 2) @ weights / weights.sum()
        acceleration = to_world.T @ water.acceleration
        pressure = load_at(self.buoyancy_centre, self.mass * acceleration)
        pressure[3:5] += self.mass * np.array([OFFSET**2, 2 * SPACING**2]) * water.turning[:2]
        load = np.kron(np.eye(2), self.to_level) @ static + wetness * (
            self.damping(flow, water.rates) + pressure
        )
        load += self.driving(nu[:3], to_world)
        lever, turn = skew(self.level_centre), self.mass * skew(spin)
        rigid = np.block(
            [
                [turn, -turn @ lever],
                [lever @ turn, -lever @ turn @ lever - skew(self.inertia @ spin)],
            ]
        )
        load -= rigid @ drifting + coriolis(self.added, flow)
        load += self.added @ [*(acceleration - skew(spin) @ orbital), *water.turning]
        return np.linalg.solve(self.mass_matrix, load) - [*(skew(spin) @ current), 0, 0, 0]

    def damping(self, flow: np.ndarray, rates: np.ndarray) -> np.ndarray:
        nu = flow - [0, 0, 0, *rates]
        load = -self.linear * nu * [1, 1, 1, 1, 1, 1 + 10 * abs(nu[5])]
        for x in np.linspace(-L / 2, L / 2, 21):
            speed = np.array([0, nu[1] + x * nu[5], nu[2] - x * nu[4]])
            load += load_at([x, 0, 0], -self.drag * abs(speed) * speed)
        return load

    def driving(self, velocity: np.ndarray, to_world: np.ndarray) -> np.ndarray:
        n = np.clip(self.shafts, N_MIN, N_MAX)
        port, starboard = np.where(n > 0, K_AHEAD, K_ASTERN) * n * abs(n)
        air = velocity - to_world.T @ self.wind
        areas = 1.225 / 2 * np.array(p.PROJECTED_AREAS) * p.WIND_COEFFICIENTS
        gust = areas * (abs(velocity[:2]) * velocity[:2] - abs(air[:2]) * air[:2])
        thrust = np.array([port + starboard, 0, 0, 0, 0, PONTOON_OFFSET * (starboard - port)])
        return thrust + load_at([0, 0, 0.25], [*gust, 0])

    def simulate(self, times: np.ndarray) -> np.ndarray:
        """Return positions of the centre of mass (m) at these times from rest, with the centre
        above the world's origin.
        """
        origin = -self.level_centre[:2]
        start = np.concatenate([[*origin, self.rest[0]], self.to_level.ravel(), np.zeros(6)])

        def derivative(time: float, state: np.ndarray) -> np.ndarray:
            attitude, nu = state[3:12].reshape(3, 3), state[12:]
            spin = attitude @ self.to_level.T @ skew(nu[3:]) @ self.to_level
            velocity = attitude @ self.to_level.T @ nu[:3]
            return np.concatenate(
                [velocity, spin.ravel(), self.rate(time, state[:3], attitude, nu)]
            )

        solution = solve_ivp(
            derivative, (0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-10, atol=1e-11
        )
        return np.array(
            [state[:3] + state[3:12].reshape(3, 3) @ self.centre for state in solution.y.T]
        )
