"""JSON Schema of vehicle files: it accepts and requires what the readers do."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterable
from typing import Any

import jsonschema
import pytest

from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.catalogue import FAMILIES, model_from_data
from plant_src.schemas.vehicle import vehicle_schema

FILES = sorted((resources.root() / "plant_src/vehicles/data").glob("*.json"))
VALIDATOR = jsonschema.Draft202012Validator(vehicle_schema())
DATA = [json.loads(file.read_text()) for file in FILES]
EXAMPLES = {data["family"]: data for data in DATA}


def paths(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all keys of objects."""
    items: Iterable[tuple[Any, Any]] = ()
    if isinstance(data, dict):
        items = data.items()
    elif isinstance(data, list):
        items = enumerate(data)
    below = [(*path, key) for key, _ in items] if isinstance(data, dict) else []
    return below + [found for key, value in items for found in paths(value, (*path, key))]


def is_accepted(data: Any) -> bool:
    try:
        model_from_data(data, "vehicle")
    except InputError:
        return False
    return True


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_shipped_vehicles_satisfy_the_schema(file: Any) -> None:
    VALIDATOR.validate(json.loads(file.read_text()))


@pytest.mark.parametrize("family", FAMILIES)
def test_schema_and_reader_require_the_same_keys(family: str) -> None:
    """Without any one of the keys of a file, both accept it or both refuse it."""
    for path in paths(EXAMPLES[family]):
        changed = copy.deepcopy(EXAMPLES[family])
        parent = changed
        for key in path[:-1]:
            parent = parent[key]
        del parent[path[-1]]
        # coefficients may be in "rotor" or in each of the rotors, which the schema does not know;
        # likewise all of "propeller"
        if path[-1] not in ("thrust_coefficient", "torque_coefficient") and path not in (
            ("propeller",),
            ("propeller", "max_speed"),
        ):
            assert VALIDATOR.is_valid(changed) == is_accepted(changed), path


@pytest.mark.parametrize("family", FAMILIES)
def test_unknown_keys_are_refused_by_both(family: str) -> None:
    for place in ((), ("boxes", 0), ("mass",)):
        changed = copy.deepcopy(EXAMPLES[family])
        parent: Any = changed
        for key in place:
            parent = parent[key]
        parent["masss"] = 1
        assert not VALIDATOR.is_valid(changed)
        assert not is_accepted(changed)


def test_a_part_with_a_link_of_a_urdf_file_needs_no_place() -> None:
    changed = copy.deepcopy(EXAMPLES["multirotor"])
    turns = changed["rotors"][0]["turns"]
    changed["rotors"][0] = {"link": "front_left", "turns": turns}
    assert VALIDATOR.is_valid(changed)
    changed["rotors"][0] = {"turns": turns}
    assert not VALIDATOR.is_valid(changed)


def test_a_missing_object_is_one_problem() -> None:
    changed = {key: value for key, value in EXAMPLES["surface_vessel"].items() if key != "hull"}
    with pytest.raises(InputError) as refusal:
        model_from_data(changed, "vehicle")
    assert [problem.message for problem in refusal.value.problems] == ['"hull" is missing']
