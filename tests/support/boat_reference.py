"""Independent NumPy implementation of vessels that are given by data; only the data are shared with
the plant.

Mass and Coriolis terms are matrices (Fossen 2021, equations 3.60 and 6.43), the loads are sums over
the elements of the data.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from catamaran_reference import Water, skew

from plant_src.vehicles.planar_vessel.planar_vessel import PlanarVessel
from plant_src.vehicles.surface_vessel.surface_vessel import SurfaceVessel
from plant_src.vehicles.vessel.boat import Boat

GRAVITY = 9.81
CALM = Water(np.zeros(10), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))


@dataclass
class Commands:
    speed: np.ndarray
    azimuth: np.ndarray
    rudder: np.ndarray
    force: np.ndarray = field(default_factory=lambda: np.zeros(3))
    torque: np.ndarray = field(default_factory=lambda: np.zeros(3))
    wind: np.ndarray = field(default_factory=lambda: np.zeros(3))
    current: np.ndarray = field(default_factory=lambda: np.zeros(2))


def load_at(point: Any, force: Any) -> np.ndarray:
    return np.concatenate([force, np.cross(point, force)])


def propeller_loads(
    boat: Boat, speeds: np.ndarray, flow: np.ndarray, given: Commands, immersed: np.ndarray
) -> np.ndarray:
    total = np.zeros(6)
    for each, n, angle, wet in zip(boat.propellers, speeds, given.azimuth, immersed, strict=True):
        angle = np.clip(angle, -each.max_azimuth, each.max_azimuth)
        turn = np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
        )
        axis, place = turn @ each.axis, np.array(each.position)
        inflow = axis @ (flow[:3] + np.cross(flow[3:], place))
        coefficient = each.thrust_coefficient if n > 0 else each.reverse_thrust_coefficient
        total += load_at(
            place,
            wet * (coefficient * n * abs(n) - each.advance_coefficient * abs(n) * inflow) * axis,
        )
    return total


def rudder_loads(boat: Boat, speeds: np.ndarray, flow: np.ndarray, given: Commands) -> np.ndarray:
    total = np.zeros(6)
    for each, angle in zip(boat.rudders, given.rudder, strict=True):
        x, y, _ = each.position
        u, v, r = flow[[0, 1, 5]]
        race = 0.0
        if each.propeller and boat.propellers[each.propeller - 1].radius:
            ahead = boat.propellers[each.propeller - 1]
            thrust = ahead.thrust_coefficient * max(speeds[each.propeller - 1], 0.0) ** 2
            race = 2 * thrust / boat.water_density / (np.pi * ahead.radius**2)
        angle = np.clip(angle, -each.max_angle, each.max_angle)
        square = (u - y * r) * abs(u - y * r) + race
        attack = (
            angle - np.arctan2(np.sign(square) * (v + x * r), np.sqrt(abs(square)))
        ) / each.stall_angle
        lift = (
            boat.water_density
            / 2
            * each.area
            * each.max_lift_coefficient
            * square
            * np.sin(np.pi / 2 * np.clip(attack, -1, 1))
        )
        total += load_at(each.position, [-lift * np.sin(angle), lift * np.cos(angle), 0])
    return total


def speed_rates(boat: Boat, speeds: np.ndarray, given: Commands) -> np.ndarray:
    rates = []
    for each, n, command in zip(boat.propellers, speeds, given.speed, strict=True):
        target = np.clip(command, -each.max_reverse_speed, each.max_speed)
        rates.append((target - n) / each.time_constant if each.time_constant else 0.0)
    return np.array(rates)


def actual_speeds(boat: Boat, speeds: np.ndarray, given: Commands) -> np.ndarray:
    limits = [(-each.max_reverse_speed, each.max_speed) for each in boat.propellers]
    direct = [np.clip(command, *limit) for command, limit in zip(given.speed, limits, strict=True)]
    return np.array(
        [
            n if e.time_constant else d
            for e, n, d in zip(boat.propellers, speeds, direct, strict=True)
        ]
    )


def coriolis(mass: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Return C(nu) nu (Fossen 2021, equation 3.46)."""
    first, second = mass[:3] @ nu, mass[3:] @ nu
    return np.block([[np.zeros((3, 3)), -skew(first)], [-skew(first), -skew(second)]]) @ nu


def floating_rate(
    vessel: SurfaceVessel, state: np.ndarray, given: Commands, water: Water, to_world: np.ndarray
) -> np.ndarray:
    """Return nu' of O; `state` is position, nu and propeller speeds."""
    place, nu = state[:3], state[3:9]
    speeds = actual_speeds(vessel, state[9:], given)
    centre, spin = np.array(vessel.centre_of_mass), nu[3:]
    transform = np.block([[np.eye(3), -skew(centre)], [np.zeros((3, 3)), np.eye(3)]])
    rigid = (
        transform.T
        @ np.block(
            [[vessel.mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), vessel.inertia]]
        )
        @ transform
    )
    current, orbital = to_world.T @ [*given.current, 0.0], to_world.T @ water.velocity
    drifting = nu - [*current, 0, 0, 0]
    flow = drifting - [*orbital, 0, 0, 0]
    load, wetness = buoyancy(vessel, to_world[2], place[2], water.elevations)
    load += load_at(centre, -vessel.mass * GRAVITY * to_world[2])
    load += wetness * (
        hull_loads(vessel, flow, water, to_world) + rudder_loads(vessel, speeds, flow, given)
    )
    heights = np.array(
        [
            propeller_depth(vessel, each.position, place[2], to_world, water)
            for each in vessel.propellers
        ]
    )
    radii = np.array([each.radius for each in vessel.propellers])
    immersed = np.where(
        radii > 0, np.clip(heights / (2 * np.maximum(radii, 1e-9)) + 0.5, 0, 1), 1.0
    )
    load += propeller_loads(vessel, speeds, flow, given, immersed)
    air = (nu[:3] - to_world.T @ given.wind)[:2]
    load += load_at(vessel.air_centre, [*(-np.array(vessel.air_drag) * np.abs(air) * air), 0.0])
    load += load_at(centre, to_world.T @ given.force)
    load[3:] += to_world.T @ given.torque
    # C_RB in the form that does not depend on the linear velocity, equation 3.63
    lever, turn = skew(centre), vessel.mass * skew(spin)
    matrix = np.block(
        [[turn, -turn @ lever], [lever @ turn, -lever @ turn @ lever - skew(vessel.inertia @ spin)]]
    )
    load -= matrix @ drifting + coriolis(vessel.coriolis_added_mass, flow)
    acceleration = to_world.T @ water.acceleration
    load += vessel.added_mass @ [*(acceleration - skew(spin) @ orbital), *water.turning]
    return np.linalg.solve(rigid + vessel.added_mass, load) - [*(skew(spin) @ current), 0, 0, 0]


def strip_points(vessel: SurfaceVessel) -> np.ndarray:
    """Places (10, 2) of the strips relative to the centre of the waterplane."""
    hull = vessel.hull
    spacing, offset = (
        np.sqrt(hull.longitudinal_moment / hull.area / 2),
        np.sqrt(hull.transverse_moment / hull.area),
    )
    ahead, side = np.tile((2, 1, 0, -1, -2), 2), np.repeat((1, -1), 5)
    return np.column_stack([ahead * spacing, side * offset])


def buoyancy(
    vessel: SurfaceVessel, up: np.ndarray, height: float, elevations: np.ndarray
) -> tuple[np.ndarray, float]:
    hull, points = vessel.hull, strip_points(vessel)
    spacing = points[0, 0] / 2
    extent = max(hull.depth * abs(up[2]), hull.strip_beam * abs(up[1]), spacing * abs(up[0]))
    load, wetness = np.zeros(6), 0.0
    for (x, y), elevation in zip(points, elevations, strict=True):
        box = np.array([hull.waterplane_centre + x, y, hull.bottom + hull.depth / 2])
        share = np.clip((elevation - height - up @ box) / extent + 0.5, 0, 1)
        middle = box - [0, 0, (1 - share) * hull.depth / 2 * hull.depth * up[2] / extent]
        load += load_at(
            middle, vessel.water_density * GRAVITY * hull.area / 10 * hull.depth * share * up
        )
        wet = min(1.0, share * hull.depth / (vessel.draught / 2))
        wetness += (1 - (1 - wet) ** 2) / 10
    return load, wetness


def hull_loads(
    vessel: SurfaceVessel, flow: np.ndarray, water: Water, to_world: np.ndarray
) -> np.ndarray:
    hull, points, density = vessel.hull, strip_points(vessel), vessel.water_density
    nu = flow - [0, 0, 0, *water.rates]
    load = -vessel.linear_damping @ nu - vessel.quadratic_damping @ (np.abs(nu) * nu)
    for x in hull.waterplane_centre + np.array([-1, 1]) * hull.length / 12**0.5:
        for y in np.array([-1, 1]) * (hull.offset if hull.count == 2 else hull.beam / 12**0.5):
            w = nu[2] + nu[3] * y - nu[4] * x
            load += load_at(
                [x, y, 0],
                [0, 0, -density / 2 * hull.vertical_drag_coefficient * hull.area / 4 * w * abs(w)],
            )
    for k in range(-10, 11):
        x = hull.waterplane_centre + k / 20 * hull.length
        v = nu[1] + nu[5] * x
        side = (
            -density
            / 2
            * hull.cross_flow_drag_coefficient
            * vessel.draught
            * hull.length
            / 20
            * v
            * abs(v)
        )
        load += load_at([x, 0, hull.bottom + vessel.draught / 2], [0, side, 0])
    displaced = np.array([hull.waterplane_centre, 0, hull.bottom + vessel.draught / 2])
    load += load_at(displaced, vessel.mass * (to_world.T @ water.acceleration))
    load[3:] += (
        vessel.mass
        * np.array([(points[:, 1] ** 2).mean(), (points[:, 0] ** 2).mean(), 0])
        * water.turning
    )
    return load


def propeller_depth(
    vessel: SurfaceVessel, place: Any, height: float, to_world: np.ndarray, water: Water
) -> float:
    """Depth of a propeller below the plane through the elevations at the strips."""
    points = strip_points(vessel)
    plane = np.linalg.lstsq(np.column_stack([np.ones(10), points]), water.elevations, rcond=None)[0]
    elevation = plane @ [1.0, place[0] - vessel.hull.waterplane_centre, place[1]]
    return float(elevation - height - to_world[2] @ place)


def planar_rate(
    vessel: PlanarVessel, yaw: float, nu: np.ndarray, speeds: np.ndarray, given: Commands
) -> np.ndarray:
    """Return the rates of surge and sway velocity of the centre of mass and of the yaw rate,
    computed about this centre.
    """
    speeds = actual_speeds(vessel, speeds, given)
    x, y, _ = vessel.centre_of_mass
    to_body = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    u, v, r = nu
    current = np.array([*(to_body @ given.current), 0.0])
    origin = np.array([u + y * r, v - x * r, r])
    flow = origin - current
    load = -vessel.linear_damping @ flow - np.array(vessel.cubic_damping) * flow**3
    load -= sum(abs(flow[k]) * vessel.quadratic_damping[k] @ flow for k in range(3))
    full = np.array([flow[0], flow[1], 0, 0, 0, flow[2]])
    driving = propeller_loads(vessel, speeds, full, given, np.ones(len(speeds))) + rudder_loads(
        vessel, speeds, full, given
    )
    air = origin[:2] - to_body @ given.wind[:2]
    driving += load_at(vessel.air_centre, [*(-np.array(vessel.air_drag) * np.abs(air) * air), 0.0])
    load += driving[[0, 1, 5]]
    momentum = vessel.coriolis_added_mass @ flow
    load -= [-r * momentum[1], r * momentum[0], flow[0] * momentum[1] - flow[1] * momentum[0]]
    # about the centre of mass: nu of O is T nu of the centre
    transform = np.array([[1, 0, y], [0, 1, -x], [0, 0, 1]])
    about_centre = transform.T @ load + [*(to_body @ given.force[:2]), given.torque[2]]
    rigid = np.diag([vessel.mass, vessel.mass, vessel.yaw_inertia])
    added = transform.T @ vessel.added_mass @ transform
    current_rate = np.array([r * current[1], -r * current[0], 0.0])
    about_centre += rigid @ [v * r, -u * r, 0] + transform.T @ vessel.added_mass @ current_rate
    return np.linalg.solve(rigid + added, about_centre)
