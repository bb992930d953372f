"""Visual parts of each vehicle.

Detailed models, or parts derived from the rotors or from the collision boxes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from ..catalogue import models_of
from ..vehicles.common.shapes import Body, Quaternion, Shape, Vector
from ..vehicles.model import Model
from ..vehicles.multirotor.airframe import Airframe, Rotor
from ..vehicles.submerged.craft import Craft
from ..vehicles.surface_vessel.surface_vessel import SurfaceVessel
from .parts import (
    ALONG_X,
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    RED,
    SILVER,
    YELLOW,
    Part,
    ar_drone_parts,
    landing_mark,
    strider_parts,
)

#: model -> function that draws it in detail
DETAILED_MODELS: Mapping[str, Callable[[Model], list[Part]]] = {
    "ar_drone": ar_drone_parts,
    "strider": strider_parts,
}


def vehicle_parts(vehicle: Any, has_landings: bool = True) -> list[Part]:
    """Return the parts of a vehicle in its body frame, relative to its centre of mass.

    Args:
        vehicle: Name of a vehicle of the catalogue ("crazyflie"), or its data.
        has_landings: Draw a landing mark on a vessel that is drawn from its collision boxes.
    """
    model = next(iter(models_of(vehicle).values()))
    if model.name in DETAILED_MODELS and isinstance(vehicle, str):
        return DETAILED_MODELS[model.name](model)
    if model.visual is not None:
        return [_mesh_part(model, model.visual)]
    if model.airframe:
        return list(multirotor_parts(model.airframe, model.body))
    if model.craft:
        return list(submerged_parts(model.craft, model.body))
    parts = list(
        catamaran_parts(model.body, has_landings) if model.is_vessel else box_parts(model.body)
    )
    return [
        part._replace(position=_difference(part.position, _origin_of_boxes(model)))
        for part in parts
    ]


def _mesh_part(model: Model, triangles: np.ndarray) -> Part:
    """Return the triangles of a vehicle file, whose positions start from the origin of the file."""
    centre = model.boat.centre_of_mass if model.boat else (0.0, 0.0, 0.0)
    return Part(
        "mesh",
        tuple(triangles.ravel().tolist()),
        _difference((0.0, 0.0, 0.0), centre),
        YELLOW if model.boat else ORANGE,
    )


def _origin_of_boxes(model: Model) -> Vector:
    """Return the centre of mass from the origin of the collision shape, which is that of the file of a floating vessel."""
    return model.boat.centre_of_mass if isinstance(model.boat, SurfaceVessel) else (0.0, 0.0, 0.0)


def _difference(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def box_parts(body: Body) -> Iterator[Part]:
    """Yield the collision boxes of a vehicle."""
    for box in body.boxes:
        x, y, z = box.half_extents
        yield Part("box", (2 * x, 2 * y, 2 * z), box.position, GREY, box.orientation)


def catamaran_parts(body: Body, has_landings: bool) -> Iterator[Part]:
    """Yield cylindrical hulls in place of the lower collision boxes, and struts to the landing deck, the highest box."""
    deck = max(body.boxes, key=lambda box: box.position[2])
    (length, width, thickness), (x, y, z) = deck.half_extents, deck.position
    aft = width if len(body.boxes) == 1 else 0.0
    yield Part("box", (2 * length - aft, 2 * width, 2 * thickness), (x - aft / 2, y, z), GREY)
    yield from landing_mark(x, y, z + thickness) if has_landings else ()
    if len(body.boxes) == 1:  # a single hull: the turned box below the deck is its bow
        bow, turn = (
            (x + length - width, y, z),
            (0.0, 0.0, math.sin(math.pi / 8), math.cos(math.pi / 8)),
        )
        yield Part(
            "box", (math.sqrt(2) * width, math.sqrt(2) * width, 1.99 * thickness), bow, YELLOW, turn
        )
        return
    for hull in body.boxes:
        if hull is not deck:
            yield from _hull_parts(hull, x - 0.8 * length, x + 0.8 * length, z)


def _hull_parts(hull: Shape, aft: float, fore: float, deck: float) -> Iterator[Part]:
    (length, beam, _), (x, y, z) = hull.half_extents, hull.position
    yield Part("cylinder", (beam, 2 * (length - beam)), hull.position, YELLOW, ALONG_X)
    for end in (-1.0, 1.0):
        yield Part("sphere", (beam,), (x + end * (length - beam), y, z), YELLOW)
    for strut in (aft, fore):
        yield Part("cylinder", (0.16 * beam, deck - z), (strut, y, (deck + z) / 2), SILVER)


def multirotor_parts(airframe: Airframe, body: Body) -> Iterator[Part]:
    """Yield a hull, legs, and for each rotor an arm, a motor and a propeller disc.

    Discs in front are red.
    """
    (_, _, height), _ = airframe.rotor_disc
    arm = max(math.hypot(*rotor.position[:2]) for rotor in airframe.rotors)
    hull = 0.42 * arm
    yield Part("cylinder", (hull, 0.28 * arm), (0.0, 0.0, height - 0.16 * arm), BLACK)
    yield Part("box", (1.2 * hull, 0.7 * hull, 0.3 * arm), (0.0, 0.0, height - 0.05 * arm), ORANGE)
    yield Part("sphere", (0.16 * arm,), (0.8 * hull, 0.0, height - 0.3 * arm), GREY)
    for rotor in airframe.rotors:
        yield from _arm_parts(rotor, airframe.rotor_radius, arm)
    yield from _leg_parts(body, 0.035 * arm, height)


def _arm_parts(rotor: Rotor, radius: float, arm: float) -> Iterator[Part]:
    x, y, z = rotor.position
    thickness, turn = 0.06 * arm, math.atan2(y, x) / 2
    along: Quaternion = (0.0, 0.0, math.sin(turn), math.cos(turn))
    yield Part(
        "box", (math.hypot(x, y), thickness, thickness), (x / 2, y / 2, z - 0.12 * arm), GREY, along
    )
    yield Part("cylinder", (0.07 * arm, 0.16 * arm), (x, y, z - 0.06 * arm), BLACK)
    colour: Vector = RED if x > 1e-6 else SILVER
    yield Part("cylinder", (0.98 * radius, 0.012 * arm), (x, y, z + 0.02 * arm), BLACK, opacity=0.5)
    yield Part("cylinder", (0.9 * radius, 0.02 * arm), (x, y, z + 0.02 * arm), colour, opacity=0.6)


def submerged_parts(craft: Craft, body: Body) -> Iterator[Part]:
    """Yield the skids and the float of each collision box, an electronics tube, and the thrusters with their ducts."""
    for box in body.boxes:
        (x, y, z), (length, width, height) = box.position, box.half_extents
        yield Part(
            "box",
            (1.8 * length, 1.4 * width, 0.7 * height),
            (x, y, z + 0.6 * height),
            BLUE,
            box.orientation,
        )
        yield Part(
            "cylinder", (0.4 * height, 1.6 * length), (x, y, z - 0.2 * height), BLACK, ALONG_X
        )
        yield Part("sphere", (0.38 * height,), (x + 0.8 * length, y, z - 0.2 * height), SILVER)
        for side in (-0.9, 0.9):
            yield Part(
                "box",
                (2 * length, 0.06 * width, 1.6 * height),
                (x, y + side * width, z - 0.2 * height),
                BLACK,
            )
    radius = craft.thruster_radius
    for thruster in craft.thrusters:
        turn = rotation_from_z(thruster.axis)
        yield Part("cylinder", (1.25 * radius, 1.3 * radius), thruster.position, GREY, turn)
        yield Part("cylinder", (0.45 * radius, 2.6 * radius), thruster.position, BLACK, turn)


def rotation_from_z(axis: Vector) -> Quaternion:
    """Return the shortest rotation (x, y, z, w) from the z axis to a unit vector."""
    x, y, z = axis
    if z < -1 + 1e-9:
        return 1.0, 0.0, 0.0, 0.0
    w = math.sqrt((1 + z) / 2)
    return -y / (2 * w), x / (2 * w), 0.0, w


def _leg_parts(body: Body, radius: float, top: float) -> Iterator[Part]:
    """Yield a leg at each lower corner of the collision boxes."""
    for box in body.boxes:
        corners = sorted(box.corners().tolist(), key=lambda corner: corner[2])
        for x, y, z in corners[:4]:
            yield Part("cylinder", (radius, top - z), (x, y, (top + z) / 2), GREY)
