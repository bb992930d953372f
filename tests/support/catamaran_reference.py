"""Independent NumPy implementation of the Strider in six degrees of freedom.

Only the parameters of hull and sea are shared with the plant. The attitude is a rotation matrix, mass and Coriolis terms are
matrices (Fossen 2021, eqs. 3.60 and 6.43), and the equations are integrated with an eighth-order method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from plant_src.environment.sea import CALM, Sea
from plant_src.vehicles.strider_6dof import parameters as p

GRAVITY, DENSITY, MASS, INERTIA, FLOAT_HEIGHT = 9.81, 998.0, 4.11, np.array([0.4957, 0.2478, 0.6391]), 0.1245
BODY = np.diag([*[MASS] * 3, *INERTIA])
INVERSE = np.linalg.inv(BODY + p.ADDED_MASS)
RADII_SQUARED = p.LONGITUDINAL_MOMENT / p.WATERPLANE_AREA, p.TRANSVERSE_MOMENT / p.WATERPLANE_AREA


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def wave_kinematics(sea: Sea, x: float, y: float, yaw: float, time: float) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Return elevation, slopes, velocity and acceleration of the water averaged over the hull."""
    k = sea.frequency**2 / GRAVITY
    kx, ky = k * np.cos(sea.direction), k * np.sin(sea.direction)
    ahead, abeam = k * np.cos(sea.direction - yaw), k * np.sin(sea.direction - yaw)
    attenuation = np.exp(-(ahead**2 * RADII_SQUARED[0] + abeam**2 * RADII_SQUARED[1]) / 2 - k * p.DRAUGHT)
    a, angle, w = sea.amplitude * attenuation, kx * x + ky * y - sea.frequency * time + sea.phase, sea.frequency
    along = np.array([np.cos(sea.direction), np.sin(sea.direction)])
    velocity = np.array([*(along * (a * w * np.cos(angle))).sum(axis=1), (a * w * np.sin(angle)).sum()])
    acceleration = np.array([*(along * (a * w**2 * np.sin(angle))).sum(axis=1), -(a * w**2 * np.cos(angle)).sum()])
    slopes = np.array([-(a * kx * np.sin(angle)).sum(), -(a * ky * np.sin(angle)).sum()])
    return float((a * np.cos(angle)).sum()), slopes, velocity, acceleration


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

    def rate(self, time: float, state: np.ndarray) -> np.ndarray:
        """Return the time derivatives of position, rotation matrix and nu."""
        place, to_world, nu = state[:3], state[3:12].reshape(3, 3), state[12:]
        yaw = np.arctan2(to_world[1, 0], to_world[0, 0])
        elevation, slopes, orbital, flow = wave_kinematics(self.sea, place[0], place[1], yaw, time)
        spin, current = nu[3:], to_world.T @ [*self.current, 0.0]
        drifting = nu - [*current, 0, 0, 0]
        relative = drifting - [*(to_world.T @ orbital), 0, 0, 0]
        load = self.loads(relative, nu[:3] - to_world.T @ self.wind)
        load += self.buoyancy(to_world, place[2], yaw, elevation, slopes)
        load -= rigid_coriolis(spin) @ drifting + flow_coriolis(relative) @ relative
        pull, swell = to_world.T @ [*flow[:2], 0], to_world.T @ flow - skew(spin) @ (to_world.T @ orbital)
        load += BODY @ [*pull, 0, 0, 0] + p.ADDED_MASS @ [*swell, 0, 0, 0]
        acceleration = INVERSE @ load - [*(skew(spin) @ current), 0, 0, 0]
        return np.concatenate([to_world @ nu[:3], (to_world @ skew(spin)).ravel(), acceleration])

    def buoyancy(self, to_world: np.ndarray, height: float, yaw: float, elevation: float, slopes: np.ndarray) -> np.ndarray:
        up = to_world[2]
        cos, sin = np.cos(yaw), np.sin(yaw)
        ahead, abeam = cos * slopes[0] + sin * slopes[1], cos * slopes[1] - sin * slopes[0]
        k_heave, k_roll, k_pitch = p.STIFFNESS
        lever = np.array([-k_pitch * (up[0] - ahead), -k_roll * (up[1] - abeam), 0])
        return np.concatenate([k_heave * (FLOAT_HEIGHT + elevation - height) * up, skew(lever) @ up])

    def loads(self, relative: np.ndarray, air: np.ndarray) -> np.ndarray:
        u, v, w, roll, pitch, r = relative
        load = np.array([self.thrust, 0, 0, 0, 0, 0.0])
        load[2:5] -= np.array(p.DAMPING) * [w, roll, pitch]
        for x, y in p.DRAG_POINTS:
            speed = w + roll * y - pitch * x
            load += np.array([0, 0, 1, y, -x, 0]) * -p.POINT_DRAG * speed * abs(speed)
        side, moment = 2 * (-3.899501881 * v + 1.774273356 * r), 2 * (-1.774273356 * v - 0.807294377 * r)
        load += [0, side, 0, -p.HULL_FORCE_HEIGHT * side, 0, moment]
        load[:2] -= 0.1 * np.abs(air[:2]) * air[:2]
        angle = self.rudder - np.arctan2(np.sign(u) * (v - 0.34727 * r), abs(u))
        lift = DENSITY / 2 * 1.2 * 0.0064 * u * abs(u) * np.sin(np.pi / 2 * max(-1.0, min(1.0, angle / np.deg2rad(30))))
        ahead, abeam = -lift * np.sin(self.rudder), lift * np.cos(self.rudder)
        load += [ahead, abeam, 0, -p.RUDDER_HEIGHT * abeam, p.RUDDER_HEIGHT * ahead, -0.34727 * abeam]
        return load

    def simulate(self, nu: np.ndarray, times: np.ndarray) -> np.ndarray:
        """Positions at these times, from rest attitude in the origin."""
        start = np.concatenate([[0, 0, FLOAT_HEIGHT], np.eye(3).ravel(), nu])
        solution = solve_ivp(self.rate, (0, times[-1]), start, "DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
        return solution.y[:3].T
