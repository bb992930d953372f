"""Arguments of KPIs, figures and scenes that are taken from the system, and functions that may be
left out.
"""

import pytest
from cosim_command import run_cosim

import cosim

KPIS = """
from cosim.results.kpi import Signal


def double(result, k, limit=0.0):
    return {"k": 2 * k, "limit": limit}


def sizes(result, values):
    return {"first": values[0], "count": len(values)}


def last(result, signal: Signal):
    return {"value": float(result[signal][-1])}
"""


@pytest.fixture
def write(folder):
    (folder.path / "own.py").write_text(KPIS)
    folder.write(
        {"components": {"g": folder.block("Gain")}, "ports": {"parameters": {"gain": "g.k"}}},
        "nested.json",
    )
    components = {
        "a": folder.block("Gain", parameters={"u": 1.0}),
        "pilot": folder.block(
            "Controller", parameters={"gain": [1.0, 10.0], "vehicle.position.x": 0.0}
        ),
        "n": {"system": "nested.json"},
    }

    def scenario(function, arguments=None, checks=(), **keys):
        kpi = {"name": "k", "python": f"own.py:{function}", "arguments": arguments or {}, **keys}
        return folder.scenario(components, kpis=[kpi], checks=list(checks))

    return scenario


@pytest.mark.parametrize(
    ("name", "settings", "expected"),
    [
        ("a.k", {}, 4.0),
        ("a.k", {"a.k": 7.0}, 14.0),
        ("a.u", {}, 2.0),
        ("n.gain", {"n.g.k": 5.0}, 10.0),
        ("n.g.k", {"n.gain": 6.0}, 12.0),
        ("/components/a/parameters/u", {"/components/a/parameters/u": 9}, 18.0),
        ("/stop_time", {}, 6.0),
    ],
)
def test_a_value_of_the_system_is_that_of_the_run(write, name, settings, expected):
    result = cosim.run(write("double", {"k": {"from": name}}), parameters=settings)
    assert result.kpis["k.k"] == expected


def test_scalars_with_indices_are_a_list(write):
    file = write("sizes", {"values": {"from": "pilot.gain"}})
    assert cosim.run(file).kpis == {"k.first": 1.0, "k.count": 2}
    assert cosim.run(file, parameters={"pilot.gain[1]": 3.0}).kpis["k.first"] == 3.0


def test_arguments_that_are_not_given_are_taken_by_name(write):
    assert cosim.run(write("double", **{"from": "a"}), parameters={"a.k": 8.0}).kpis == {
        "k.k": 16.0,
        "k.limit": 0.0,
    }
    assert cosim.run(write("double", {"k": 1.0}, **{"from": "a"})).kpis["k.k"] == 2.0
    file = write("double", **{"from": ["/components/a/parameters", "a"]})
    assert cosim.run(file, parameters={"/components/a/parameters/k": 6.0}).kpis["k.k"] == 12.0


@pytest.mark.parametrize(
    ("arguments", "keys", "problem"),
    [
        (
            {"k": {"from": "a.q"}},
            {},
            '$.kpis[0].arguments.k: component "a" has no parameter "q"; valid: u, k',
        ),
        (
            {"k": {"from": "a.y"}},
            {},
            '$.kpis[0].arguments.k: "a.y" is an output, expected a parameter',
        ),
        ({"k": {"from": "b.k"}}, {}, '$.kpis[0].arguments.k: unknown component "b"'),
        ({"k": {"from": "/stop"}}, {}, '$.kpis[0].arguments.k: the scenario has no "/stop"'),
        ({}, {"from": "pilot"}, '$.kpis[0].from: component "pilot" has no parameter "k"'),
        ({}, {}, '$.kpis[0]: "double" needs the argument k'),
    ],
)
def test_a_value_that_does_not_exist_is_refused(folder, write, arguments, keys, problem):
    (found,) = folder.problems_of(write("double", arguments, **keys))
    assert problem in found


def test_the_run_records_the_values(write):
    result = cosim.run(write("double", **{"from": "a"}))
    (kpi,) = result.metadata["scenario"]["kpis"]
    assert kpi == {"name": "k", "python": "own.py:double", "arguments": {"k": 2.0}}


@pytest.mark.parametrize(
    ("function", "arguments"), [("last", {"signal": "a.z"}), ("double", {"k": {"from": "a.q"}})]
)
def test_an_optional_function_is_left_out_with_one_line(write, tmp_path, function, arguments):
    file = write(
        function,
        arguments,
        optional=True,
        checks=[{"kpi": f"k.{'value' if function == 'last' else 'k'}", "max": 1.0}],
    )
    done = run_cosim("run", str(file), "--no-report", cwd=tmp_path)
    assert done.returncode == 3, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if "nothing feeds" not in line]
    assert 'KPI "k" is left out: ' in line
    assert "failed" in done.stdout
    regressed = run_cosim("regress", str(file), cwd=tmp_path)
    assert regressed.returncode == 3
    assert "has no value, expected at most 1.0" in regressed.stdout


def test_an_optional_function_with_a_mistake_is_refused(folder, write):
    (problem,) = folder.problems_of(write("last", {"signal": "a.y", "colour": 1}, optional=True))
    assert '"last" takes no argument "colour"' in problem


def test_one_change_of_a_scenario_changes_everything():
    """The mass and a waypoint of demo1_box: the KPIs and figures follow."""
    settings = {
        "/components/plant/arguments/vehicles/uav/parameters": {"mass": 0.5},
        "usv.waypoint_count": 4,
        "usv.waypoint_x[4]": -4.0,
        "/stop_time": 1,
    }
    scenario = cosim.run("demo1_box", parameters=settings).metadata["scenario"]
    arguments = {
        each["name"]: each["arguments"] for each in (*scenario["kpis"], *scenario["figures"])
    }
    assert arguments["touchdown"]["mass"] == 0.5
    for name in ("waypoints", "paths"):
        assert (arguments[name]["waypoint_count"], arguments[name]["waypoint_x"][3]) == (4, -4.0)
    assert list(arguments["paths"]["platforms"]) == ["start"]
