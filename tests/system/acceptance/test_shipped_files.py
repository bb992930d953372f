"""Everything that is shipped works and is what its description says."""

import json
from itertools import chain
from zipfile import ZipFile

import numpy as np
import pytest
from systems import make_system, run_system

import cosim
from cosim.components.fmi import FmuFile, create_component
from cosim.core import resources
from cosim.core.system import Endpoint
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

FMUS = sorted(resources.root().glob("fmus/**/*.fmu"))
SCENARIOS = sorted(resources.root().glob("scenarios/*.json"))
SYSTEMS = sorted(resources.root().glob("scenarios/systems/*.json"))


def label(path):
    return str(path.relative_to(resources.root()))


@pytest.mark.parametrize("path", FMUS, ids=label)
def test_fmpy_finds_no_problem(path):
    from fmpy import read_model_description

    read_model_description(str(path), validate_model_structure=True)


#: every twelfth FMU always, the others with `pytest -m long`: FMPy needs 10 ms for the syntax of a
#: name
CHECKED_NAMES = [
    pytest.param(path, marks=[] if i % 12 == 0 else [pytest.mark.long])
    for i, path in enumerate(FMUS)
]


@pytest.mark.parametrize("path", CHECKED_NAMES, ids=label)
def test_fmpy_accepts_the_names_of_variables(path):
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(path)) == []


@pytest.mark.parametrize("path", FMUS, ids=label)
def test_start_values_are_those_of_the_description(path):
    component = create_component(FmuFile(path), "fmu")
    seen = {}

    class Look:
        def __getattr__(self, name):
            return getattr(component, name)

        def exit_initialization_mode(self):
            seen.update(
                {
                    v.name: (component.get(v.name), v.start)
                    for v in component.variables
                    if v.start is not None
                }
            )
            component.exit_initialization_mode()

    run_system(make_system({"fmu": Look()}), 0.01, 0.01)
    assert {name: tuple(np.atleast_1d(found)) for name, (found, _) in seen.items()} == {
        name: tuple(np.atleast_1d(start)) for name, (_, start) in seen.items()
    }


@pytest.mark.parametrize("path", FMUS, ids=label)
def test_fmus_are_finite_and_repeat_themselves(path):
    first = outputs_over_a_second(path)
    assert np.isfinite(first).all()
    assert np.array_equal(first, outputs_over_a_second(path))


def outputs_over_a_second(path):
    file = FmuFile(path)
    outputs = [v for v in file.description.variables if v.causality == "output"]
    names = list(chain.from_iterable(v.scalar_names for v in outputs))
    columns = {name: Endpoint("fmu", name) for name in names}
    outcome = simulate(
        make_system({"fmu": create_component(file, "fmu")}),
        Settings(exact_fraction(0), exact_fraction(1), exact_fraction(0.01), columns),
    )
    assert outcome.failure is None
    return np.array([outcome.recording.columns[name].astype(float) for name in names])


@pytest.mark.parametrize("path", FMUS, ids=label)
def test_sources_are_inside(path):
    names = ZipFile(path).namelist()
    assert (
        any(name.startswith("sources/") and name.endswith(".c") for name in names)
        or f"resources/{path.stem}.py" in names
    )


def test_the_manifest_lists_exactly_the_fmus():
    manifest = json.loads((resources.root() / "fmus/manifest.json").read_text())
    listed = set(chain.from_iterable(entry["fmus"] for entry in manifest.values()))
    assert listed == {label(path) for path in FMUS}


@pytest.mark.parametrize("path", SCENARIOS, ids=label)
def test_scenarios_meet_their_checks_and_their_first_seconds_are_finite(path):
    """Later a measurement may be missing, as after a fault."""
    result = cosim.run(path)
    assert result.checks
    assert [(outcome.check, outcome.value) for outcome in result.checks if not outcome.passed] == []
    for name in result:
        if result[name].dtype.kind == "f":
            assert np.isfinite(result[name][result.time <= 2]).all(), name


def test_a_scenario_can_be_ended_earlier():
    assert cosim.run(SCENARIOS[0], stop_time=2).time[-1] == 2.0


@pytest.fixture(scope="module")
def validators():
    """Validators of the published schemas: of scenarios (False) and of nested systems (True)."""
    from jsonschema.validators import validator_for

    from cosim.scenario.extension_schema import editor_schema

    schemas = {nested: editor_schema(nested=nested) for nested in (False, True)}
    return {nested: validator_for(schema)(schema) for nested, schema in schemas.items()}


@pytest.mark.parametrize("path", [*SCENARIOS, *SYSTEMS], ids=label)
def test_scenarios_satisfy_the_published_schema(path, validators):
    validators[path.parent.name == "systems"].validate(json.loads(path.read_text()))
