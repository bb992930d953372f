"""Limits of the number of runs: a study is counted before anything is made."""

import tracemalloc

import pytest

from cosim.core.errors import InputError
from cosim.studies.schema import SweepSpec
from cosim.studies.study import read_study
from cosim.studies.sweep import Sweep
from cosim.studies.tune import Tuning

BILLION = 10**9
RANGE = {"name": "y", "set": "lag.y_start", "range": {"min": 1.0, "max": 2.0}}
NORMAL = {
    "name": "n",
    "set": "lag.y_start",
    "distribution": {"kind": "normal", "mean": 1.0, "std": 1.0, "count": BILLION},
}
SEEDS = {"set": "lag.T", "count": BILLION}
VALUES = {"name": "v", "set": "lag.T", "values": [0.5, 1.0]}
PARAMETER = {"name": "T", "set": "lag.T", "min": 0.02, "max": 2.0}
BILLION_RANGE = RANGE | {"range": RANGE["range"] | {"count": BILLION}}
LISTED = [{"name": f"f{i}", "set": f"lag.p{i}", "values": list(range(100))} for i in range(4)]

MAP = {"x": "f0", "y": "f1", "rows": "f2"}
CASES = [{}, {"lag.y_start": 2.0}, {"lag.y_start": 3.0}]
LONG_SEARCH = {"kind": "powell", "evaluations": 100_001}


def refusal(lag, command, **content):
    """Return the only line with which a command refuses a study, and the memory that this took
    (bytes).
    """
    file = lag.write(command, **content)
    tracemalloc.start()
    found = lag.run_command(command, file)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.code == 2
    assert peak < 20e6
    (line,) = found.err.splitlines()
    return line.removeprefix(f"{file}:")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"factors": [BILLION_RANGE]}, "$.factors[0]: found 1 000 000 000 runs"),
        ({"factors": [VALUES, NORMAL]}, "$.factors[1]: found 2 000 000 000 runs"),
        (
            {"factors": [VALUES], "seeds": SEEDS | {"set": "lag.seed"}},
            "$.seeds.count: found 2 000 000 000 runs",
        ),
        ({"seeds": SEEDS}, "$.seeds.count: found 1 000 000 000 runs"),
        (
            {"factors": [RANGE], "design": {"kind": "latin_hypercube", "runs": BILLION}},
            "$.design.runs: found 1 000 000 000 runs",
        ),
        (
            {"factors": [RANGE], "design": {"kind": "sobol", "runs": 2**40}},
            "$.design.runs: found 1 099 511 627 776 runs",
        ),
        ({"factors": LISTED}, "$.factors[0]: found 100 000 000 runs"),
        (
            {"factors": LISTED, "design": {"kind": "sobol", "runs": 2}, "maps": [MAP]},
            "$.maps[0]: found 1 000 000 cells of the map",
        ),
    ],
    ids=[
        "range",
        "distribution",
        "seeds",
        "seeds alone",
        "latin hypercube",
        "sobol",
        "combinations",
        "map",
    ],
)
def test_a_sweep_of_too_many_runs_is_refused_at_once(lag, content, words):
    line = refusal(lag, "sweep", **content)
    assert f"{words}, expected at most 100 000; --max-runs raises this limit" in line


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {"method": {"kind": "differential_evolution", "population": BILLION}},
            "population: found 21 000 000 000 runs",
        ),
        (
            {"method": {"kind": "differential_evolution", "generations": BILLION}},
            "generations: found 16 000 000 016 runs",
        ),
        (
            {"method": {"kind": "nelder_mead", "evaluations": BILLION}},
            "evaluations: found 1 000 000 000 runs",
        ),
        (
            {"method": {"kind": "powell", "evaluations": 50_000}, "cases": CASES},
            "found 150 000 runs",
        ),
    ],
    ids=["population", "generations", "evaluations", "cases"],
)
def test_a_tuning_of_too_many_runs_is_refused_at_once(lag, content, words):
    line = refusal(lag, "tune", parameters=[PARAMETER], minimize="end.value", **content)
    assert "$.method." in line
    assert words in line


def test_the_limit_can_be_changed_in_both_directions(lag):
    factors = [RANGE | {"range": RANGE["range"] | {"count": 3}}, VALUES]
    sweep = lag.write(factors=factors)
    assert (
        "found 6 runs, expected at most 5" in lag.run_command("sweep", sweep, "--max-runs", 5).err
    )
    assert lag.run_command("sweep", sweep, "--max-runs", 6, "--workers", 1).code == 0
    tuning = lag.write(
        "tune",
        parameters=[PARAMETER],
        minimize="end.value",
        method={"kind": "nelder_mead", "evaluations": 8},
    )
    assert (
        "found 8 runs, expected at most 7" in lag.run_command("tune", tuning, "--max-runs", 7).err
    )
    assert lag.run_command("tune", tuning, "--max-runs", 8, "--workers", 1).code == 0


def test_the_python_functions_have_the_same_limit(lag):
    many = RANGE | {"range": RANGE["range"] | {"count": 100_001}}
    sweep, tuning = (
        lag.write(factors=[many]),
        lag.write("tune", parameters=[PARAMETER], minimize="1", method=LONG_SEARCH),
    )
    for read in (Sweep.from_file, lambda file: read_study(file, SweepSpec)):
        with pytest.raises(InputError, match="found 100 001 runs"):
            read(sweep)
    with pytest.raises(InputError, match="found 100 001 runs"):
        Tuning.from_file(tuning)
    assert len(Sweep.from_file(sweep, max_runs=100_001)) == 100_001
    assert Tuning.from_file(tuning, max_runs=100_001).spec.max_runs == 100_001


def test_a_count_that_a_sampled_design_does_not_use_makes_nothing(lag):
    sweep = lag.write(
        factors=[BILLION_RANGE, NORMAL | {"set": "lag.T"}],
        design={"kind": "latin_hypercube", "runs": 2},
    )
    assert len(Sweep.from_file(sweep)) == 2
