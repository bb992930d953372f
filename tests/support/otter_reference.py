"""Independent NumPy implementation of the Otter in its original frames (north-east-down,
forward-starboard-down).

It follows the model `otter` of Fossen's Marine Systems Simulator (revision of 2026-06-27; Fossen
2021) with Euler angles and the classical Runge-Kutta method. No code is shared with the plant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

STEP = 0.01
G, RHO, L, B = 9.81, 1025.0, 2.0, 1.08
HULL_MASS, HULL_CENTRE = 55.0, np.array([0.2, 0.0, -0.2])
RADII = np.array([0.4 * B, 0.25 * L, 0.25 * L])
BEAM, PONTOON_OFFSET, C_W, C_B = 0.25, 0.395, 0.75, 0.4
K_AHEAD, K_ASTERN = 0.02216 / 2, 0.01289 / 2
N_MAX, N_MIN = np.sqrt(0.5 * 24.4 * G / K_AHEAD), -np.sqrt(0.5 * 13.6 * G / K_ASTERN)
FLOTATION = np.array([-0.2, 0.0, 0.0])
HOERNER = np.array(
    [
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
    ]
)


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def transformation_matrix(r: np.ndarray) -> np.ndarray:
    """H(r): generalised velocities at a point r from those at the origin."""
    return np.block([[np.eye(3), skew(r).T], [np.zeros((3, 3)), np.eye(3)]])


def rotation(attitude: np.ndarray) -> np.ndarray:
    phi, theta, psi = attitude
    about_x = np.array([[1, 0, 0], [0, np.cos(phi), -np.sin(phi)], [0, np.sin(phi), np.cos(phi)]])
    about_y = np.array(
        [[np.cos(theta), 0, np.sin(theta)], [0, 1, 0], [-np.sin(theta), 0, np.cos(theta)]]
    )
    about_z = np.array([[np.cos(psi), -np.sin(psi), 0], [np.sin(psi), np.cos(psi), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def euler_rates(attitude: np.ndarray, rates: np.ndarray) -> np.ndarray:
    phi, theta, _ = attitude
    p, q, r = rates
    turning = q * np.sin(phi) + r * np.cos(phi)
    return np.array(
        [p + turning * np.tan(theta), q * np.cos(phi) - r * np.sin(phi), turning / np.cos(theta)]
    )


@dataclass
class Otter:
    """State: eta (6), nu (6) at CO; shaft speeds (2) follow the commands after each step by a
    tenth.
    """

    payload: float = 25.0
    payload_place: tuple[float, float, float] = (0.05, 0.0, -0.35)
    current: tuple[float, float] = (0.0, 0.0)  # north, east (m/s)

    def __post_init__(self) -> None:
        self.eta, self.nu, self.shafts = np.zeros(6), np.zeros(6), np.zeros(2)
        m, place = self.payload, np.array(self.payload_place)
        self.payload_position = place
        self.mass = HULL_MASS + m
        self.draught = (volume := self.mass / RHO) / (2 * C_B * BEAM * L)
        self.centre = (HULL_MASS * HULL_CENTRE + m * place) / self.mass
        self.inertia = HULL_MASS * np.diag(RADII**2) - HULL_MASS * np.linalg.matrix_power(
            skew(HULL_CENTRE - self.centre), 2
        )
        self.inertia -= m * np.linalg.matrix_power(skew(place - self.centre), 2)
        self.to_centre = transformation_matrix(self.centre)
        body = np.zeros((6, 6))
        body[:3, :3], body[3:, 3:] = self.mass * np.eye(3), self.inertia
        added = [2.7 * RHO * (HULL_MASS / RHO) ** (5 / 3) / L**2, 1.5 * HULL_MASS, HULL_MASS]
        self.added = np.diag([*added, *(np.array([0.2, 0.8, 1.7]) * np.diag(self.inertia))])
        self.mass_matrix = self.to_centre.T @ body @ self.to_centre + self.added
        self._set_up_water(volume)

    def _set_up_water(self, volume: float) -> None:
        waterplane = C_W * L * BEAM
        i_t = (
            2 * (1 / 12) * L * BEAM**3 * (6 * C_W**3 / ((1 + C_W) * (1 + 2 * C_W)))
            + 2 * waterplane * PONTOON_OFFSET**2
        )
        i_l = 0.8 * 2 * (1 / 12) * BEAM * L**3
        buoyancy_height = (5 * self.draught / 2 - 0.5 * volume / (L * BEAM)) / 3
        heights = [
            buoyancy_height + i / volume - (self.draught - self.centre[2]) for i in (i_t, i_l)
        ]
        stiffness = np.array(
            [2 * RHO * G * waterplane, *(RHO * G * volume * height for height in heights)]
        )
        to_flotation = transformation_matrix(FLOTATION)
        self.stiffness = to_flotation.T @ np.diag([0, 0, *stiffness, 0]) @ to_flotation
        w3, w4, w5 = np.sqrt(stiffness / np.diag(self.mass_matrix)[2:5])
        m = np.diag(self.mass_matrix)
        self.linear_damping = np.array(
            [24.4 * G / (6 * 0.5144), m[1], 0.6 * w3 * m[2], 0.4 * w4 * m[3], 0.8 * w5 * m[4], m[5]]
        )
        self.drag = np.interp(BEAM / (2 * self.draught), *HOERNER.T)

    def trim(self, eta: np.ndarray) -> np.ndarray:
        """The attitude and depth to which the payload presses the hull."""
        force = rotation(eta[3:]).T @ np.array([0, 0, self.payload * G])
        load = np.concatenate([force, np.cross(self.payload_position, force)])
        settled = np.zeros(6)
        settled[2:5] = np.linalg.solve(self.stiffness[2:5, 2:5], load[2:5])
        return settled

    def rate(self, eta: np.ndarray, nu: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        level = eta - self.trim(eta)
        spin = nu[3:]
        direction, speed = np.arctan2(self.current[1], self.current[0]), np.hypot(*self.current)
        water = speed * np.array([np.cos(direction - eta[5]), np.sin(direction - eta[5]), 0])
        relative = nu - np.concatenate([water, np.zeros(3)])
        coriolis = np.zeros((6, 6))
        coriolis[:3, :3], coriolis[3:, 3:] = self.mass * skew(spin), -skew(self.inertia @ spin)
        momentum = self.added @ relative
        flow = np.zeros((6, 6))
        flow[:3, 3:] = flow[3:, :3] = -skew(momentum[:3])
        flow[3:, 3:] = -skew(momentum[3:])
        load = self.thrust() + self.damping(relative) - self.stiffness @ level
        load -= (self.to_centre.T @ coriolis @ self.to_centre + flow) @ relative
        acceleration = np.concatenate([-np.cross(spin, water), np.zeros(3)]) + np.linalg.solve(
            self.mass_matrix, load
        )
        return np.concatenate(
            [rotation(level[3:]) @ nu[:3], euler_rates(level[3:], spin)]
        ), acceleration

    def thrust(self) -> np.ndarray:
        n = np.clip(self.shafts, N_MIN, N_MAX)
        port, starboard = np.where(n > 0, K_AHEAD, K_ASTERN) * n * abs(n)
        return np.array([port + starboard, 0, 0, 0, 0, PONTOON_OFFSET * (port - starboard)])

    def damping(self, relative: np.ndarray) -> np.ndarray:
        load = -self.linear_damping * relative
        load[5] *= 1 + 10 * abs(relative[5])
        x = np.linspace(-L / 2, L / 2, 21)
        for axis, turned in ((1, 5), (2, 4)):
            speed = relative[axis] + x * relative[turned]
            force = -0.5 * RHO * self.draught * self.drag * abs(speed) * speed * L / 20
            load[axis] += force.sum()
            load[turned] += (x * force).sum()
        return load

    def step(self, commands: tuple[float, float]) -> None:
        """One step of the classical Runge-Kutta method, then of the shafts."""
        h, x = STEP, (self.eta, self.nu)
        k1 = self.rate(*x)
        k2 = self.rate(*(a + h / 2 * b for a, b in zip(x, k1, strict=True)))
        k3 = self.rate(*(a + h / 2 * b for a, b in zip(x, k2, strict=True)))
        k4 = self.rate(*(a + h * b for a, b in zip(x, k3, strict=True)))
        self.eta, self.nu = (
            a + h / 6 * (p + 2 * q + 2 * r + s)
            for a, p, q, r, s in zip(x, k1, k2, k3, k4, strict=True)
        )
        self.shafts = self.shafts + 0.1 * (np.array(commands) - self.shafts)
