"""A fault at every single call of a run: whichever call it is, the rows are kept and nothing
forbidden is called.

A short sample of the calls always, all of them with `pytest -m long`.
"""

from __future__ import annotations

import re
from itertools import product

import pytest
from fault_fmu import STEP_COUNT, FaultFmus
from fmi_call_rules import calls, violations

RETURNS = ["warning", "discard", "error", "fatal", "nan"]
CRASHES = ["segv", "exit_0", "sleep"]
DEADLINES = {"load": 0.5, "initialization": 0.5, "step": 0.5, "end": 0.5}
#: numbers of calls, from 1 on; -1 is the last one
SAMPLE = {2: [1, 3, 11], 3: [15, -1]}
#: calls after which all rows exist
LAST = ("Terminate", "FreeInstance")
#: calls that return a text instead of a status: a null pointer is a warning
TEXT_CALLS = ("GetVersion", "GetTypesPlatform")


@pytest.fixture(scope="module")
def healthy(fault_libraries, runner, tmp_path_factory):
    """FMI version -> names of all calls of a run without fault."""
    names = {}
    for version in (2, 3):
        fmus = FaultFmus(fault_libraries, tmp_path_factory.mktemp("healthy"))
        assert runner.run(fmus.folder, fmus(version)).code == 0
        names[version] = [name for _, name in calls(fmus.lines())]
    return names


def expected_rows(names: list[str], n: int) -> int:
    """Row 0 exists after the first Get in step mode, row k after the Get that follows the k-th
    DoStep.
    """
    before = names[: n - 1]
    exits = [i for i, name in enumerate(before) if "ExitInit" in name]
    stepping = before[exits[0] :] if exits else []
    return sum(name.startswith("Get") for name in stepping)


def judge(
    fmus, runner, names: list[str], version: int, n: int, what: str, **conditions: str
) -> None:
    name = names[n - 1]
    deadlines = DEADLINES if what == "sleep" else None
    done = runner.run(
        fmus.folder, fmus(version, f"* {n} {what}"), deadlines=deadlines, limit=20, **conditions
    )
    where = f"{what} at call {n} ({name}): {done.err}"
    is_null_text = name in TEXT_CALLS and what in RETURNS
    codes = (0, 1) if name in LAST else (1,)
    if is_null_text or what in ("warning", "nan"):
        codes = (0,)
    assert done.code in codes, where
    assert len(done.rows) == (
        expected_rows(names, n) if done.code and name not in LAST else STEP_COUNT + 1
    ), where
    assert done.code == 0 or re.search(r"^(WARNING |ERROR )?lag: ", done.err, re.MULTILINE), where
    assert is_null_text or violations(fmus.lines()) == [], where
    assert [folder for folder in done.temporary_files if folder.startswith("cosim-")] == [], where
    assert (done.processes, done.changes) == ([], []), where


def test_a_healthy_run_is_long_enough(healthy):
    """Otherwise the sweep would pass over nothing."""
    for version in (2, 3):
        assert healthy[version].count("DoStep") == STEP_COUNT
        assert expected_rows(healthy[version], len(healthy[version])) == STEP_COUNT + 1


@pytest.mark.parametrize("what", RETURNS + CRASHES)
@pytest.mark.parametrize(("version", "n"), [*product([2], SAMPLE[2]), *product([3], SAMPLE[3])])
def test_a_fault_at_some_calls(fmus, runner, healthy, version, n, what):
    names = healthy[version]
    judge(fmus, runner, names, version, n if n > 0 else len(names) + 1 + n, what)


@pytest.mark.parametrize("what", [*RETURNS[1:], *CRASHES[:-1]])
def test_the_other_executor_does_the_same(fmus, runner, healthy, version, what):
    """In the sixth step, with the executor that is always there."""
    n = [i for i, name in enumerate(healthy[version], 1) if name == "DoStep"][5]
    judge(fmus, runner, healthy[version], version, n, what, executor="python")


@pytest.mark.long
@pytest.mark.parametrize("what", RETURNS + CRASHES)
def test_a_fault_at_every_call(fault_libraries, runner, healthy, tmp_path, version, what):
    for n in range(1, len(healthy[version]) + 1):
        (tmp_path / str(n)).mkdir()
        judge(
            FaultFmus(fault_libraries, tmp_path / str(n)),
            runner,
            healthy[version],
            version,
            n,
            what,
        )
