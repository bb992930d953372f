"""Return values, numbers and log messages of FMUs that are not as they should be: what the command
line makes of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from fault_fmu import STEP_COUNT, function_name, lag_output, scenario

T5 = " failed at t = 0.05 s: "
T8 = " failed at t = 0.08 s: "


@dataclass(frozen=True)
class Case:
    """An order, words of the message ({f}: the C function), exit code, and the kept rows."""

    order: str
    words: str
    code: int = 1
    rows: int = 6
    versions: tuple[int, ...] = (2, 3)


CASES = [
    Case("- 1 error", "", 0, STEP_COUNT + 1),
    Case("DoStep 6 warning", "WARNING lag: told to return warning", 0, STEP_COUNT + 1),
    Case("DoStep 6 discard", "lag: {f}" + T5 + "status 2 (discard): told to return discard"),
    Case("DoStep 6 discard", "told to return discard; lastSuccessfulTime is 0.05 s", versions=(2,)),
    Case("DoStep 6 error", "lag: {f}" + T5 + "status 3 (error): told to return error"),
    Case("DoStep 6 fatal", "lag: {f}" + T5 + "status 4 (fatal): told to return fatal"),
    Case("DoStep 6 pending", "lag: {f}" + T5 + "status 5"),
    Case("DoStep 6 undefined", "lag: {f}" + T5 + "status 17 (not defined by FMI)"),
    Case("DoStep 6 hundred", "lag: {f}" + T5 + "status 100 (not defined by FMI)"),
    Case("DoStep 6 negative", "lag: {f}" + T5 + "status -1 (not defined by FMI)"),
    Case("GetReal 9 negative", "lag: {f}" + T5 + "status -1 (not defined by FMI)"),
    Case("EnterInitializationMode 1 negative", "lag: {f} failed at t = 0 s: status -1", rows=0),
    Case("DoStep @0.05 error", "lag: {f}" + T5 + "status 3 (error)"),
    Case("DoStep * discard", "lag: {f} failed at t = 0 s: status 2 (discard)", rows=1),
    Case("GetReal 9 error", "lag: {f}" + T5 + "status 3 (error)"),
    Case("DoStep 6 terminate", "", 0, 7),
    Case("DoStep 6 early", "lag: do_step" + T5 + "reached only t = 0.055", versions=(3,)),
    Case("DoStep 6 event", "", 0, STEP_COUNT + 1, versions=(3,)),
    Case("Instantiate 1 error", "lag: {f} failed: told to return error", rows=0),
    Case("EnterInitializationMode 1 error", "lag: {f} failed at t = 0 s: status 3 (error)", rows=0),
    Case("ExitInitializationMode 1 error", "lag: {f} failed at t = 0 s: status 3 (error)", rows=0),
    Case("Terminate 1 error", "WARNING lag: {f} failed: status 3 (error)", 0, STEP_COUNT + 1),
    Case("DoStep 6 log_directives", "WARNING lag: %s%s%n%d%f 100%", 0, STEP_COUNT + 1, (3,)),
    Case(
        "DoStep 6 log_directives", "%n", 0, STEP_COUNT + 1, (2,)
    ),  # FMI 2.0: formats, here without their arguments
    Case("DoStep 6 log_null", "WARNING lag:", 0, STEP_COUNT + 1),
    Case(
        "DoStep 6 log_bytes",
        "WARNING lag: bad \ufffd\ufffd\ufffd bytes \\x1b[31m red",
        0,
        STEP_COUNT + 1,
    ),
    Case("DoStep 6 log_long", "WARNING lag: yyyy", 0, STEP_COUNT + 1),
]
TABLE = []
for each in CASES:
    TABLE += [pytest.param(each, v, id=f"FMI{v} {each.order}") for v in each.versions]


@pytest.mark.parametrize(("case", "version"), TABLE)
def test_a_bad_return_stops_the_run_with_one_line_and_keeps_the_rows(
    fmus, runner, tmp_path, case, version
):
    done = runner.run(tmp_path, fmus(version, case.order))
    assert (done.code, len(done.rows)) == (case.code, case.rows), done.err
    assert [row["lag.y"] for row in done.rows] == [lag_output(n) for n in range(case.rows)]
    assert case.words.format(f=function_name(version, case.order.split()[0])) in done.err
    assert "Traceback" not in done.err
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


@pytest.mark.parametrize(
    ("order", "words"),
    [
        ("SetReal @0.075 error", T8 + "status 3 (error)"),
        ("DoStep @0.08 error", T8 + "status 3 (error)"),
        ("DoStep @0.08 negative", T8 + "status -1 (not defined by FMI)"),
        ("GetReal @0.085 error", T8 + "status 3 (error)"),
    ],
)
def test_every_fault_is_reported_in_packed_steps(fmus, runner, tmp_path, version, order, words):
    """The native executor runs these packed steps after the measured ones, so a fault at 0.08 s is
    met by packed steps.
    """
    components = {
        "lag": {"fmu": str(fmus(version, order))},
        "next": {"fmu": str(fmus(version, name="next"))},
    }
    ring = [{"from": "lag.y", "to": "next.u"}, {"from": "next.y", "to": "lag.u"}]
    stages = {"stages": [["lag", "next"]]}
    file = scenario(
        tmp_path, fmus.folder, components=components, connections=ring, algorithm=stages
    )
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report")
    assert (done.code, len(done.rows)) == (1, 9), done.err
    assert f"lag: {function_name(version, order.split()[0])}{words}" in done.err


@pytest.mark.parametrize("isolation", ["run", "fmu"])
@pytest.mark.parametrize("executor", ["python", "native"])
@pytest.mark.parametrize("what", ["event", "terminate"])
def test_outputs_are_read_after_a_step_with_a_flag_too(
    fmus, runner, tmp_path, what, executor, isolation
):
    """An event that nobody handles here; or the wish to end, said in the last step."""
    file = scenario(tmp_path, fmus(3, f"DoStep 6 {what}"))
    words = ("run", file, "--output-dir", "out", "--no-report", "--isolation", isolation)
    done = runner.cosim(tmp_path, *words, executor=executor)
    assert done.code == 0, done.err
    count = {"event": STEP_COUNT + 1, "terminate": 7}[what]
    assert [row["lag.y"] for row in done.rows] == [lag_output(n) for n in range(count)]


@pytest.mark.parametrize("what", ["hundred", "negative"])
def test_the_other_executor_takes_no_other_status_for_a_good_one(
    fmus, runner, tmp_path, version, what
):
    done = runner.run(tmp_path, fmus(version, f"DoStep 6 {what}"), executor="python")
    assert (done.code, len(done.rows)) == (1, 6), done.err
    assert "(not defined by FMI)" in done.err


def test_an_fmu_that_does_not_say_how_far_a_discarded_step_came(fmus, runner, tmp_path):
    fmu = fmus(2, "GetBooleanStatus 1 discard")
    words = (
        "run",
        scenario(tmp_path, fmu),
        "--output-dir",
        "out",
        "--no-report",
        "--set",
        "lag.fault=DoStep 6 discard",
    )
    done = runner.cosim(tmp_path, *words)
    assert (done.code, len(done.rows)) == (1, 6), done.err
    assert (
        "lag: fmi2DoStep" + T5 + "status 2 (discard): told to return discard; lastSuccessfulTime is"
        in done.err
    )


def test_an_fmu_that_terminates_may_say_nothing_of_the_time(fmus, runner, tmp_path):
    """Then nobody knows what its outputs would belong to: the step does not count."""
    fmu = fmus(2, "GetRealStatus 1 discard")
    words = (
        "run",
        scenario(tmp_path, fmu),
        "--output-dir",
        "out",
        "--no-report",
        "--set",
        "lag.fault=DoStep 6 terminate",
    )
    done = runner.cosim(tmp_path, *words)
    assert (done.code, len(done.rows)) == (0, 6), done.err


def test_a_deadline_may_be_longer_than_can_be_counted(fmus, runner, tmp_path, version):
    assert runner.run(tmp_path, fmus(version), deadlines={"step": 1e300}).code == 0


def test_the_rows_of_a_failed_run_are_those_of_a_good_one(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version, "DoStep 6 error"))
    assert [row["lag.y"] for row in done.rows] == [lag_output(n) for n in range(6)]
    assert [row["time"] for row in done.rows] == [n / 100 for n in range(6)]


def test_control_characters_of_an_fmu_do_not_reach_the_terminal(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version, "DoStep 6 log_bytes"))
    assert "\x1b" not in done.err
    assert "[31m red" in done.err


@pytest.mark.parametrize("what", ["nan", "infinity"])
def test_a_connected_output_that_is_not_finite_ends_the_run(fmus, runner, tmp_path, version, what):
    components = {
        "lag": {"fmu": str(fmus(version, f"DoStep 6 {what}"))},
        "next": {"fmu": str(fmus(version, name="next"))},
    }
    wiring = {"components": components, "connections": [{"from": "lag.y", "to": "next.u"}]}
    file = scenario(tmp_path, fmus.folder, **wiring)
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report")
    assert (done.code, len(done.rows)) == (1, 6)
    assert "lag" in done.err
    assert "0.05 s" in done.err


@pytest.mark.parametrize("what", ["error", "fatal"])
def test_one_fmu_alone_keeps_its_rows_too(fmus, runner, tmp_path, version, what):
    done = runner.simulate(tmp_path, fmus(version, f"DoStep 6 {what}"))
    assert (done.code, len(done.rows)) == (1, 6), done.err
    assert f"fmi{version}DoStep" + T5 in done.err
    assert (done.temporary_files, done.changes) == ([], [])


def test_a_scenario_tells_an_fmu_by_its_parameter_to_misbehave(fmus, runner, tmp_path, version):
    """One FMU file, one instance that fails: the other orders of this room lie in the file."""
    components = {name: {"fmu": str(fmus(version))} for name in ("lag", "other")}
    file = scenario(tmp_path, fmus.folder, components=components)
    done = runner.cosim(
        tmp_path,
        "run",
        file,
        "--output-dir",
        "out",
        "--no-report",
        "--set",
        "other.fault=DoStep 4 error",
    )
    assert (done.code, len(done.rows)) == (1, 4)
    assert f"other: fmi{version}DoStep failed at t = 0.03 s: status 3 (error)" in done.err


AS_OUTPUT = 'causality="output" variability="discrete" initial="calculated"'
SPEAKING = {
    2: (
        '<ScalarVariable name="s" valueReference="1" '
        f"{AS_OUTPUT}><String/></ScalarVariable></ModelVariables>"
    ),
    3: f'<String name="s" valueReference="7" {AS_OUTPUT}/></ModelVariables>',
}


def test_a_text_that_is_a_null_pointer_is_a_failure(fmus, runner, tmp_path, version):
    """It would crash the component that reads it."""
    done = runner.run(
        tmp_path,
        fmus(version, "DoStep 3 speechless", changes={"</ModelVariables>": SPEAKING[version]}),
    )
    assert done.code == 1, done.err
    assert (
        f'lag: fmi{version}GetString failed at t = 0.02 s: the value of "s" is a null pointer, '
        "expected a text"
    ) in done.err


def test_a_text_that_is_not_utf_8_is_read_as_far_as_it_can_be(fmus, runner, tmp_path, version):
    fmu = fmus(version, "DoStep 3 babble", changes={"</ModelVariables>": SPEAKING[version]})
    done = runner.cosim(
        tmp_path, "run", scenario(tmp_path, fmu), "--output-dir", "out", "--no-report"
    )
    assert done.code == 0, done.err
    assert "\N{REPLACEMENT CHARACTER}" * 2 in (tmp_path / "out/result.csv").read_text(
        encoding="utf-8"
    )


def test_rows_of_an_earlier_run_do_not_pass_for_those_of_a_failed_one(
    fmus, runner, tmp_path, version
):
    assert runner.run(tmp_path, fmus(version)).code == 0
    failed = runner.run(tmp_path, fmus(version, "EnterInitializationMode 1 error"))
    assert (failed.code, failed.rows) == (1, [])
