"""Random changes to good scenarios: they are loaded or refused with a place for each problem, soon,
and nothing else happens.
"""

from __future__ import annotations

import gc
import json
import re
import shutil
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from complete_scenario import INNER_SYSTEM, SCENARIO, write_scenario_files
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from scenario_mutations import mutants

import cosim
from cosim.core import resources
from cosim.scenario import load
from cosim.scenario.json_document import read_document

#: what a problem may begin with: file, line and column, or what was set from outside
PLACE = re.compile(r"^(\S.*\.\w+:\d+:\d+: |\S.*: |setting |cannot read )")

SHIPPED = sorted(path.stem for path in (resources.root() / "scenarios").glob("*.json"))


def counted(examples: int, part: int = 0) -> Callable[[Any], Any]:
    """Always the same examples, others in each part."""
    off = [
        HealthCheck.function_scoped_fixture,
        HealthCheck.too_slow,
        HealthCheck.data_too_large,
        HealthCheck.large_base_example,
    ]
    phases = [Phase.generate, Phase.shrink]
    many = settings(
        max_examples=examples,
        database=None,
        deadline=None,
        suppress_health_check=off,
        phases=phases,
    )
    return lambda test: seed(part)(many(test))


def in_parts(short: int, long: int) -> pytest.MarkDecorator:
    """A short run, and a long one in parts that may run at the same time."""
    parts = [
        pytest.param(counted(long // 4, part), marks=pytest.mark.fuzz, id=f"{long // 4} {part}")
        for part in range(1, 5)
    ]
    return pytest.mark.parametrize("count", [pytest.param(counted(short), id=str(short)), *parts])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, probes: dict[int, Path]) -> Path:
    folder = write_scenario_files(tmp_path_factory.mktemp("mutants"), probes[3])
    assert write(
        folder, SCENARIO, INNER_SYSTEM, limit=60
    )  # what is imported once is no time of a mutant
    import_module("matplotlib.figure")
    return folder


def judge(file: Path, text: str, limit: float = 2.0) -> bool:
    """Return True if a scenario is accepted within `limit` s of processor time."""
    file.write_text(text, encoding="utf-8")
    gc.disable()  # it would go through all that Hypothesis keeps, seconds long
    begin = time.process_time()
    try:
        load(file).free()
        accepted = True
    except cosim.InputError as error:
        accepted = False
        assert error.problems  # noqa: PT017  either outcome is right
        for problem in error.problems:
            assert problem.where or PLACE.match(str(problem)), problem
            assert "\n" not in str(problem), problem
            str(problem).encode()
    assert time.process_time() - begin < limit
    gc.enable()
    return accepted


def write(folder: Path, scenario: Any, inner: Any, limit: float = 2.0) -> bool:
    (folder / "inner.json").write_text(json.dumps(inner), encoding="utf-8")
    return judge(folder / "scenario.json", json.dumps(scenario, indent=1), limit)


def test_the_scenario_is_good_before_it_is_changed(folder):
    assert write(folder, SCENARIO, INNER_SYSTEM)


@in_parts(100, 100_000)
def test_mutated_scenarios(folder, count):
    results = set()

    @count
    @given(mutants(SCENARIO))
    def change(scenario):
        results.add(write(folder, scenario, INNER_SYSTEM))

    change()
    assert results == {True, False}


@in_parts(50, 20_000)
def test_mutated_nested_systems(folder, count):
    results = set()

    @count
    @given(mutants(INNER_SYSTEM))
    def change(inner):
        results.add(write(folder, SCENARIO, inner))

    change()
    assert results == {True, False}


@in_parts(60, 20_000)
def test_mutated_texts(folder, count):
    """Characters changed, so that most of them are no JSON any more."""
    text = json.dumps(SCENARIO)
    telling = (
        "NaN",
        "-",
        "1e999",
        "9" * 5000,
        "\ufeff",
        "é",
        "//",
        "null",
        "[" * 500,
        '{"a":' * 500,
    )
    words = st.sampled_from([*'{}[]",:\\ \n\0', *telling])

    @count
    @given(st.integers(0, len(text)), st.sampled_from([0, 0, 1, 2, 30, 3000]), words)
    def change(place, length, word):
        judge(folder / "scenario.json", text[:place] + word + text[place + length :])

    change()


@in_parts(8, 5_000)
def test_mutated_shipped_scenarios(tmp_path_factory, count):
    """All that is shipped stands beside the mutant, so that its paths are right."""
    root = tmp_path_factory.mktemp("shipped")
    for name in ("fmus", "plant_src", "controllers"):
        (root / name).symlink_to(resources.root() / name)
    shutil.copytree(resources.root() / "scenarios", root / "scenarios")
    documents = {name: read_document(root / "scenarios" / f"{name}.json").value for name in SHIPPED}

    @count
    @given(st.sampled_from(SHIPPED).flatmap(lambda name: mutants(documents[name])))
    def change(scenario):
        judge(root / "scenarios" / "mutant.json", json.dumps(scenario))

    change()
