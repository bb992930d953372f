"""The importer calls an FMU in the order of the standard, and after a bad status nothing that is
forbidden.
"""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT, scenario
from fmi_call_rules import LIFE_CYCLE, calls, life_cycle, violations

PLACES = [
    "Instantiate 1",
    "EnterInitializationMode 1",
    "ExitInitializationMode 1",
    "GetReal 1",
    "GetReal 9",
    "DoStep 6",
]


def test_a_life_is_as_the_standard_draws_it(fmus, runner, tmp_path, version):
    assert runner.run(tmp_path, fmus(version)).code == 0
    assert LIFE_CYCLE[version].fullmatch(life_cycle(fmus.lines()))
    assert violations(fmus.lines()) == []


@pytest.mark.parametrize("status", ["error", "fatal"])
@pytest.mark.parametrize("place", PLACES)
def test_nothing_forbidden_follows_a_bad_status(fmus, runner, tmp_path, version, place, status):
    assert runner.run(tmp_path, fmus(version, f"{place} {status}")).code == 1
    assert violations(fmus.lines()) == []


@pytest.mark.parametrize(("status", "freed"), [("error", 1), ("fatal", 0)])
def test_a_failed_instance_is_freed_once_or_after_fatal_never(
    fmus, runner, tmp_path, version, status, freed
):
    runner.run(tmp_path, fmus(version, f"DoStep 6 {status}"))
    assert [function for _, function in calls(fmus.lines())].count("FreeInstance") == freed


def test_fatal_of_one_instance_is_the_end_of_all_instances_of_that_fmu(
    fmus, runner, tmp_path, version
):
    components = {name: {"fmu": str(fmus(version))} for name in ("lag", "twin")}
    file = scenario(tmp_path, fmus.folder, components=components)
    runner.cosim(
        tmp_path,
        "run",
        file,
        "--output-dir",
        "out",
        "--no-report",
        "--set",
        "lag.fault=DoStep 3 fatal",
    )
    assert violations(fmus.lines()) == []


def test_inputs_are_set_before_a_step_and_read_only_after_it(fmus, runner, tmp_path, version):
    wires = [{"from": "lag.y", "to": "twin.u"}, {"from": "twin.y", "to": "lag.u"}]
    components = {name: {"fmu": str(fmus(version))} for name in ("lag", "twin")}
    file = scenario(tmp_path, fmus.folder, components=components, connections=wires)
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report")
    assert done.code == 0, done.err
    assert violations(fmus.lines()) == []
    for name in ("lag", "twin"):
        own = [function for who, function in calls(fmus.lines()) if who == name]
        assert own.count("DoStep") == STEP_COUNT


def test_the_first_step_starts_at_the_start_time(fmus, runner, tmp_path, version):
    file = scenario(tmp_path, fmus(version), start_time=2.5, stop_time=2.6)
    assert runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report").code == 0
    steps = [line for line in fmus.lines() if "DoStep" in line]
    assert steps[0].split()[2] == "t=2.5"
    assert len(steps) == STEP_COUNT


def test_the_rules_find_what_is_forbidden():
    """The judge itself: one forbidden call each."""
    assert violations(["lag fmi2DoStep t=0 h=1", "lag status 4", "twin fmi2FreeInstance"])
    assert violations(["lag fmi2DoStep t=0 h=1", "lag status 3", "lag fmi2Terminate"])
    assert violations(["- fmi2Instantiate", "- status 3", "lag fmi2FreeInstance"])
    assert violations(
        ["lag fmi2ExitInitializationMode", "lag fmi2SetReal 0=1", "lag fmi2GetReal 1=1"]
    )
    assert violations(["lag fmi2DoStep t=0 h=1", "lag fmi2DoStep t=2 h=1"])
    assert violations(["lag fmi2DoStep t=0 h=1", "lag status 3", "lag fmi2FreeInstance"]) == []
