"""Every key of a JSON file has what the reference shows: a description and a valid example."""

import pytest
from jsonschema import Draft202012Validator

from cosim.scenario import json_schema
from cosim.scenario.schema_types import schema_of
from cosim.studies.schema import SweepSpec, TuneSpec, WorstCaseSpec

SCHEMAS = {
    "scenario": json_schema(),
    "nested system": json_schema(nested=True),
    "sweep": schema_of(SweepSpec),
    "tuning": schema_of(TuneSpec),
    "search for the worst case": schema_of(WorstCaseSpec),
}


@pytest.mark.parametrize("schema", SCHEMAS.values(), ids=SCHEMAS)
def test_every_key_has_a_description_and_a_valid_example(schema):
    for part in (schema, *schema["$defs"].values()):
        for key, about in part["properties"].items():
            assert about["description"], key
            for example in about["examples"]:
                Draft202012Validator({"$defs": schema["$defs"], **about}).validate(example)
