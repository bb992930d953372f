"""Invalid sweeps and tunings: all problems are reported at once, with position and nearest name."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from cosim_command import run_cosim

from cosim.cli import cli
from cosim.core import resources
from cosim.core.errors import InputError
from cosim.studies.schema import SweepSpec, TuneSpec
from cosim.studies.study import read_study
from cosim.studies.tune import Tuning

FACTOR = {"name": "f", "set": "a.b", "values": [1]}
PARAMETER = {"name": "p", "set": "a.b", "min": 0.0, "max": 1.0}


def problems(folder, kind, content):
    """Return the problems of a study file with a shipped scenario."""
    file = folder / "study.json"
    file.write_text(json.dumps({"name": "s", "scenario": "demo1_box", **content}))
    with pytest.raises(InputError) as refusal:
        Tuning.from_file(file) if kind is TuneSpec else read_study(file, kind)
    return [str(problem).removeprefix(str(file)) for problem in refusal.value.problems]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {"factors": [FACTOR], "scenario": "demo1_bax"},
            ["$.scenario", 'did you mean "demo1_box"?'],
        ),
        ({"factors": [FACTOR], "desing": {}}, ["$.desing", 'did you mean "design"?']),
        ({}, ['expected "factors", "seeds" or both']),
        ({"factors": [FACTOR, FACTOR]}, ["$.factors[1].name: ", 'two factors are called "f"']),
        (
            {"factors": [FACTOR, FACTOR | {"name": "g"}]},
            ["$.factors[1]: ", 'both "f" and "g" set "a.b"'],
        ),
        ({"factors": [FACTOR | {"set": []}]}, ["$.factors[0].set", "at least 1 item"]),
        (
            {"factors": [FACTOR], "by": ["g"]},
            ["$.by[0]: ", '"by" names no factor "g"', "valid: f, seed"],
        ),
        (
            {"factors": [FACTOR | {"range": {"min": 0.0, "max": 1.0}}]},
            ["$.factors[0]", "found values and range"],
        ),
        ({"factors": [{"name": "f", "set": "a.b"}]}, ["$.factors[0]", "found none"]),
        ({"factors": [{"name": "f", "values": [1]}]}, ["$.factors[0]", 'expected "set"']),
        (
            {"factors": [FACTOR | {"name": "status"}]},
            ["$.factors[0].name", "expected a name other than"],
        ),
        (
            {"factors": [FACTOR | {"name": "q05"}]},
            ["$.factors[0].name", "expected a name other than"],
        ),
        (
            {"factors": [FACTOR | {"name": "rate"}]},
            ["$.factors[0].name", "expected a name other than"],
        ),
        (
            {"factors": [{"name": "f", "set": "a", "range": {"min": 1.0, "max": 1.0}}]},
            ["$.factors[0].range", "less than"],
        ),
        (
            {"factors": [{"name": "f", "set": "a", "range": {"min": 0.0, "max": 1.0}}]},
            ["$.factors[0].range: ", 'the factor "f" needs a "count"'],
        ),
        (
            {
                "factors": [
                    {
                        "name": "f",
                        "set": "a",
                        "range": {"min": 0.0, "max": 1.0, "scale": "log", "count": 2},
                    }
                ]
            },
            ["a logarithmic scale needs a positive"],
        ),
        (
            {
                "factors": [
                    {"name": "f", "set": "a", "distribution": {"kind": "normal", "mean": 0.0}}
                ]
            },
            ['"normal" needs std'],
        ),
        (
            {
                "factors": [
                    {
                        "name": "f",
                        "set": "a",
                        "distribution": {"kind": "normal", "mean": 0.0, "sigma": 1.0},
                    }
                ]
            },
            ['"normal" has no "sigma"', "valid: mean, std"],
        ),
        (
            {"factors": [FACTOR], "design": {"kind": "sobol", "runs": 100}},
            ["$.design", '"runs": 128'],
        ),
        (
            {"factors": [FACTOR], "design": {"kind": "latin_hypercube"}},
            ["$.design", 'expected "runs"'],
        ),
        (
            {"factors": [FACTOR], "seeds": {"set": "/seed", "count": 0}},
            ["$.seeds.count", "found 0"],
        ),
        ({"factors": [FACTOR], "deadline": -1}, ["$.deadline", "found -1"]),
    ],
)
def test_an_invalid_sweep_is_refused_with_the_position(tmp_path, content, words):
    (line,) = problems(tmp_path, SweepSpec, content)
    assert all(word in line for word in words), line
    assert 'found {"name": "s"' not in line


B = "/components/a/parameters/b"


@pytest.mark.parametrize(
    ("factors", "common", "words"),
    [
        (
            {"f": "a.b", "g": B},
            {},
            'both "f" and "g" set the same value, as "a.b" and as "/components/a/parameters/b"',
        ),
        ({"f": "stop_time", "g": "/stop_time"}, {}, 'both "f" and "g" set the same value'),
        ({"f": B}, {"a.b": 7}, 'both the settings and "f" set the same value'),
        (
            {"f": "a.b", "g": {"/components/a": {"parameters": {"b": 1}}}},
            {},
            'both "f" and "g" set the same value',
        ),
        (
            {"f": B, "g": "/components/a"},
            {},
            '"/components/a" of "g" replaces "/components/a/parameters/b" of "f"',
        ),
        (
            {"f": "/components/a"},
            {B: 7},
            '"/components/a" of "f" replaces "/components/a/parameters/b" of the settings',
        ),
    ],
)
def test_settings_without_effect_are_refused(tmp_path, factors, common, words):
    (line,) = problems(tmp_path, SweepSpec, {"factors": varied(factors), "settings": common})
    assert words in line


@pytest.mark.parametrize(
    ("factors", "common"),
    [
        ({"f": "a.b"}, {"a.b": 7}),
        ({"f": "a.b"}, {B: 7}),
        ({"f": {"/record": {"interval": 1}}}, {"/record": {"signals": ["*"]}}),
        ({"f": {"/components/a": {"parameters": {"b": 1, "c": 2}}}}, {"a.b": 7}),
        ({"f": "/components/a", "g": B}, {}),
        ({"f": "/components/a", "g": "a.b"}, {"/components": {}}),
        ({"f": "a.b", "g": "a.c.b", "h": "/components/a/arguments/b"}, {}),
    ],
)
def test_settings_that_refine_others_are_accepted(tmp_path, factors, common):
    (tmp_path / "s.json").write_text(
        json.dumps(
            {"name": "s", "scenario": "demo1_box", "factors": varied(factors), "settings": common}
        )
    )
    read_study(tmp_path / "s.json", SweepSpec)


def varied(factors):
    """Return factors that set a path, or that have a level with settings."""
    return [
        FACTOR | {"name": name, "set": what}
        if isinstance(what, str)
        else {"name": name, "levels": {"x": what}}
        for name, what in factors.items()
    ]


def test_all_problems_are_reported_at_once(tmp_path):
    found = problems(
        tmp_path,
        SweepSpec,
        {
            "factors": [{"name": "f"}, FACTOR | {"values": []}],
            "dedline": 1,
            "design": {"kind": "grid"},
        },
    )
    assert [line.split(": ")[1] for line in found] == [
        "$.factors[0]",
        "$.factors[1].values",
        "$.design.kind",
        "$.dedline",
    ]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"minimize": "1 +", "parameters": [PARAMETER]}, ["$.minimize", "is not an expression"]),
        (
            {"minimize": "k", "parameters": [PARAMETER], "constraints": ["k < 1"]},
            ["$.constraints[0]", "<= or >="],
        ),
        (
            {"minimize": "k", "parameters": [PARAMETER | {"start": 2.0}]},
            ["$.parameters[0]", 'expected "start" between'],
        ),
        ({"minimize": "k", "parameters": []}, ["$.parameters"]),
        (
            {"minimize": "k", "parameters": [PARAMETER | {"name": "value"}]},
            ["$.parameters[0].name", "expected a name other"],
        ),
        (
            {"minimize": "k", "parameters": [PARAMETER], "cases": [{}, {"a.b": 1}]},
            ['both "cases" and "p" set "a.b"'],
        ),
        (
            {"minimize": "k", "parameters": [PARAMETER], "method": {"kind": "magic"}},
            ["$.method.kind", "magic"],
        ),
    ],
)
def test_an_invalid_tuning_is_refused_with_the_position(tmp_path, content, words):
    (line,) = problems(tmp_path, TuneSpec, content)
    assert all(word in line for word in words), line


def test_invalid_settings_are_found_before_the_first_run(lag):
    """Three levels are invalid in three ways."""
    wrong = [
        {"name": "T", "set": "lag.Tau", "values": [1.0]},
        {"name": "y", "set": "lag.y_start", "values": [1.0, "high"]},
    ]
    levels = {"one": {"/components/lga/fmu": "x.fmu"}, "two": {}}
    done = lag.run_command("sweep", lag.write(factors=[*wrong, {"name": "l", "levels": levels}]))
    lines = done.err.splitlines()
    assert (done.code, len(lines)) == (2, 3), done.err
    for words in (
        ("$.factors[0].set", '"Tau"; valid: y_start, T'),
        ("$.factors[1].set", 'found "high"'),
        ("$.factors[2]", "components/lga"),
    ):
        found = [line for line in lines if words[0] in line and words[1] in line]
        assert found, done.err
    assert lag.records() == []


def test_an_invalid_value_of_a_pointer_is_located_in_the_sweep_file(lag):
    """The second of two levels, and a part of a setting that is an object, are invalid."""
    levels = {"good": {"/components/lag/fmu": "lag.fmu"}, "bad": {"/components/lag/fmu": "lga.fmu"}}
    factors = [
        {"name": "fmu", "levels": levels},
        {"name": "step", "set": "/step_size", "values": [0.01, -1]},
    ]
    common = {"/record": {"signals": ["lag.y", "lag.yy"]}}
    lines = lag.run_command("sweep", lag.write(factors=factors, settings=common)).err.splitlines()
    places = {
        line.split(": ")[1].partition(", in ")[0]
        for line in lines
        if line.startswith(str(lag.folder / "sweep.json"))
    }
    assert len(lines) == 3, lines
    assert places == {
        '$.factors[0].levels.bad["/components/lag/fmu"]',
        "$.factors[1].set",
        '$.settings["/record"].signals[1]',
    }


def test_criteria_with_unknown_kpis_are_refused_together_with_wrong_factors(lag):
    """Every problem has its place in the sweep file; nothing runs."""
    factors = [{"name": "T", "set": "lag.Tau", "values": [1.0]}]
    criteria = [
        {"kpi": "end.value", "max": 1.0},
        {"kpi": "end.valeu", "max": 1.0},
        {"kpi": "edn.value", "max": 1.0},
    ]
    done = lag.run_command("sweep", lag.write(factors=factors, success=criteria))
    assert (done.code, len(done.err.splitlines())) == (2, 3), done.err
    for i in (1, 2):
        text = f'$.success[{i}].kpi: no KPI "{criteria[i]["kpi"]}"; did you mean "end.value"?'
        assert f"{lag.folder / 'sweep.json'}:1:" in done.err
        assert text in done.err
    assert "$.factors[0].set" in done.err
    assert lag.records() == []


def test_criteria_with_kpis_that_only_runs_reveal_end_the_sweep_after_the_first_runs(lag):
    """The function computes the names of its values."""
    (lag.folder / "named.py").write_text("def f(result):\n    return dict([('height', 1.0)])\n")
    content = json.loads((lag.folder / "lag.json").read_text())
    (lag.folder / "lag.json").write_text(
        json.dumps(content | {"kpis": [{"name": "k", "python": "named.py:f"}]})
    )
    factors = [{"name": "y", "set": "lag.y_start", "values": list(range(50))}]
    done = lag.run_command(
        "sweep", lag.write(factors=factors, success=[{"kpi": "k.heigth", "max": 1.0}])
    )
    assert done.code == 2
    assert '$.success[0].kpi: no KPI "k.heigth"; did you mean "k.height"?' in done.err
    assert 0 < len(lag.records()) < 50


def test_a_factor_with_the_name_of_a_kpi_is_refused(lag):
    """KPIs are unknown before the first run."""
    done = lag.run_command(
        "sweep", lag.write(factors=[{"name": "end.value", "set": "lag.y_start", "values": [1, 2]}])
    )
    assert done.code == 2
    assert '$.factors[0].name: expected a name other than that of the KPI "end.value"' in done.err


def test_criteria_with_unknown_kpis_are_refused_when_all_runs_are_finished(lag):
    factors = [{"name": "y", "set": "lag.y_start", "values": [1, 2]}]
    assert lag.run_command("sweep", lag.write(factors=factors)).code == 0
    done = lag.run_command(
        "sweep", lag.write(factors=factors, success=[{"kpi": "end.valeu", "max": 1.0}])
    )
    assert (done.code, len(lag.records())) == (2, 2)
    assert '$.success[0].kpi: no KPI "end.valeu"; did you mean "end.value"?' in done.err


def test_a_file_that_cannot_be_imported_is_named(lag):
    (lag.folder / "broken.py").write_text(
        "import no_such_module\n\ndef f(result):\n    return {}\n"
    )
    kpis = [{"name": "k", "python": "broken.py:f"}]
    factors = [{"name": "y", "set": "lag.y_start", "values": [1.0]}]
    lag.run_command("sweep", lag.write(factors=factors, settings={"/kpis": kpis}))
    assert "No module named 'no_such_module'" in lag.table()[0]["failure"]


def test_a_component_that_exits_on_import_fails_only_its_own_runs(lag):
    """The fork server, which preloads the components of the scenario, is restarted without
    preloading.
    """
    (lag.folder / "deadly.py").write_text("import os\nos.abort()\n")
    content = json.loads((lag.folder / "lag.json").read_text())
    content["components"]["deadly"] = {"python": "deadly.py:Component"}
    (lag.folder / "lag.json").write_text(json.dumps(content))
    good = {"/components/deadly": {"fmu": "lag.fmu"}}
    lag.run_command("sweep", lag.write(factors=[{"name": "level", "levels": {"good": good}}]))
    assert [row["status"] for row in lag.table()] == ["ok"], lag.last_result


def test_schemas_are_printed():
    for option, key in (("--sweep", "factors"), ("--tune", "minimize")):
        done = CliRunner().invoke(cli, ["schema", option])
        assert key in json.loads(done.output)["properties"]


def test_a_scenario_is_not_read_as_a_sweep(tmp_path):
    (tmp_path / "base.json").write_text('{"name": "base", "components": {}}')
    done = run_cosim("sweep", "base.json", cwd=tmp_path)
    assert done.returncode == 2
    assert "is a scenario, expected a study; `cosim run base.json` runs it" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "name", ["cosim:scenarios/demo1_box.json", "cosim:scenarios/demo1_box", "demo1_box"]
)
def test_a_sweep_names_a_shipped_scenario_as_other_files_do(tmp_path, name):
    file = tmp_path / "s.json"
    file.write_text(json.dumps({"scenario": name, "name": "s", "factors": [FACTOR]}))
    assert read_study(file, SweepSpec).scenario == resources.root() / "scenarios/demo1_box.json"
    file.write_text(file.read_text().replace("box", "bx"))
    with pytest.raises(
        InputError, match=r's\.json:1:2: \$\.scenario: .*; did you mean "demo1_box(\.json)?"\?$'
    ):
        read_study(file, SweepSpec)
