"""Every shipped scenario has a small reference that its run can be compared with."""

import json

import pytest

from cosim.core import resources
from cosim.results import Result
from cosim.results.comparison import match_tolerances
from cosim.scenario.extension import read_system_document

SHIPPED = sorted((resources.root() / "scenarios").glob("*.json"))
MAX_SIZE = 40_000  # bytes


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_it_has_a_small_reference_with_the_reason_of_its_tolerances(file):
    document = read_system_document(file).value
    specification = document["reference"]
    path = file.parent / specification["file"]
    reference = Result.from_csv(path)
    assert path.stem == file.stem
    assert path.stat().st_size < MAX_SIZE
    assert len(specification["reason"]) > 20
    assert set(match_tolerances(specification["tolerances"], list(reference))) == set(reference)
    assert json.loads(path.with_suffix(".json").read_text())["rows"] == len(reference.time)
