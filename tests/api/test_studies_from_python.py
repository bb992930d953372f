"""`cosim.compare`, `cosim.sweep`, `cosim.tune` and `cosim.regress` from Python."""

import json
from pathlib import Path

import pytest
from python_blocks import scenario

import cosim
from cosim.core import resources

SCENARIOS = resources.root() / "scenarios"
SWEEP = {
    "name": "speeds",
    "scenario": "free_flight",
    "settings": {"/stop_time": 0.5},
    "factors": [
        {
            "name": "speed",
            "set": "/components/vessel_control/parameters/speed_command",
            "values": [0.5, 1.0],
        }
    ],
}
BLOCKS = Path(__file__).parents[1] / "support/python_blocks.py"
END = {"name": "end", "python": "cosim.kpis:final", "arguments": {"signal": "g.y"}}


@pytest.fixture(scope="module")
def short():
    return cosim.run("free_flight", stop_time=0.5)


def test_a_result_is_compared_with_a_result_a_file_and_a_folder(short, tmp_path):
    short.to_csv(tmp_path / "result.csv")
    for reference in (short, tmp_path / "result.csv", tmp_path):
        assert cosim.compare(short, reference).passed
    other = cosim.run("free_flight", stop_time=0.4)
    assert not cosim.compare(other, short, absolute=1.0, signals="vessel.*").passed


def test_a_result_is_compared_with_the_reference_of_a_scenario(short):
    comparison = cosim.compare(short, "free_flight")
    assert not comparison.passed  # it ends earlier than the reference
    with pytest.raises(cosim.InputError, match="reference: expected a result or a path"):
        cosim.compare(short, 3)


def test_a_scenario_is_regressed(tmp_path):
    document = json.loads(
        (SCENARIOS / "free_flight.json").read_text().replace('"../', f'"{SCENARIOS.parent}/')
    )
    short = {
        **document,
        "stop_time": 0.5,
        "reference": {"file": "short.csv", "tolerances": {"*": {"absolute": 1e-9}}},
        "checks": [],
    }
    (tmp_path / "regressed.json").write_text(json.dumps({**short, "name": "short"}))
    for update in (True, False):
        (outcome,) = cosim.regress(
            tmp_path / "regressed.json", update=update, output_dir=tmp_path / "runs"
        )
        assert (outcome.code, outcome.name) == (0, "regressed"), outcome.details


def test_a_sweep_and_a_tuning_run(tmp_path):
    """The second call finds all runs in the folder."""
    base = {**scenario(f"{BLOCKS}:Gain"), "kpis": [END], "stop_time": 0.2}
    (tmp_path / "base.json").write_text(json.dumps(base))
    common = {"name": "gains", "scenario": str(tmp_path / "base.json"), "settings": {"g.u": 1.0}}
    success = [{"kpi": "end.value", "max": 5}]
    swept = {
        **common,
        "factors": [{"name": "k", "set": "g.k", "values": [1.0, 3.0]}],
        "success": success,
    }
    for _ in range(2):
        found = cosim.sweep(swept, output_dir=tmp_path / "sweep", workers=1)
        assert found.success_rate == 0.5
        assert [row.record.kpis["end.value"] for row in found.rows] == [2, 6]
    parameters = [{"name": "k", "set": "g.k", "min": 0.5, "max": 4}]
    tuned = {
        **common,
        "parameters": parameters,
        "minimize": "abs(end.value - 4)",
        "method": {"kind": "powell", "evaluations": 15},
    }
    assert cosim.tune(tuned, output_dir=tmp_path / "tune", workers=1).best.parameters[
        "k"
    ] == pytest.approx(2, rel=0.01)


@pytest.mark.parametrize("function", [cosim.sweep, cosim.tune, cosim.worst_case])
def test_a_study_of_a_wrong_type_is_refused(function):
    with pytest.raises(cosim.InputError, match="study: expected the path of a study file"):
        function(3)
    with pytest.raises(cosim.InputError, match="workers: expected a positive number; found 0"):
        function("demo1_landing", workers=0)


def test_seeds_of_a_sweep_default_to_those_of_the_scenario(tmp_path):
    text = json.dumps(
        {**scenario(str(tmp_path / "gain.py") + ":Gain"), "seeds": ["/components/g/arguments"]}
    )
    (tmp_path / "base.json").write_text(text)
    (tmp_path / "gain.py").write_text("from python_blocks import Gain\n")
    sweep = {"name": "seeds", "scenario": str(tmp_path / "base.json"), "seeds": {"count": 2}}
    from cosim.studies.sweep import Sweep

    assert Sweep.from_file(sweep).study_file.spec.seeds.set == ["/components/g/arguments"]
    without = {**sweep, "scenario": "free_flight"}
    with pytest.raises(
        cosim.InputError, match='the key "set" is missing, and the scenario has no "seeds"'
    ):
        Sweep.from_file(without)
