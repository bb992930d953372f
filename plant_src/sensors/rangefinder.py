"""Rangefinder: distance along a beam to a deck, a platform or the water, by ray casting."""

import math
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

from ..catalogue import VEHICLE_MODELS
from ..json_reader import JsonReader
from ..physics.bullet import create_compound_shape, pybullet
from ..vehicles.common.shapes import Box, Shape
from .rotations import Vector, add_scaled, to_world
from .signal_component import Measurement, SampledSensor, timing_variables
from .variable_declarations import (
    array_parameter,
    boolean_variable,
    check_arguments,
    pose_inputs,
    read_platforms,
    real_parameter,
    real_variable,
    seed_parameter,
)

_POSE_SIZE = 7  # scalars of a position and an orientation
_HIT_BODY, _HIT_FRACTION = 0, 2  # fields of a result of pybullet.rayTest


class Rangefinder(SampledSensor):
    """Laser rangefinder with noise that grows with the distance.

    Error model: distance = true + max(noise_floor, noise_share * true) * n with a standard normal
    n. Without an object between `nearest` and `farthest`, `distance` is `farthest` and `valid` is
    false. Default values: Benewake TFmini-S data sheet, 0.1 to 12 m, 100 Hz; its accuracy of 6 cm,
    1 % beyond 6 m, is taken as three standard deviations.

    Vessels and platforms are copies in a separate Bullet client, because the bodies of the world
    are parked while nothing is near them. The water is the plane z = 0 without waves.

    Inputs: `vehicle.position` (m, world) and `vehicle.orientation` (unit quaternion, body to
    world); `NAME.deck.position` and `NAME.orientation` of each vessel. Outputs: `distance` (m, from
    the sensor along its beam), `time` of the sample (s), `valid`. Parameters: `mounting` (m, body
    axes, from the centre of mass), `direction` of the beam (body axes).

    Args:
        instance_name: Name of the component.
        vessels: Vessel of the catalogue by name ({"usv": "strider"}).
        platforms: Platforms as in the arguments of the plant.
        water: True if the plane z = 0 stops the beam.
        seed: Seed of all random numbers, together with the name of the component.

    Raises:
        InputError: One or more arguments are invalid; lists all problems.
    """

    random_number_count = 1

    def __init__(
        self,
        instance_name: str,
        vessels: Mapping[str, str] | None = None,
        platforms: Mapping[str, Any] | None = None,
        water: bool = True,
        seed: int = 0,
    ):
        reader = JsonReader()
        bodies = _read_vessels(reader, vessels or {})
        boxes = read_platforms(reader, platforms or {})
        check_arguments(reader, seed)
        deck_inputs = [pose_inputs(name, "deck.position") for name in bodies]
        super().__init__(
            instance_name,
            [
                *pose_inputs("vehicle"),
                *chain.from_iterable(deck_inputs),
                real_parameter("noise_floor", "m", 0.02, "standard deviation close by"),
                real_parameter(
                    "noise_share", "1", 0.01 / 3, "standard deviation per distance far away"
                ),
                real_parameter("nearest", "m", 0.1, "smallest distance that is measured"),
                real_parameter("farthest", "m", 12.0, "largest distance that is measured"),
                array_parameter(
                    "mounting", "m", (0.0, 0.0, 0.0), "place on the vehicle, body axes"
                ),
                array_parameter("direction", "1", (0.0, 0.0, -1.0), "of the beam, body axes"),
                seed_parameter(seed),
                real_variable("distance", "m", "output"),
                *timing_variables(100.0),
                boolean_variable("valid", "output", "something is in reach"),
            ],
        )
        self._water = water
        self._client = pybullet.connect(pybullet.DIRECT)
        for (length, width, height), position in boxes:
            half_extents = (length / 2, width / 2, height / 2)
            self._add_body([Box(half_extents, (0.0, 0.0, 0.0))], position)
        self._bodies = [self._add_body(body, (0.0, 0.0, 0.0)) for body in bodies.values()]

    def _add_body(self, boxes: Sequence[Shape], position: Sequence[float]) -> int:
        shape = create_compound_shape(boxes, self._client)
        return int(pybullet.createMultiBody(0, shape, -1, position, physicsClientId=self._client))

    def apply_parameters(self) -> None:
        """Normalise the direction of the beam."""
        length = math.hypot(*self.parameters["direction"])
        if not length:
            raise ValueError("found a direction of length 0, expected a nonzero vector")
        self._direction = [x / length for x in self.parameters["direction"]]

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Return the distance (m) and if it is valid; see `SampledSensor.measure`."""
        p, attitude = self.parameters, self.inputs[3:7]
        start = add_scaled(self.inputs, 1.0, to_world(attitude, p["mounting"]))
        beam = to_world(attitude, self._direction)
        true = self._distance_to_solids(start, beam)
        if self._water and start[2] > 0 > beam[2]:
            true = min(true, -start[2] / beam[2])
        if not p["nearest"] <= true <= p["farthest"]:
            return (p["farthest"],), (False,)
        sigma = max(p["noise_floor"], p["noise_share"] * true)
        return (true + sigma * self.noise[number][0],), (True,)

    def _distance_to_solids(self, start: Vector, beam: Vector) -> float:
        """Return the distance (m) from `start` (m, world) along a unit vector to the solids."""
        for number, body in enumerate(self._bodies, 1):
            x, y, z, qw, qx, qy, qz = self.inputs[_POSE_SIZE * number : _POSE_SIZE * (number + 1)]
            pybullet.resetBasePositionAndOrientation(
                body, (x, y, z), (qx, qy, qz, qw), physicsClientId=self._client
            )
        reach = self.parameters["farthest"] * 1.01
        end = add_scaled(start, reach, beam)
        (hit,) = pybullet.rayTest(start, end, physicsClientId=self._client)
        return hit[_HIT_FRACTION] * reach if hit[_HIT_BODY] >= 0 else math.inf

    def free(self) -> None:
        """Disconnect the Bullet client."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1


def _read_vessels(reader: JsonReader, vessels: Any) -> dict[str, Sequence[Shape]]:
    """Return the boxes of each vessel, relative to the centre of its deck."""
    models = {kind: next(iter(variants.values())) for kind, variants in VEHICLE_MODELS.items()}
    valid = [kind for kind, model in models.items() if model.is_vessel]
    boxes: dict[str, Sequence[Shape]] = {}
    for name, kind in reader.read_named_objects(vessels, ("vessels",)).items():
        body = models[reader.choice(kind, ("vessels", name), valid)].body
        # the centre of the top of the first box, the deck, becomes the origin, because the centre
        # of mass of some vessels depends on their payload
        deck = body.boxes[0]
        x, y, z = deck.position
        offset = (-x, -y, -z - deck.half_extents[2])
        boxes[name] = [box.moved(offset) for box in body.boxes]
    return boxes
