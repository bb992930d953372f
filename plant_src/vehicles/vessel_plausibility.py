"""Probable mistakes in the data of vessels and submerged vehicles.

Thrust, resistance, places and angles of propellers.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from cosim.core.errors import Problem
from cosim.core.units import KNOWN_UNITS

from ..json_reader import argument_problem as warning
from .common.vehicle_reader import RADIANS_EXPECTED
from .planar_vessel.planar_vessel import PlanarVessel
from .submerged.craft import Craft
from .surface_vessel.surface_vessel import SurfaceVessel
from .vessel.boat import Boat

#: largest ratio of the thrust of all propellers to the weight: shipped vessels have at most 0.42,
#: planing boats about 0.5, the shipped ROV 1.8
MAX_VESSEL_THRUST, MAX_SUBMERGED_THRUST = 1.0, 5.0
#: largest speed of the tips of propellers (m/s)
MAX_TIP_SPEED = 100.0
#: distance outside of the box around hull and boxes at which a propeller or rudder is implausible,
#: over the length
POSITION_MARGIN = 0.25
#: largest distance of a thruster from the centre of mass over that of the farthest corner
MAX_THRUSTER_DISTANCE = 2.0
#: largest ratio of mass and displaced mass, in either direction; 1 kg is 2.2 lb
MAX_MASS_RATIO = 1.5
#: largest ratio of the lengths of the hull that floats and of a shape that collides or is drawn, in
#: either direction
MAX_LENGTH_RATIO = 3.0
_GRAVITY = 9.81


def vessel_warnings(
    vehicle: Boat | Craft, corners: np.ndarray, visual: np.ndarray | None, max_length: float
) -> Iterator[Problem]:
    """Yield warnings about a vessel or a submerged vehicle.

    Args:
        vehicle: Its data.
        corners: Corners of its boxes (m), from O of a vessel, shape (n, 3).
        visual: Triangles that pictures show (m), shape (n, 3, 3).
        max_length: Largest plausible length of a hull (m).
    """
    if isinstance(vehicle, Craft):
        yield from _craft_warnings(vehicle, float(np.linalg.norm(corners, axis=1).max()))
        displaced = vehicle.water_density * vehicle.displaced_volume
        source = f"displaced_volume of {vehicle.displaced_volume:.4g} m3"
        yield from _mass_warnings(vehicle.mass, displaced, source)
        return
    yield from _boat_warnings(vehicle, corners)
    if isinstance(vehicle, SurfaceVessel):
        yield from _hull_warnings(vehicle, max_length)
        if (draught := -vehicle.hull.bottom) > 0:
            displaced = vehicle.water_density * vehicle.hull.area * draught
            source = f"draught of {draught:.4g} m (hull.bottom with a minus sign)"
            yield from _mass_warnings(vehicle.mass, displaced, source)
        yield from _shape_warnings(corners, visual, vehicle.hull.length)


def _boat_warnings(boat: Boat, corners: np.ndarray) -> Iterator[Problem]:
    """Yield warnings about a vessel of either kind."""
    thrusts = [each.thrust_coefficient * each.max_speed**2 for each in boat.propellers]
    largest = int(np.argmax(thrusts))
    propeller, path = boat.propellers[largest], ("propellers", str(largest))
    cause = _cause(
        propeller.max_speed, propeller.radius, (*path, "thrust_coefficient"), (*path, "max_speed")
    )
    yield from _thrust_warnings(sum(thrusts), boat.mass * _GRAVITY, MAX_VESSEL_THRUST, cause)
    yield from _resistance_warnings(
        *surge_damping(boat), *(each.advance_coefficient for each in boat.propellers)
    )
    for i, each in enumerate(boat.propellers):
        if 2 * math.pi < each.max_azimuth <= 360:  # larger ones mean "no limit"
            text = f"found {each.max_azimuth:g}, {RADIANS_EXPECTED}"
            yield warning(text, "propellers", str(i), "max_azimuth")
    low, high = _bounds(boat, corners)
    yield from _position_warnings(boat, low, high)
    yield from _height_warnings(boat, high[2])


def _craft_warnings(craft: Craft, reach: float) -> Iterator[Problem]:
    """Yield warnings about a submerged vehicle.

    Its farthest corner is `reach` (m) from the centre of mass.
    """
    thrusts = [each.thrust_coefficient * craft.max_thruster_speed**2 for each in craft.thrusters]
    path = ("thrusters", str(int(np.argmax(thrusts))), "thrust_coefficient")
    cause = _cause(craft.max_thruster_speed, craft.thruster_radius, path, ("thruster", "max_speed"))
    yield from _thrust_warnings(
        sum(thrusts), craft.mass * craft.gravity, MAX_SUBMERGED_THRUST, cause
    )
    yield from _resistance_warnings(
        craft.linear_damping[0, 0], craft.quadratic_damping[0, 0], craft.advance_coefficient
    )
    for i, thruster in enumerate(craft.thrusters):
        distance, limit = math.hypot(*thruster.position), MAX_THRUSTER_DISTANCE * reach
        if distance > limit:
            text = f"{distance:.4g} m from the centre of mass, expected less than {limit:.3g} m"
            yield warning(text, "thrusters", str(i), "position")


def _cause(
    speed: float, radius: float, coefficient: tuple[str, ...], max_speed: tuple[str, ...]
) -> tuple[str, tuple[str, ...]]:
    """Return a hint and the path of the key that is probably wrong.

    The largest speed, or else the thrust coefficient.
    """
    if speed * radius > MAX_TIP_SPEED:
        hint = (
            f"; {speed:.4g} rad/s make {speed * radius:.4g} m/s at the tips of the propellers: is "
            "max_speed in rpm?"
        )
        return hint, max_speed
    return "", coefficient


def _thrust_warnings(
    thrust: float, weight: float, limit: float, cause: tuple[str, Sequence[str]]
) -> Iterator[Problem]:
    """Yield a warning if the thrust (N) is more than `limit` times the weight (N)."""
    hint, path = cause
    if thrust > limit * weight:
        text = (
            f"the thrust of all propellers at full speed is {thrust:.4g} N, {thrust / weight:.3g} "
            "times the weight of "
            f"{weight:.4g} N, expected less than {limit:g} times"
        )
        yield warning(text + hint, *path)


def surge_damping(boat: Boat) -> tuple[float, float, float]:
    """Return the linear, quadratic and cubic coefficient of the resistance in surge."""
    linear = float(boat.linear_damping[0, 0])
    if isinstance(boat, SurfaceVessel):
        return linear, float(boat.quadratic_damping[0, 0]), 0.0
    assert isinstance(boat, PlanarVessel)
    return linear, float(boat.quadratic_damping[0][0, 0]), boat.cubic_damping[0]


def _resistance_warnings(*coefficients: float) -> Iterator[Problem]:
    """Yield a warning if no force of the water limits the speed ahead."""
    if not any(coefficients):
        text = (
            "the water has no resistance ahead: the elements for u are 0, here and in "
            "quadratic_damping"
        )
        yield warning(text, "linear_damping")


def _bounds(boat: Boat, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return lowest and highest coordinates (m, from O) of boxes and hull, shape (3,) each."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    if isinstance(boat, SurfaceVessel):
        hull = boat.hull
        x, y = hull.length / 2, hull.offset + hull.beam / 2
        low = np.minimum(low, [hull.waterplane_centre - x, -y, hull.bottom])
        high = np.maximum(high, [hull.waterplane_centre + x, y, hull.bottom + hull.depth])
    return low, high


def _position_warnings(boat: Boat, low: np.ndarray, high: np.ndarray) -> Iterator[Problem]:
    """Yield a warning for each propeller and rudder far outside of hull and boxes."""
    margin = POSITION_MARGIN * (high[0] - low[0])
    positions = {
        "propellers": [each.position for each in boat.propellers],
        "rudders": [each.position for each in boat.rudders],
    }
    for key, places in positions.items():
        for i, position in enumerate(places):
            for axis, place in enumerate(position):
                if not low[axis] - margin <= place <= high[axis] + margin:
                    text = (
                        f"{'xyz'[axis]} = {place:.4g} m is far outside of hull and boxes, expected "
                        f"{low[axis] - margin:.3g} to {high[axis] + margin:.3g} m"
                    )
                    yield warning(text, key, str(i), "position")


def _height_warnings(boat: Boat, top: float) -> Iterator[Problem]:
    """Yield a warning if the centre of mass is above everything by more than the hull's depth."""
    if (
        isinstance(boat, SurfaceVessel)
        and (height := boat.centre_of_mass[2] - top) > boat.hull.depth
    ):
        text = (
            f"z = {boat.centre_of_mass[2]:.4g} m is {height:.3g} m above hull and boxes, expected "
            "at most the depth of the hull, "
            f"{boat.hull.depth:.3g} m"
        )
        yield warning(text, "centre_of_mass")


def _hull_warnings(vessel: SurfaceVessel, max_length: float) -> Iterator[Problem]:
    hull, draught = vessel.hull, vessel.draught
    if hull.length > max_length:
        yield warning(
            f"found {hull.length:g} m, expected less than {max_length:g} m", "hull", "length"
        )
    if hull.bottom > 0:
        text = (
            f"found {hull.bottom:g}: the origin is below the hull, minus the draught "
            f"({-draught:.3g}) is usual"
        )
        yield warning(text, "hull", "bottom")
    surface = hull.bottom + draught
    for i, propeller in enumerate(vessel.propellers):
        if propeller.radius and propeller.position[2] - propeller.radius > surface:
            height = propeller.position[2] - surface
            text = f"{height:.3g} m above the water at rest, the propeller gives no thrust"
            yield warning(text, "propellers", str(i), "position")


def _shape_warnings(
    corners: np.ndarray, visual: np.ndarray | None, length: float
) -> Iterator[Problem]:
    """Yield a warning for each shape that is not that of the hull, whose length (m) is given."""
    shapes = {"boxes": corners}
    if visual is not None:
        shapes["visual"] = visual.reshape(-1, 3)
    for key, points in shapes.items():
        extent = float(np.ptp(points[:, 0]))
        if max(extent, length) > MAX_LENGTH_RATIO * min(extent, length):
            yield warning(
                (
                    f"{extent:.4g} m long, but the vessel floats by hull.length = {length:.4g} m, "
                    "whatever is drawn"
                ),
                key,
            )


def _mass_warnings(mass: float, displaced: float, source: str) -> Iterator[Problem]:
    """Yield a warning if the mass (kg) and a displaced mass (kg) differ too much.

    The displaced mass follows from the quantity `source` of the file.
    """
    ratio = max(mass, displaced) / min(mass, displaced)
    if ratio > MAX_MASS_RATIO:
        is_pound = math.isclose(mass / displaced, 1 / KNOWN_UNITS["lb"].factor, rel_tol=0.05)
        hint = ": is the mass in lb?" if is_pound else ""
        yield warning(
            f"found {mass:.4g} kg, but the {source} displaces {displaced:.4g} kg of water{hint}",
            "mass",
        )
