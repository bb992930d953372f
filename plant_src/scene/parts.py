"""Visual shapes of vehicles, take-off platforms and trees, made from boxes, cylinders and spheres.

The shapes have no influence on the dynamics. Dimensions come from the geometry of the vehicles
where it defines them.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, Literal, NamedTuple

import numpy as np

from ..catalogue import Model, default_model
from ..placement import Obstacle
from ..vehicles.common.shapes import Body, Quaternion, Shape, Vector
from ..vehicles.multirotor.airframe import Airframe, Rotor
from ..vehicles.strider import parameters as strider_geometry
from ..vehicles.strider.parameters import (
    DECK_TOP,
    DECK_X,
    DECK_Y,
    HULL_BOTTOM,
    HULL_LENGTH,
    HULL_OFFSET,
)
from ..vehicles.submerged.craft import Craft
from ..vehicles.surface_vessel.surface_vessel import SurfaceVessel

IDENTITY_QUATERNION: Quaternion = (0.0, 0.0, 0.0, 1.0)
#: turns a cylinder's axis from z to x
ALONG_X: Quaternion = (0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5))
#: x turned by -45 degrees about z
BETWEEN_ARMS: Quaternion = (0.0, 0.0, -math.sin(math.pi / 8), math.cos(math.pi / 8))

WHITE, BLACK = (0.95, 0.95, 0.95), (0.09, 0.09, 0.10)
GREY, SILVER = (0.35, 0.36, 0.38), (0.70, 0.72, 0.75)
ORANGE, RED = (0.96, 0.48, 0.08), (0.84, 0.18, 0.12)
YELLOW, BLUE = (0.98, 0.80, 0.18), (0.10, 0.32, 0.58)
PLANKS = ((0.64, 0.47, 0.30), (0.58, 0.42, 0.26), (0.68, 0.51, 0.33))
BARK = (0.36, 0.26, 0.17)
LEAVES = ((0.22, 0.42, 0.17), (0.28, 0.48, 0.19), (0.18, 0.36, 0.18), (0.36, 0.50, 0.20))


class Part(NamedTuple):
    """Coloured solid in the frame of its object.

    `size` (m) is: box: three edges; cylinder: radius and length along z; sphere: radius; mesh:
    corners of all triangles, nine numbers each. `position` (m) is the centre, `orientation` a unit
    quaternion (x, y, z, w), `colour` red, green, blue in 0 ... 1. Only the 3-D replay draws an
    `opacity` below 1.
    """

    shape: Literal["box", "cylinder", "sphere", "mesh"]
    size: tuple[float, ...]
    position: Vector
    colour: Vector
    orientation: Quaternion = IDENTITY_QUATERNION
    opacity: float = 1.0

    def bounding_radius(self) -> float:
        """Return the radius of the bounding sphere about the centre (m)."""
        match self.shape:
            case "box":
                return math.hypot(*self.size) / 2
            case "cylinder":
                return math.hypot(self.size[0], self.size[1] / 2)
            case "sphere":
                return self.size[0]
            case "mesh":
                return float(np.linalg.norm(np.reshape(self.size, (-1, 3)), axis=1).max())


#: distance of the feet from the middle of the AR.Drone, and length of its legs (m)
_FOOT_DISTANCE, _LEG = 0.1612, 0.0566


def ar_drone_parts(model: Model) -> list[Part]:
    """Return the parts of the AR.Drone relative to its centre of mass.

    Arms along the body axes, hull between two arms.
    """
    assert model.airframe is not None
    rotors = [rotor.position for rotor in model.airframe.rotors]
    arm = rotors[0][0]
    body = [
        Part("box", (0.26, 0.075, 0.045), (0.0, 0.0, 0.0), ORANGE, BETWEEN_ARMS),
        Part("box", (0.12, 0.10, 0.055), (0.0, 0.0, 0.012), BLACK, BETWEEN_ARMS),
        Part("sphere", (0.025,), (0.092, -0.092, 0.0), BLACK),
        Part("box", (2 * arm, 0.014, 0.014), (0.0, 0.0, 0.0), BLACK),
        Part("box", (0.014, 2 * rotors[1][1], 0.014), (0.0, 0.0, 0.0), BLACK),
    ]
    for (x, y, z), colour in zip(rotors, (RED, SILVER, SILVER, RED), strict=True):
        body += _rotor_parts(x, y, z, colour, _FOOT_DISTANCE / arm)
    return body


def _rotor_parts(x: float, y: float, z: float, colour: Vector, ratio: float) -> list[Part]:
    return [
        Part("cylinder", (0.012, _LEG), (ratio * x, ratio * y, -_LEG / 2), GREY),
        Part("cylinder", (0.103, 0.004), (x, y, z + 0.012), BLACK, opacity=0.5),
        Part("cylinder", (0.095, 0.006), (x, y, z + 0.012), colour, opacity=0.6),
        Part("cylinder", (0.014, 0.02), (x, y, z + 0.01), BLACK),
    ]


def strider_parts(_model: Model) -> list[Part]:
    """Return the parts of the Strider relative to its centre of mass.

    Hulls, struts and landing deck.
    """
    x, y, _ = strider_geometry.DECK_CENTRE
    length, width = DECK_X[1] - DECK_X[0], DECK_Y[1] - DECK_Y[0]
    plate = strider_geometry.PLATE_THICKNESS
    top = DECK_TOP - plate / 2
    parts = [
        Part("box", (length, width, plate), (x, y, top), GREY),
        Part(
            "box",
            strider_geometry.HOUSING_SIZE,
            (x, y, top - plate / 2 - strider_geometry.HOUSING_SIZE[2] / 2),
            BLUE,
        ),
        Part("box", (0.004, 0.06, 0.09), (-0.46, 0.0, -0.11), BLACK),
        Part("cylinder", (0.008, 0.2), (-0.46, 0.0, 0.0), BLACK),
        Part("box", (0.16, 0.012, 0.012), (-0.40, 0.0, 0.09), BLACK),
        *landing_mark(x, y, DECK_TOP),
    ]
    for side in (-1.0, 1.0):
        parts += _strider_hull_parts(side * HULL_OFFSET)
        parts += [_strut(end * 0.24, side, width / 2) for end in (-1.0, 1.0)]
    return parts


def landing_mark(x: float, y: float, z: float) -> list[Part]:
    """Return the landing mark: a white ring and a white H around (x, y) at the height z (m)."""
    disc = [
        Part("cylinder", (radius, 0.002), (x, y, z + rise), colour)
        for radius, rise, colour in _RINGS
    ]
    bars = [
        Part("box", (0.20, 0.03, 0.002), (x, y + side * 0.06, z + 0.004), WHITE)
        for side in (-1.0, 1.0)
    ]
    return [*disc, *bars, Part("box", (0.03, 0.12, 0.002), (x, y, z + 0.004), WHITE)]


_RINGS = ((0.24, 0.001, WHITE), (0.21, 0.002, GREY))


def _strider_hull_parts(y: float) -> list[Part]:
    radius, half = 0.055, HULL_LENGTH / 2
    z = HULL_BOTTOM + radius - 0.03
    straight = 2 * (half - radius)
    ends = [Part("sphere", (radius,), (end * (half - radius), y, z), YELLOW) for end in (-1.0, 1.0)]
    stripe = Part("box", (straight, 0.03, 0.02), (0.0, y, z + radius), GREY)
    return [Part("cylinder", (radius, straight), (0.0, y, z), YELLOW, ALONG_X), *ends, stripe]


def _strut(x: float, side: float, deck_edge: float) -> Part:
    """Return a strut from a hull to the edge of the deck."""
    outer, low, inner, high = HULL_OFFSET, -0.07, deck_edge - 0.02, DECK_TOP - 0.03
    run, rise = inner - outer, high - low
    angle = side * math.atan2(-run, rise)  # about x, from z towards the middle
    turn = (math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2))
    return Part(
        "cylinder",
        (0.013, math.hypot(run, rise)),
        (x, side * (outer + inner) / 2, (low + high) / 2),
        SILVER,
        turn,
    )


def platform_parts(
    size: Sequence[float], position: Sequence[float], plank: float = 0.25
) -> Iterator[Part]:
    """Yield the parts of a take-off platform: planks on posts.

    Args:
        size: Edges (m).
        position: Centre (m, world).
        plank: Approximate width of a plank (m).

    Yields:
        Parts in the world frame.
    """
    (length, width, thickness), (x, y, z) = size, position
    count = max(1, round(width / plank))
    pitch = width / count
    for i in range(count):
        centre = (x, y - width / 2 + (i + 0.5) * pitch, z)
        yield Part("box", (length, pitch - 0.012, thickness), centre, PLANKS[i * 7 % len(PLANKS)])
    post = z - thickness / 2
    for east in (-0.46, 0.0, 0.46):
        for north in (-0.46, 0.46):
            yield Part(
                "cylinder", (0.09, post), (x + east * length, y + north * width, post / 2), BARK
            )


def tree_parts() -> Iterator[Part]:
    """Yield the parts of the trees on the banks north and west of the lake."""
    random = np.random.default_rng(4)
    for x in np.arange(-44.0, 90.0, 3.4):
        yield from single_tree_parts(
            x + random.uniform(-1.2, 1.2), 37.5 + random.uniform(0.0, 9.0), random
        )
    for y in np.arange(-34.0, 34.0, 3.6):
        yield from single_tree_parts(
            -23.0 - random.uniform(0.0, 9.0), y + random.uniform(-1.2, 1.2), random
        )


def single_tree_parts(x: float, y: float, random: np.random.Generator) -> Iterator[Part]:
    """Yield the trunk and the crown of a tree of 4 to 7 m at (x, y) (m, world)."""
    height = random.uniform(4.0, 7.0)
    leaves = LEAVES[random.integers(len(LEAVES))]
    yield Part("cylinder", (0.035 * height, 0.6 * height), (x, y, 0.3 * height), BARK)
    for level in (0.5, 0.66, 0.82):
        radius = height * (0.34 - 0.24 * (level - 0.5)) * random.uniform(0.85, 1.1)
        east, north = random.uniform(-0.08, 0.08, 2) * height
        yield Part("sphere", (radius,), (x + float(east), y + float(north), level * height), leaves)


def obstacle_part(obstacle: Obstacle) -> Part:
    """Return the mesh of an obstacle."""
    corners = obstacle.triangles.reshape(-1, 3)
    x, y, z = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
    return Part("mesh", tuple((corners - [x, y, z]).ravel().tolist()), (x, y, z), obstacle.colour)


def static_parts(platforms: Mapping[str, Any], obstacles: Sequence[Obstacle]) -> list[Part]:
    """Return the parts of platforms and obstacles (JSON objects by name, obstacles)."""
    decks = [platform_parts(each["size"], each["position"]) for each in platforms.values()]
    return [*chain.from_iterable(decks), *map(obstacle_part, obstacles)]


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
    model = default_model(vehicle)
    if model.name in DETAILED_MODELS and isinstance(vehicle, str):
        return DETAILED_MODELS[model.name](model)
    if model.visual is not None:
        # the positions of a file's triangles start from the origin of the file
        centre = model.boat.centre_of_mass if model.boat else (0.0, 0.0, 0.0)
        corners, colour = tuple(model.visual.ravel().tolist()), YELLOW if model.boat else ORANGE
        return [Part("mesh", corners, _difference((0.0, 0.0, 0.0), centre), colour)]
    if model.airframe:
        return list(multirotor_parts(model.airframe, model.body))
    if model.craft:
        return list(submerged_parts(model.craft, model.body))
    found = catamaran_parts(model.body, has_landings) if model.is_vessel else box_parts(model.body)
    if not isinstance(model.boat, SurfaceVessel):
        return list(found)
    # the collision shape of a floating vessel has the origin of its file, not the centre of mass
    centre = model.boat.centre_of_mass
    return [part._replace(position=_difference(part.position, centre)) for part in found]


def _difference(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def box_parts(body: Body) -> Iterator[Part]:
    """Yield the collision boxes of a vehicle."""
    for box in body.boxes:
        x, y, z = box.half_extents
        yield Part("box", (2 * x, 2 * y, 2 * z), box.position, GREY, box.orientation)


def catamaran_parts(body: Body, has_landings: bool) -> Iterator[Part]:
    """Yield cylindrical hulls in place of the lower collision boxes, and struts to the deck.

    The landing deck is the highest box.
    """
    deck = max(body.boxes, key=lambda box: box.position[2])
    (length, width, thickness), (x, y, z) = deck.half_extents, deck.position
    aft = width if len(body.boxes) == 1 else 0.0
    yield Part("box", (2 * length - aft, 2 * width, 2 * thickness), (x - aft / 2, y, z), GREY)
    yield from landing_mark(x, y, z + thickness) if has_landings else ()
    if len(body.boxes) == 1:  # a single hull: the turned box below the deck is its bow
        edge, bow = math.sqrt(2) * width, (x + length - width, y, z)
        turn = (0.0, 0.0, math.sin(math.pi / 8), math.cos(math.pi / 8))
        yield Part("box", (edge, edge, 1.99 * thickness), bow, YELLOW, turn)
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
    # a leg at each lower corner of the collision boxes
    for box in body.boxes:
        corners = sorted(box.corners().tolist(), key=lambda corner: corner[2])
        for x, y, z in corners[:4]:
            yield Part("cylinder", (0.035 * arm, height - z), (x, y, (height + z) / 2), GREY)


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
    """Yield skids, float and electronics tube of each collision box, and ducted thrusters."""
    for box in body.boxes:
        (x, y, z), (length, width, height) = box.position, box.half_extents
        top, low = z + 0.6 * height, z - 0.2 * height
        skid_size = (2 * length, 0.06 * width, 1.6 * height)
        float_size = (1.8 * length, 1.4 * width, 0.7 * height)
        yield Part("box", float_size, (x, y, top), BLUE, box.orientation)
        yield Part("cylinder", (0.4 * height, 1.6 * length), (x, y, low), BLACK, ALONG_X)
        yield Part("sphere", (0.38 * height,), (x + 0.8 * length, y, low), SILVER)
        for side in (-0.9, 0.9):
            yield Part("box", skid_size, (x, y + side * width, low), BLACK)
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
