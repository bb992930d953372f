"""Rangefinder: the distance along a beam to the next deck, platform or the water, by Bullet's ray test."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..catalogue import VEHICLE_MODELS
from ..json_reader import JsonReader
from ..physics.body import create_compound_shape
from ..physics.client import pybullet
from ..vehicles.common.shapes import Box
from .rotations import Vector, to_world
from .sampled_sensor import Measurement, SampledSensor, timing_variables
from .signal_component import (
    boolean_variable,
    check_seed,
    pose_inputs,
    raise_problems,
    real_parameter,
    real_variable,
    seed_parameter,
)

_POSE_SIZE = 7  # numbers of a position and an orientation
_HIT_BODY, _HIT_FRACTION = 0, 2  # fields of what Bullet says of a ray


class Rangefinder(SampledSensor):
    """`distance` (m) from the sensor along its beam, `valid`, `time` (s).

    distance = true + max(noise_floor, noise_share * true) * n; nothing between `nearest` and `farthest`: `distance` is
    `farthest` and `valid` false. The sensor sits at `mounting` (m, body axes, from the centre of mass) and looks along
    `direction` (body axes). Numbers: Benewake TFmini-S data sheet: 0.1 to 12 m, 100 Hz, 6 cm, 1 % beyond 6 m, taken for three
    standard deviations.

    `vessels`: name -> vehicle of the catalogue ("usv": "strider"), for each of which there are inputs `NAME.deck.position`
    and `NAME.orientation`; `platforms` as in the world; `water`: whether the plane z = 0 stops the beam. Vehicles' bodies and
    platforms are copies in a Bullet client of its own: those of the world are put aside while nothing is near. Raises InputError
    with all problems. Inputs: `vehicle.position`, `vehicle.orientation`.
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
        boxes = _read_platforms(reader, platforms or {})
        check_seed(reader, seed)
        raise_problems(reader)
        super().__init__(
            instance_name,
            [
                *pose_inputs("vehicle"),
                *(variable for name in bodies for variable in pose_inputs(name, "deck.position")),
                real_parameter("noise_floor", "m", 0.02, "standard deviation close by"),
                real_parameter("noise_share", "1", 0.01 / 3, "standard deviation per distance far away"),
                real_parameter("nearest", "m", 0.1, "smallest distance that is measured"),
                real_parameter("farthest", "m", 12.0, "largest distance that is measured"),
                real_variable("mounting", "m", "parameter", (0.0, 0.0, 0.0), "place on the vehicle, body axes", shape=(3,)),
                real_variable("direction", "1", "parameter", (0.0, 0.0, -1.0), "of the beam, body axes", shape=(3,)),
                seed_parameter(seed),
                real_variable("distance", "m", "output"),
                *timing_variables(100.0),
                boolean_variable("valid", "output", "something is in reach"),
            ],
        )
        self._water = water
        self._client = pybullet.connect(pybullet.DIRECT)
        for size, position in boxes:
            self._add_body([Box((size[0] / 2, size[1] / 2, size[2] / 2), (0.0, 0.0, 0.0))], position)
        self._bodies = [self._add_body(body, (0.0, 0.0, 0.0)) for body in bodies.values()]

    def _add_body(self, boxes: Sequence[Box], position: Sequence[float]) -> int:
        shape = create_compound_shape(boxes, self._client)
        return int(pybullet.createMultiBody(0, shape, -1, position, physicsClientId=self._client))

    def apply_parameters(self) -> None:
        length = math.hypot(*self.parameters["direction"])
        if not length:
            raise ValueError("found a direction of length 0")
        self._direction = [x / length for x in self.parameters["direction"]]

    def measure(self, number: int, elapsed: float) -> Measurement:
        p, true = self.parameters, self._distance()
        if not p["nearest"] <= true <= p["farthest"]:
            return (p["farthest"],), (False,)
        return (true + max(p["noise_floor"], p["noise_share"] * true) * self.noise[number][0],), (True,)

    def _distance(self) -> float:
        """True distance along the beam, infinite when nothing is in reach."""
        x, y, z = self.inputs[:3]
        a, b, c = to_world(self.inputs[3:7], self.parameters["mounting"])
        start = (x + a, y + b, z + c)
        beam = to_world(self.inputs[3:7], self._direction)
        return min(self._to_solids(start, beam), self._to_water(start, beam))

    def _to_solids(self, start: Vector, beam: Vector) -> float:
        for number, body in enumerate(self._bodies, 1):
            x, y, z, qw, qx, qy, qz = self.inputs[_POSE_SIZE * number : _POSE_SIZE * (number + 1)]
            pybullet.resetBasePositionAndOrientation(body, (x, y, z), (qx, qy, qz, qw), physicsClientId=self._client)
        reach = self.parameters["farthest"] * 1.01
        end = [place + reach * part for place, part in zip(start, beam, strict=True)]
        (found,) = pybullet.rayTest(start, end, physicsClientId=self._client)
        return found[_HIT_FRACTION] * reach if found[_HIT_BODY] >= 0 else math.inf

    def _to_water(self, start: Vector, beam: Vector) -> float:
        return -start[2] / beam[2] if self._water and start[2] > 0 > beam[2] else math.inf

    def free(self) -> None:
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1


def _read_vessels(reader: JsonReader, vessels: Any) -> dict[str, Sequence[Box]]:
    """The shapes of each vessel in its axes, from the centre of its deck."""
    known = {name: next(iter(models.values())) for name, models in VEHICLE_MODELS.items()}
    valid = [name for name, model in known.items() if model.is_vessel]
    named = reader.read_named_objects(vessels, ("vessels",)).items()
    return {name: _relative_to_deck(known[reader.choice(kind, ("vessels", name), valid)].body.boxes) for name, kind in named}


def _relative_to_deck(boxes: Sequence[Box]) -> Sequence[Box]:
    """Shapes moved so that the middle of the top of the first one, which is the deck, is the origin.

    The deck is what all vessels publish; where their centre of mass is depends on the payload of some.
    """
    a, b, c = boxes[0].position
    top = c + boxes[0].half_extents[2]
    return [box._replace(position=(box.position[0] - a, box.position[1] - b, box.position[2] - top)) for box in boxes]


def _read_platforms(reader: JsonReader, platforms: Any) -> Sequence[tuple[Sequence[float], Sequence[float]]]:
    """Edges and centre of each platform (m)."""
    found = []
    for name, spec in reader.read_named_objects(platforms, ("platforms",)).items():
        path = ("platforms", name)
        spec = reader.read_object(spec, path, ("size", "position"), ())
        vectors = [reader.vector(spec.get(key, [1.0] * 3), (*path, key), "xyz") for key in ("size", "position")]
        found.append((vectors[0], vectors[1]))
    return found
