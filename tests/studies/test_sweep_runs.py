"""`cosim sweep`: runs, tables and stored records."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest
from cosim_command import run_cosim
from fault_fmu import lag_output
from lag_project import SEGV_ORDER

#: 5 % of the runs end their process
RUNS, CRASHES = 40, {3: SEGV_ORDER, 23: "DoStep 6 abort"}
STARTS = [1 + run / 100 for run in range(RUNS)]


def level(run):
    return {"lag.y_start": STARTS[run], "lag.fault": CRASHES.get(run, "")}


@pytest.fixture(scope="module")
def crashing(make_lag):
    """Project after a sweep with two workers in which every twentieth run crashes."""
    lag = make_lag()
    levels = {f"run {run}": level(run) for run in range(RUNS)}
    sweep = lag.write(
        factors=[{"name": "level", "levels": levels}], success=[{"kpi": "end.value", "min": 1.0}]
    )
    lag.run_command("sweep", sweep, "--workers", 2, "--parquet")
    return lag


def test_only_the_crashing_runs_fail(crashing):
    failed = [int(row["run"]) for row in crashing.table() if row["status"] == "failed"]
    assert (crashing.last_result.code, failed) == (1, sorted(CRASHES)), crashing.last_result.err


def test_the_other_runs_have_their_results(crashing):
    ends = {
        int(row["run"]): float(row["end.value"])
        for row in crashing.table()
        if row["status"] == "ok"
    }
    assert ends == {run: lag_output(10, STARTS[run]) for run in range(RUNS) if run not in CRASHES}


def test_the_signal_is_named_in_the_table_and_on_the_terminal(crashing):
    cause = (
        "lag: fmi2DoStep failed at t = 0.05 s: the process was ended by signal 6 (SIGABRT, aborted)"
    )
    assert crashing.table()[23]["failure"] == cause
    assert f"1 failed, first run 23: {cause}" in crashing.last_result.err


def test_a_failure_is_listed_with_the_command_that_repeats_it(crashing):
    failure = crashing.table(file="failures.csv")[1]
    scenario = crashing.folder / "lag.json"
    assert (
        failure["command"]
        == f"cosim run {scenario} --set lag.y_start=1.23 --set 'lag.fault=DoStep 6 abort'"
    )


def test_failed_runs_count_as_unsuccessful(crashing):
    """The first run that ends above 1 has y_start = 1.22."""
    good = [run for run in range(RUNS) if run not in CRASHES and lag_output(10, STARTS[run]) >= 1.0]
    overall = crashing.table(file="success.csv")[0]
    assert (overall["runs"], overall["failed"], overall["passed"]) == ("40", "2", str(len(good)))


def test_parquet_holds_the_same_table(crashing):
    pq = pytest.importorskip("pyarrow.parquet")
    columns = pq.read_table(crashing.folder / "runs/sweep/table.parquet").to_pydict()
    table = crashing.table()
    assert columns["end.value"] == [
        float(row["end.value"]) if row["end.value"] else None for row in table
    ]
    assert columns["level"] == [row["level"] for row in table]
    assert columns["passed"] == [row["passed"] == "1" for row in table]


def test_the_files_do_not_depend_on_the_number_of_workers(crashing):
    crashing.run_command("sweep", "sweep.json", "--workers", 1, "--output-dir", "serial")
    for name in ("table.csv", "aggregates.csv", "success.csv"):
        assert (crashing.folder / "serial" / name).read_bytes() == (
            crashing.folder / "runs/sweep" / name
        ).read_bytes(), name


def test_only_new_points_run_in_a_second_call(lag):
    few = {"name": "T", "set": "lag.T", "values": [0.5, 1.0]}
    lag.run_command("sweep", lag.write(factors=[few]))
    before = lag.records()
    done = lag.run_command("sweep", lag.write(factors=[few | {"values": [0.25, 0.5, 1.0]}]))
    assert lag.records()[:2] == before
    assert len(lag.records()) == 3
    assert "3 of 3 runs, 1 made now" in done.out


def test_shared_runs_are_reported(lag):
    factors = [{"name": "y", "set": "lag.y_start", "range": {"min": 1, "max": 2}, "integer": True}]
    content = {
        "factors": factors,
        "design": {"kind": "sobol", "runs": 8},
        "success": [{"kpi": "end.value", "max": 1.5}],
    }
    done = lag.run_command("sweep", lag.write(**content))
    assert "2 of 8 runs are distinct; only these count in the intervals" in done.out
    assert "2 of the 8 runs are distinct" in (lag.folder / "runs/sweep/sweep.html").read_text()
    overall = lag.table(file="success.csv")[0]
    assert (overall["runs"], overall["distinct"], overall["rate"]) == ("8", "2", "0.5")


def test_units_of_kpis_are_shown_also_when_a_sweep_is_continued(lag):
    (lag.folder / "own.py").write_text(
        "from cosim import units\n\n\n@units(end='m/s')\ndef own(result):\n    return {'end': "
        "result['lag.y'][-1], 'count': 2}\n"
    )
    content = {
        "settings": {"/kpis": [{"name": "own", "python": "own.py:own"}]},
        "success": [{"kpi": "own.end", "min": 9.0}],
    }
    sweep = lag.write(factors=[{"name": "T", "set": "lag.T", "values": [0.5, 1.0]}], **content)
    for _ in range(2):
        lines = [line.split() for line in lag.run_command("sweep", sweep).out.splitlines()]
        assert ["KPI", "unit", "mean", "std", "min", "median", "max"] in lines
        assert [line[1] for line in lines if line[:1] == ["own.end"]] == ["m/s", "min"]
        assert [line[1] for line in lines if line[:1] == ["own.count"]] == ["2"]
        page = (lag.folder / "runs/sweep/sweep.html").read_text()
        assert '<td class="name">own.end</td><td class="soft" data-label="unit">m/s</td>' in page
        assert "<code>own.end</code> min 9.0 m/s" in page
        assert "m/s, expected at least 9.0 m/s" in page
        assert "m/s, expected at least 9.0 m/s" in lag.table(file="unsuccessful.csv")[0]["missed"]
        assert json.loads((lag.folder / "runs/sweep/sweep.json").read_text())["units"] == {
            "own.end": "m/s"
        }
    assert [sorted(record) for record in lag.records()] == [
        ["key", "kpis", "seconds", "units"],
        ["key", "kpis", "seconds"],
    ]


def test_a_second_sweep_of_the_same_name_warns_and_removes_the_replays_of_the_first(lag):
    """A replay shows the number of its run and the criteria, so another sweep cannot show it, even
    of an equal run.
    """
    factors = [{"name": name, "set": f"lag.{name}", "values": [1]} for name in ("T", "y_start")]
    first = lag.write(factors=factors, maps=[{"x": "T", "y": "y_start"}])
    assert lag.run_command("sweep", first, "--replays").err == ""
    assert len(list((lag.folder / "runs/sweep/replays").iterdir())) == 1
    other = lag.folder / "other.json"
    other.write_text(
        json.dumps(json.loads(first.read_text()) | {"success": [{"kpi": "end.value", "max": 0.0}]})
    )
    text = (
        f'replaces the results of {first} in runs/sweep; another "name" in the sweep or '
        "--output-dir keeps both\n"
    )
    assert [lag.run_command("sweep", other).err for _ in range(2)] == [text, ""]
    assert list((lag.folder / "runs/sweep/replays").iterdir()) == []


def test_a_run_without_a_kpi_of_the_criteria_is_unsuccessful(lag):
    """Runs that end above 1, as does the first one, have another KPI."""
    (lag.folder / "own.py").write_text(
        "def own(result):\n    y = result['lag.y'][-1]\n    return {'low' if y < 1 else 'high': "
        "y}\n"
    )
    content = {
        "settings": {"/kpis": [{"name": "own", "python": "own.py:own"}]},
        "success": [{"kpi": "own.low", "max": 1.0}],
    }
    done = lag.run_command(
        "sweep",
        lag.write(factors=[{"name": "y", "set": "lag.y_start", "values": [3, 1, 4]}], **content),
    )
    assert done.code == 0, done.err
    assert [(row["passed"], bool(row["own.low"])) for row in lag.table()] == [
        ("0", False),
        ("1", True),
        ("0", False),
    ]


def test_tables_and_maps_of_an_earlier_call_are_removed(lag):
    pytest.importorskip("pyarrow")
    factors = [{"name": name, "set": f"lag.{name}", "values": [1, 2]} for name in ("T", "y_start")]
    maps = [{"x": "T", "y": "y_start"}, {"x": "y_start", "y": "T"}]
    lag.run_command("sweep", lag.write(factors=factors, maps=maps), "--parquet")
    folder = lag.folder / "runs/sweep"
    (folder / "success_map_of_mine.png").write_bytes(b"")
    lag.run_command("sweep", lag.write(factors=factors, maps=maps[:1]))
    found = {path.name for path in folder.iterdir() if path.suffix in (".png", ".svg", ".parquet")}
    assert found == {"success_map.png", "success_map.svg", "success_map_of_mine.png"}


def test_damaged_records_are_counted_and_their_runs_repeated(lag):
    file = lag.write(factors=[{"name": "y", "set": "lag.y_start", "values": [1, 2, 3]}])
    lag.run_command("sweep", file)
    journal = lag.folder / "runs/sweep/journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(lines[0] + b"\0" * 10 + lines[1][10:] + lines[2])
    done = lag.run_command("sweep", file)
    assert "runs/sweep/journal.jsonl: 1 unreadable line; the missing runs are repeated" in done.err
    assert "3 of 3 runs, 1 made now" in done.out


@pytest.mark.long
def test_a_changed_scenario_is_run_again(lag):
    sweep = lag.write(factors=[{"name": "T", "set": "lag.T", "values": [0.5]}])
    lag.run_command("sweep", sweep)
    content = json.loads((lag.folder / "lag.json").read_text())
    (lag.folder / "lag.json").write_text(json.dumps(content | {"stop_time": 0.2}))
    lag.run_command("sweep", sweep)
    assert [float(row["end.value"]) for row in lag.table()] == [lag_output(20)]


@pytest.mark.long
def test_failed_runs_are_repeated_only_with_retry_failed(lag):
    sweep = lag.write(factors=[{"name": "fault", "set": "lag.fault", "values": ["", SEGV_ORDER]}])
    for words, made in (((), 2), ((), 2), (("--retry-failed",), 3)):
        assert lag.run_command("sweep", sweep, *words).code == 1
        assert len(lag.records()) == made


def test_only_a_run_that_exceeds_its_deadline_is_ended(lag):
    levels = {"good": {}, "slow": {"lag.fault": "DoStep 6 sleep"}, "well": {"lag.T": 1.0}}
    lag.run_command("sweep", lag.write(factors=[{"name": "level", "levels": levels}], deadline=1.0))
    assert [row["failure"] for row in lag.table()] == ["", "the run did not end within 1 s", ""]


def test_statistics_are_grouped_by_the_levels_of_each_factor(lag):
    """y ends at 0.8^10 y_start for T = 0.05: below 0.2 for a start of 1 only."""
    starts = {"name": "start", "set": "lag.y_start", "values": [1.0, 3.0]}
    times = {
        "name": "T",
        "set": "lag.T",
        "range": {"min": 0.05, "max": 0.5, "count": 2, "scale": "log"},
    }
    lag.run_command(
        "sweep", lag.write(factors=[starts, times], success=[{"kpi": "end.value", "max": 0.2}])
    )
    rates = {(row["start"], row["T"]): float(row["rate"]) for row in lag.table(file="success.csv")}
    assert rates == {
        ("", ""): 0.25,
        ("1.0", ""): 0.5,
        ("3.0", ""): 0.0,
        ("", "0.05"): 0.5,
        ("", "0.5"): 0.0,
    }
    means = {
        (row["start"], row["T"]): float(row["mean"]) for row in lag.table(file="aggregates.csv")
    }
    assert math.isclose(
        means["3.0", ""], (lag_output(10, 3.0, 0.05) + lag_output(10, 3.0, 0.5)) / 2
    )


def test_a_json_pointer_changes_the_scenario(lag):
    lag.run_command(
        "sweep", lag.write(factors=[{"name": "stop", "set": "/stop_time", "values": [0.1, 0.3]}])
    )
    assert [float(row["end.value"]) for row in lag.table()] == [lag_output(10), lag_output(30)]


_PREPARED = """
from cosim import Component


class Prepared(Component):
    variables, has_state, binds_everything, given = [], False, True, None

    @classmethod
    def warm(cls, **arguments):
        cls.given = arguments

    def __init__(self, instance_name, rate):
        if self.given != {"rate": 2}:
            raise ValueError(f"warm was called with {self.given}")

    def do_step(self, time, step_size):
        pass
"""


def test_a_component_class_prepares_all_runs_with_its_arguments(make_lag):
    lag = make_lag()
    (lag.folder / "prepared.py").write_text(_PREPARED)
    content = json.loads((lag.folder / "lag.json").read_text())
    content["components"]["prepared"] = {"python": "prepared.py:Prepared", "arguments": {"rate": 2}}
    (lag.folder / "lag.json").write_text(json.dumps(content))
    levels = {"prepared": {}, "changed": {"/components/prepared/arguments/rate": 3}}
    assert (
        lag.run_command("sweep", lag.write(factors=[{"name": "level", "levels": levels}])).code == 0
    ), lag.last_result
    assert [row["status"] for row in lag.table()] == ["ok", "ok"]


NOISE = """
import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real


class Noise(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.seed, self.seeded, self.unseeded = 0, 0.0, 0.0
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Integer("seed", **fixed))
        for name in ("seeded", "unseeded"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def enter_initialization_mode(self):
        self.random = np.random.default_rng(self.seed)

    def do_step(self, current_time, step_size):
        self.seeded, self.unseeded = self.random.normal(), np.random.normal()
        return True
"""


def test_noise_of_a_python_class_is_that_of_its_seed_or_differs_in_each_run(tmp_path):
    """The runs are forked from one process, whose random state they would share."""
    (tmp_path / "noise.py").write_text(NOISE)
    kpis = [
        {"name": name, "python": "cosim.kpis:final", "arguments": {"signal": f"noise.{name}"}}
        for name in ("seeded", "unseeded")
    ]
    scenario = {
        "name": "noise",
        "stop_time": 0.02,
        "step_size": 0.01,
        "components": {"noise": {"python": "noise.py:Noise"}},
    }
    scenario |= {"kpis": kpis, "seeds": ["/components/noise/parameters/seed"]}
    (tmp_path / "noise.json").write_text(json.dumps(scenario))
    (tmp_path / "s.json").write_text(
        json.dumps({"name": "s", "scenario": "noise.json", "seeds": {"first": 1, "count": 3}})
    )
    done = run_cosim("sweep", "s.json", "--workers", "1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    with (tmp_path / "runs/s/table.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len({row["unseeded.value"] for row in rows}) == 3
    expected = {str(seed): np.random.default_rng(seed).normal(size=2)[1] for seed in (1, 2, 3)}
    assert all(float(row["seeded.value"]) == expected[row["seed"]] for row in rows)
