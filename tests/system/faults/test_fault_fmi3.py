"""Faults that exist in FMI 3.0 only: early return, events, a different time at the end of a step,
arrays, tokens.
"""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT, scenario
from test_fault_statuses import T5

ALL = STEP_COUNT + 1
STEP = "lag: fmi3DoStep" + T5
READ = (
    "fmi3GetFloat64 failed at t = 0 s: status 3 (error): the number of values is not that of these "
    "variables"
)
ARRAY = '<Dimension start="3"/>'

#: order and changes of the description -> words of the message, exit code, rows that are kept
CASES = {
    "early return that was not allowed": (
        "DoStep 6 early",
        {},
        "lag: do_step" + T5 + "reached only t = 0.055",
        1,
        6,
    ),
    "no progress": ("DoStep 6 stuck", {}, "lag: do_step" + T5 + "reached only t = 0.05 s", 1, 6),
    "no progress from the start": (
        "DoStep 1 stuck",
        {},
        "lag: do_step failed at t = 0 s: reached only t = 0.0 s",
        1,
        1,
    ),
    "no progress for ever": (
        "DoStep * stuck",
        {},
        "lag: do_step failed at t = 0 s: reached only t = 0.0 s",
        1,
        1,
    ),
    "back in time": ("DoStep 6 back", {}, STEP + "lastSuccessfulTime is 0.02", 1, 6),
    "a time that is none": ("DoStep 6 nowhere", {}, STEP + "lastSuccessfulTime is nan s", 1, 6),
    "terminateSimulation": ("DoStep 6 terminate", {}, "", 0, 7),
    "an event without event mode": ("DoStep 6 event", {}, "", 0, ALL),
    "a status of FMI 2.0": ("DoStep 6 pending", {}, STEP + "status 5", 1, 6),
    "no step mode": (
        "ExitInitializationMode 1 error",
        {},
        "lag: fmi3ExitInitializationMode failed at t = 0 s",
        1,
        0,
    ),
    "array shorter in the binary": ("", {ARRAY: '<Dimension start="4"/>'}, READ, 1, 0),
    "array longer in the binary": ("", {ARRAY: '<Dimension start="2"/>'}, READ, 1, 0),
    "array of two dimensions": ("", {ARRAY: ARRAY + ARRAY}, READ, 1, 0),
    "array of no elements": (
        "",
        {ARRAY: '<Dimension start="0"/>'},
        "[variable.dimension, FMI 3.0.2 section 2.4.7.2]",
        2,
        0,
    ),
    "array of unknown size": (
        "",
        {ARRAY: '<Dimension valueReference="9"/>'},
        "[variable.dimension, FMI 3.0.2",
        2,
        0,
    ),
    "another token": (
        "Instantiate 1 error",
        {'"fault" desc': '"other" desc'},
        "lag: fmi3InstantiateCoSimulation failed",
        1,
        0,
    ),
    "version of the future": (
        "",
        {'fmiVersion="3.0"': 'fmiVersion="4.0"'},
        "[model.version, FMI",
        2,
        0,
    ),
    "version before it was one": (
        "",
        {'fmiVersion="3.0"': 'fmiVersion="3.0-beta.1"'},
        "[model.version, FMI",
        2,
        0,
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_named_and_the_rows_are_kept(fmus, runner, tmp_path, case):
    order, changes, words, code, rows = CASES[case]
    done = runner.run(tmp_path, fmus(3, order, changes=changes), limit=20)
    assert (done.code, len(done.rows)) == (code, rows), done.err
    assert words in done.err
    assert "Traceback" not in done.err
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


def test_the_array_is_read_when_all_is_well(fmus, runner, tmp_path):
    """Or the cases above would prove nothing."""
    rows = runner.run(tmp_path, fmus(3)).rows
    assert len(rows) == ALL
    for i in (1, 2, 3):
        assert [row[f"lag.v[{i}]"] for row in rows] == [i * row["lag.y"] for row in rows]


@pytest.mark.parametrize("isolation", ["run", "fmu"])
def test_one_element_that_is_no_number_is_named(fmus, runner, tmp_path, isolation):
    components = {
        "lag": {"fmu": str(fmus(3, "DoStep 6 spoil"))},
        "next": {"fmu": str(fmus(3, name="next"))},
    }
    wires = [{"from": "lag.v[2]", "to": "next.u"}]
    file = scenario(tmp_path, fmus.folder, components=components, connections=wires)
    done = runner.cosim(
        tmp_path, "run", file, "--output-dir", "out", "--no-report", "--isolation", isolation
    )
    assert (done.code, len(done.rows)) == (1, 6)
    assert "v[2]" in done.err
    assert "0.05 s" in done.err


BINARY = (
    '<Binary name="b" valueReference="7" causality="output" initial="calculated"/></ModelVariables>'
)


def test_a_binary_larger_than_all_memory_is_named(fmus, runner, tmp_path):
    done = runner.run(tmp_path, fmus(3, "DoStep 3 vast", changes={"</ModelVariables>": BINARY}))
    assert done.code == 1, done.err
    assert (
        "lag: fmi3GetBinary failed at t = 0.02 s: found a binary of 18446744073709551615 bytes"
        in done.err
    )
