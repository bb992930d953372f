"""Probable mistakes in the data of a vehicle, most of them wrong units.

The vehicle can run nevertheless.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cosim.core.errors import Problem

from ..catalogue import Model
from ..json_reader import argument_problem as warning
from ..placement import VehiclePlacement

if TYPE_CHECKING:
    from ..vehicles.multirotor.airframe import Airframe, Rotor
    from ..vehicles.submerged.craft import Thruster
    from ..vehicles.vessel.actuators import Propeller

#: largest distance of a rotor from the centre of mass over the median of all rotors, and over the
#: farthest corner of the boxes
MAX_ROTOR_DISTANCE = 5.0
#: smallest and largest ratio of thrust to weight; the shipped multirotors have 1.7 to 3.2, racing
#: drones reach about 15
MIN_THRUST_RATIO, MAX_THRUST_RATIO = 1.3, 30.0
#: largest speed of the tips of rotors (m/s), the speed of sound
MAX_TIP_SPEED = 340.0
#: largest thrust coefficient, thrust over air density, disc area and squared tip speed; the shipped
#: rotors have about 0.01
MAX_THRUST_COEFFICIENT = 0.1
_AIR_DENSITY = 1.225
#: largest extent of a vessel and of other vehicles (m); the longest ships have 460 m
MAX_EXTENT = {True: 500.0, False: 100.0}
#: z component of the axis of a rotor that pushes downwards
_DOWNWARDS = -0.1


def placement_warnings(vehicle: VehiclePlacement) -> Iterator[Problem]:
    """Yield a warning for each value of a vehicle in a world that is probably wrong.

    The subject is its path in the component.
    """
    path = ("arguments", "vehicles", vehicle.name)
    for each in vehicle_warnings(vehicle.model):
        yield replace(each, subject=(*path, "model", *each.subject[1:]))
    if abs(yaw := vehicle.parameters["initial.yaw"]) > 2 * math.pi:
        yield Problem(
            f"found {yaw:g}, radians expected; in degrees? A right angle is 1.5708",
            subject=(*path, "yaw"),
        )


def vehicle_warnings(model: Model) -> Iterator[Problem]:
    """Yield a warning for each quantity that is probably wrong.

    Its subject is "arguments" and the path in the vehicle file.
    """
    if model.airframe or model.craft or model.boat:
        yield from _size_warnings(model)
    if model.airframe:
        yield from _thrust_warnings(model.airframe)
        yield from _rotor_warnings(model.airframe, _reach(model))
    if model.boat or model.craft:
        from .vessel_plausibility import vessel_warnings  # needs the modules of all vessels

        yield from vessel_warnings(model, box_corners(model), MAX_EXTENT[True])


def box_corners(model: Model) -> np.ndarray:
    """Return the corners of all boxes (m, body frame), shape (n, 3).

    Of a vessel from O, else from the centre of mass.
    """
    corners: np.ndarray = np.concatenate([box.corners() for box in model.body.boxes])
    axis, w = np.array(model.body.axes[:3]), model.body.axes[3]
    corners = corners + 2 * np.cross(axis, w * corners + np.cross(axis, corners))
    return (
        corners + model.boat.centre_of_mass if model.boat and model.motion == "planar" else corners
    )


def _reach(model: Model) -> float:
    """Return the distance of the farthest corner of the boxes from the centre of mass (m)."""
    centre = model.boat.centre_of_mass if model.boat else 0.0
    return float(np.linalg.norm(box_corners(model) - centre, axis=1).max())


def _actuators(model: Model) -> Sequence[Rotor | Thruster | Propeller]:
    if model.airframe:
        return model.airframe.rotors
    if model.craft:
        return model.craft.thrusters
    return model.boat.propellers if model.boat else ()


def _size_warnings(model: Model) -> Iterator[Problem]:
    reach = _reach(model)
    if reach > (limit := MAX_EXTENT[model.is_vessel]) / 2:
        yield warning(
            (
                f"a corner is {reach:.4g} m from the centre of mass, expected less than "
                f"{limit / 2:g} m"
            ),
            "boxes",
        )
    farthest = max(reach, *(float(np.linalg.norm(part.position)) for part in _actuators(model)))
    radius = math.sqrt(max(model.body.inertia) / model.body.mass)
    if radius > farthest:
        key = "yaw_inertia" if model.motion == "planar" else "inertia"
        text = (
            f"the radius of gyration, the square root of inertia over mass, is {radius:.3g} m, "
            "but the farthest point of "
            f"the vehicle is {farthest:.3g} m from the centre of mass"
        )
        yield warning(text, key)


def _thrust_warnings(airframe: Airframe) -> Iterator[Problem]:
    ratio = airframe.lift / (airframe.mass * airframe.gravity)
    if ratio > MAX_THRUST_RATIO:
        text, *path = _cause_of_thrust(airframe)
        yield warning(
            f"thrust over weight is {ratio:.3g}, expected less than {MAX_THRUST_RATIO:g}{text}",
            *path,
        )
    elif ratio < MIN_THRUST_RATIO:
        text = (
            f"thrust over weight is {ratio:.3g}, expected more than {MIN_THRUST_RATIO:g}: it can "
            "hardly climb"
        )
        yield warning(text, "mass")


def _cause_of_thrust(airframe: Airframe) -> tuple[str, ...]:
    """Return the probable cause of a thrust that is too large, and the path of its key."""
    tip_speed = airframe.max_rotor_speed * airframe.rotor_radius
    if tip_speed > MAX_TIP_SPEED:
        found = (
            f"{airframe.max_rotor_speed:.4g} rad/s make {tip_speed:.4g} m/s at the tips of the "
            "rotors"
        )
        return f"; {found}: is max_speed in rpm?", "rotor", "max_speed"
    area, thrust = (
        math.pi * airframe.rotor_radius**2,
        max(rotor.thrust_coefficient for rotor in airframe.rotors),
    )
    coefficient = thrust / (_AIR_DENSITY * area * airframe.rotor_radius**2)
    if coefficient > MAX_THRUST_COEFFICIENT:
        text = (
            f"; the thrust is {coefficient:.3g} times air density, disc area and squared tip "
            "speed, about 0.01 is usual"
        )
        return text, "rotor", "thrust_coefficient"
    return "", "mass"


def _rotor_warnings(airframe: Airframe, reach: float) -> Iterator[Problem]:
    distances = [float(np.linalg.norm(rotor.position)) for rotor in airframe.rotors]
    ordered, middle = sorted(distances), len(distances) // 2
    # not np.median, whose first call imports masked arrays for 0.04 s
    median = (ordered[middle] + ordered[-1 - middle]) / 2
    limit = MAX_ROTOR_DISTANCE * max(airframe.rotor_radius, min(median, 2 * reach))
    for i, (rotor, distance) in enumerate(zip(airframe.rotors, distances, strict=True)):
        if distance > limit:
            text = f"{distance:.4g} m from the centre of mass, expected less than {limit:.3g} m"
            yield warning(text, "rotors", str(i), "position")
        if rotor.axis[2] < _DOWNWARDS:
            axis = ", ".join(f"{round(each, 3):g}" for each in rotor.axis)
            yield warning(
                f"the rotor pushes downwards, its thrust points along [{axis}]",
                "rotors",
                str(i),
                "axis",
            )
    torques = [
        rotor.thrust_coefficient * np.cross(rotor.position, rotor.axis)[2]
        + rotor.torque_sign * rotor.torque_coefficient * rotor.axis[2]
        for rotor in airframe.rotors
    ]
    if min(torques) > 0 or max(torques) < 0:
        text = (
            "all turn the vehicle about z in the same direction, it cannot hold its yaw angle: "
            "change turns of some"
        )
        yield warning(text, "rotors")
