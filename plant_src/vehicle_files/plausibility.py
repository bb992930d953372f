"""Probable mistakes in the data of a vehicle that can run nevertheless, most of them wrong units."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from cosim.core.units import KNOWN_UNITS

from ..catalogue import model_from_data
from ..vehicles.model import Model
from ..vehicles.multirotor.airframe import Airframe, Rotor
from ..vehicles.submerged.craft import Thruster
from ..vehicles.surface_vessel.surface_vessel import SurfaceVessel
from ..vehicles.vessel.actuators import Propeller

#: largest distance of a rotor from the centre of mass over the median of all rotors, and over the farthest corner of the boxes
MAX_ROTOR_DISTANCE = 5.0
#: largest ratio of thrust to weight; racing drones reach about 15
MAX_THRUST_RATIO = 30.0
#: largest extent of a vessel and of other vehicles (m); the longest ships have 460 m
MAX_EXTENT = {True: 500.0, False: 100.0}
#: largest ratio of mass and displaced mass, in either direction; 1 kg is 2.2 lb
MAX_MASS_RATIO = 1.5
#: largest ratio of the lengths of the hull that floats and of a shape that collides or is drawn, in either direction
MAX_LENGTH_RATIO = 3.0
#: z component of the axis of a rotor that pushes downwards
_DOWNWARDS = -0.5


def examine_vehicle(data: Mapping[str, Any], name: str) -> tuple[float, list[str]]:
    """Return mass (kg) and warnings of a vehicle that is given by its data.

    Raises:
        InputError: With all problems; the subject of each begins with "arguments" and continues with the path in the data.
    """
    model = model_from_data(data, name)
    return model.body.mass, list(vehicle_warnings(model))


def vehicle_warnings(model: Model) -> Iterator[str]:
    """Yield a warning for each quantity of a vehicle file that is probably wrong, with its path in the file."""
    if model.airframe or model.craft or model.boat:
        yield from _size_warnings(model)
    if model.airframe:
        yield from _thrust_warnings(model.airframe)
        yield from _rotor_warnings(model.airframe, _reach(model))
    if isinstance(model.boat, SurfaceVessel):
        yield from _hull_warnings(model.boat)
        yield from _draught_warnings(model.boat)
        yield from _shape_warnings(model, model.boat.hull.length)
    if model.craft:
        displaced = model.craft.water_density * model.craft.displaced_volume
        yield from _mass_warnings(model.craft.mass, displaced, f"displaced_volume of {model.craft.displaced_volume:.4g} m3")


def _reach(model: Model) -> float:
    """Return the distance of the farthest corner of the collision shape from the centre of mass (m)."""
    corners = np.concatenate([box.corners() for box in model.body.boxes])
    return float(np.linalg.norm(corners - (model.boat.centre_of_mass if model.boat else 0.0), axis=1).max())


def _actuators(model: Model) -> Sequence[Rotor | Thruster | Propeller]:
    if model.airframe:
        return model.airframe.rotors
    return model.craft.thrusters if model.craft else model.boat.propellers if model.boat else ()


def _size_warnings(model: Model) -> Iterator[str]:
    reach = _reach(model)
    if reach > (limit := MAX_EXTENT[model.is_vessel]) / 2:
        yield f"boxes: a corner is {reach:.4g} m from the centre of mass, expected less than {limit / 2:g} m"
    farthest = max(reach, *(float(np.linalg.norm(part.position)) for part in _actuators(model)))
    radius = math.sqrt(max(model.body.inertia) / model.body.mass)
    if radius > farthest:
        key = "yaw_inertia" if model.motion == "planar" else "inertia"
        yield (
            f"{key}: the radius of gyration, the square root of inertia over mass, is {radius:.3g} m, but the farthest point of "
            f"the vehicle is {farthest:.3g} m from the centre of mass"
        )


def _thrust_warnings(airframe: Airframe) -> Iterator[str]:
    ratio = airframe.lift / (airframe.mass * airframe.gravity)
    if ratio > MAX_THRUST_RATIO:
        yield f"mass: thrust over weight is {ratio:.3g}, expected less than {MAX_THRUST_RATIO:g}"


def _rotor_warnings(airframe: Airframe, reach: float) -> Iterator[str]:
    distances = [float(np.linalg.norm(rotor.position)) for rotor in airframe.rotors]
    limit = MAX_ROTOR_DISTANCE * max(airframe.rotor_radius, min(float(np.median(distances)), 2 * reach))
    for i, (rotor, distance) in enumerate(zip(airframe.rotors, distances, strict=True)):
        if distance > limit:
            yield f"rotors[{i}].position: {distance:.4g} m from the centre of mass, expected less than {limit:.3g} m"
        if rotor.axis[2] < _DOWNWARDS:
            yield f"rotors[{i}].axis: the rotor pushes downwards"
    torques = [
        rotor.thrust_coefficient * np.cross(rotor.position, rotor.axis)[2]
        + rotor.torque_sign * rotor.torque_coefficient * rotor.axis[2]
        for rotor in airframe.rotors
    ]
    if min(torques) > 0 or max(torques) < 0:
        yield "rotors: all turn the vehicle about z in the same direction, it cannot hold its yaw angle: change turns of some"


def _hull_warnings(vessel: SurfaceVessel) -> Iterator[str]:
    hull, draught = vessel.hull, vessel.draught
    if hull.length > MAX_EXTENT[True]:
        yield f"hull.length: found {hull.length:g} m, expected less than {MAX_EXTENT[True]:g} m"
    if hull.bottom > 0:
        yield f"hull.bottom: found {hull.bottom:g}: the origin is below the hull, minus the draught ({-draught:.3g}) is usual"
    surface = hull.bottom + draught
    for i, propeller in enumerate(vessel.propellers):
        if propeller.radius and propeller.position[2] - propeller.radius > surface:
            height = propeller.position[2] - surface
            yield f"propellers[{i}].position: {height:.3g} m above the water at rest, the propeller gives no thrust"


def _shape_warnings(model: Model, length: float) -> Iterator[str]:
    """Yield a warning for each shape that is not that of the hull, whose length (m) is given."""
    shapes = {"boxes": np.concatenate([box.corners() for box in model.body.boxes])}
    if model.visual is not None:
        shapes["visual"] = model.visual.reshape(-1, 3)
    for key, points in shapes.items():
        extent = float(np.ptp(points[:, 0]))
        if max(extent, length) > MAX_LENGTH_RATIO * min(extent, length):
            yield f"{key}: {extent:.4g} m long, but the vessel floats by hull.length = {length:.4g} m, whatever is drawn"


def _draught_warnings(vessel: SurfaceVessel) -> Iterator[str]:
    if vessel.hull.bottom < 0:
        displaced = vessel.water_density * vessel.hull.area * -vessel.hull.bottom
        yield from _mass_warnings(
            vessel.mass, displaced, f"draught of {-vessel.hull.bottom:.4g} m (hull.bottom with a minus sign)"
        )


def _mass_warnings(mass: float, displaced: float, source: str) -> Iterator[str]:
    """Yield a warning if the mass (kg) and the displaced mass that a quantity of the file gives (kg) differ too much."""
    ratio = max(mass, displaced) / min(mass, displaced)
    if ratio > MAX_MASS_RATIO:
        is_pound = math.isclose(mass / displaced, 1 / KNOWN_UNITS["lb"].factor, rel_tol=0.05)
        hint = ": is the mass in lb?" if is_pound else ""
        yield f"mass: found {mass:.4g} kg, but the {source} displaces {displaced:.4g} kg of water{hint}"
