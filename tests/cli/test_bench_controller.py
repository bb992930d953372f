"""`cosim bench-controller`: candidates that replace the autopilot of the Strider and other
controllers.
"""

from __future__ import annotations

import json
import re
import shutil

import pytest
from cosim_command import run_cosim
from fault_fmu import FaultFmus, build_library

from cosim.cli.bench_output import print_side_by_side
from cosim.core import resources
from cosim.studies.controller_bench.page import BenchedController
from cosim.studies.controller_bench.ranking import RunKpis, ScenarioKpis, rank

ROOT = resources.root()
MISSION = {
    "speed_command": 1.0,
    "acceptance_radius": 0.5,
    "waypoint_count": 2,
    "waypoint_x": [4.0, 4.0],
    "waypoint_y": [0.0, 4.0],
    "heading_P": 1.0,
}
SAIL = {
    "name": "sail",
    "stop_time": 12,
    "step_size": 0.01,
    "components": {
        "usv": {"fmu": str(ROOT / "fmus/strider_autopilot.fmu"), "parameters": MISSION},
        "vessel": {
            "fmu": str(ROOT / "fmus/strider.fmu"),
            "parameters": {"initial.velocity_body.u": 0.5},
        },
    },
    "connections": [
        {"from": "vessel", "to": "usv.vehicle"},
        {"from": "usv.thrust", "to": "vessel.thrust"},
        {"from": "usv.rudder_angle", "to": "vessel.rudder_angle"},
    ],
    "kpis": [
        {
            "name": "waypoints",
            "python": str(ROOT / "plant_src/kpis.py:waypoints"),
            "arguments": {
                "vehicle": "vessel",
                "waypoint_x": [4.0, 4.0],
                "waypoint_y": [0.0, 4.0],
                "acceptance_radius": 0.5,
            },
        },
        {"name": "away", "python": "cosim.kpis:final", "arguments": {"signal": "usv.distance"}},
    ],
    "checks": [{"kpi": "waypoints.all_reached", "equals": True}, {"kpi": "away.value", "max": 1.0}],
    "reference": {"file": "references/sail.csv", "tolerances": {"vessel.*": {"absolute": 1e-9}}},
}
KEEPER = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Keeper(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        {first}
        self.values = {{}}
        for causality, names in {names}.items():
            for name in names:
                self.register(name, getattr(Fmi2Causality, causality), {units}.get(name))

    def register(self, name, causality, unit):
        variable = Real(name, causality=causality, getter=lambda: self.values.get(name, 0.0),
                        setter=lambda value: self.values.update({{name: value}}))
        variable.unit = unit
        self.register_variable(variable)

    def do_step(self, current_time, step_size):
        self.values["thrust"] = 10.0
        return True
"""


def keeper(
    folder,
    inputs=("vehicle.position.x",),
    outputs=("thrust", "rudder_angle"),
    units=None,
    first="pass",
):
    path = folder / "keeper.py"
    path.write_text(
        KEEPER.format(first=first, names={"input": inputs, "output": outputs}, units=units or {})
    )
    return f"{path}:Keeper"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios/sail.json").write_text(json.dumps(SAIL))
    return tmp_path


def bench(folder, controller, *arguments, role="vessel_autopilot"):
    return run_cosim("bench-controller", controller, "--role", role, *arguments, cwd=folder)


def words(done, name):
    """Return the words of a KPI's line in the table."""
    return next(line.split() for line in done.stdout.splitlines() if line.startswith(name))


def read_page(path):
    """Return the text of a page with line breaks and indents as single spaces, as it is shown."""
    return " ".join(path.read_text().split())


def lazy(folder):
    """Write the autopilot as a nested system with a very small rudder gain."""
    system = json.loads((ROOT / "scenarios/systems/strider_autopilot.json").read_text())
    for component in system["components"].values():
        component["fmu"] = str((ROOT / "scenarios/systems" / component["fmu"]).resolve())
    system["components"]["heading"]["parameters"] = {"rudder_limit": 0.02}
    path = folder / "lazy.json"
    path.write_text(json.dumps(system))
    return path


def test_another_build_of_the_shipped_controller_is_neither_better_nor_worse(folder):
    done = bench(folder, ROOT / "fmus/python/strider_autopilot.fmu", "--json")
    assert done.returncode == 0
    (sail,) = json.loads(done.stdout)["scenarios"]
    assert len(sail["kpis"]) == 5
    assert all(kpi["against_shipped"] == "" for kpi in sail["kpis"])
    assert [kpi["candidate"] for kpi in sail["kpis"]] == pytest.approx(
        [kpi["shipped"] for kpi in sail["kpis"]], rel=1e-9
    )
    assert {kpi["name"]: kpi["unit"] for kpi in sail["kpis"]}["away.value"] == "m"


def test_worse_and_better_controllers_are_marked(folder):
    path = lazy(folder)
    worse = bench(folder, path, "--verbose")
    assert worse.returncode == 3
    assert "FAILED  sail" in worse.stdout
    assert "waypoints.all_reached is false, expected true" in worse.stdout
    assert words(worse, "waypoints.reached")[1:] == ["1", "2", "worse"]
    assert words(worse, "waypoints.time[2]")[1:] == [
        "s",
        "-",
        words(worse, "waypoints.time[2]")[3],
        "worse",
    ]
    assert "last run" not in worse.stdout
    path.write_text(path.read_text().replace("0.02", "0.7"))
    shipped = (folder / "runs/bench/shipped/sail/run.json").stat().st_mtime_ns
    better = bench(folder, path, "--verbose")
    assert (
        folder / "runs/bench/shipped/sail/run.json"
    ).stat().st_mtime_ns == shipped  # nothing has changed there
    assert better.returncode == 0
    assert words(better, "waypoints.reached")[1:] == ["2", "2", "1", "better"]
    assert "last run" in better.stdout


def test_a_controller_that_fails_checks_ranks_below_however_many_kpis_are_better(folder):
    path = lazy(folder)
    worse = bench(folder, path)
    *lines, page = worse.stdout.splitlines()
    assert lines[-3:-1] == [
        "1. scenario's own  1 of 1 scenario passed, 2 of 2 checks passed",
        "2. lazy            0 of 1 scenario passed, 0 of 2 checks passed",
    ]
    assert lines[-1].startswith(
        "lazy is worse than the scenarios' own controllers (waypoints.reached 0 better, 1 worse;"
    )
    assert len(lines) < 10  # the tables of all KPIs are left out
    assert page == "page: runs/bench/vessel_autopilot/bench.html"
    ranking = json.loads(bench(folder, path, "--json").stdout)["ranking"]
    assert (ranking["verdict"], ranking["candidate"]["met"]) == ("below", 0)


def test_all_problems_of_an_unsuitable_controller_are_reported(folder):
    source = keeper(
        folder,
        ["vehicle.position.x", "vehicle.postion.y", "gusts"],
        ["thrust", "rudder_angel"],
        {"thrust": "m", "vehicle.position.x": "cm"},
    )
    done = bench(folder, source)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        f'{source}: the output "rudder_angle" (rad) is missing; did you mean "rudder_angel"?',
        (
            f'{source}: the role has no signal for the input "vehicle.postion.y"; did you mean '
            '"vehicle.position.y"?'
        ),
        f'{source}: the role has no signal for the input "gusts"',
        f'{source}: "thrust" has the unit "m", expected "N" or a unit that converts to it',
    ]
    assert not (folder / "runs/bench/shipped").exists()


def test_an_invalid_source_is_reported_as_the_user_wrote_it(folder):
    source = keeper(folder).replace("Keeper", "Kepeer")
    done = bench(folder, source)
    message = f'{source}: "{folder / "keeper.py"}" defines no "Kepeer"; did you mean "Keeper"?\n'
    assert (done.returncode, done.stderr) == (2, message)


def test_a_problem_inside_a_nested_system_keeps_its_position(folder):
    path = folder / "lost.json"
    path.write_text('{"components": {"a": {"python": "lost.py:A"}}, "ports": {}}')
    done = bench(folder, path)
    message = (
        f'{path}:1:17: $.components.a: file "lost.py" does not exist; no *.py in "{path.parent}"\n'
    )
    assert (done.returncode, done.stderr) == (2, message)


def test_entries_about_missing_variables_are_removed_and_noted(folder):
    done = bench(folder, keeper(folder), "--verbose")
    assert done.returncode == 3
    assert 'note: sail: kpi "away" is left out: the candidate has no "distance"' in done.stdout
    assert (
        'note: sail: "usv.waypoint_count" is left out: the candidate has no "waypoint_count"'
        in done.stdout
    )
    below = done.stdout.partition("FAILED  sail")[2]
    assert (
        "\n        ignored settings: speed_command, acceptance_radius, waypoint_count, "
        "waypoint_x, waypoint_y, heading_P\n"
    ) in below
    written = json.loads(
        (folder / "runs/bench/vessel_autopilot/Keeper/scenarios/sail.json").read_text()
    )
    assert written["components"]["usv"] == {
        "parameters": {},
        "python": f"{folder / 'keeper.py'}:Keeper",
    }
    assert [kpi["name"] for kpi in written["kpis"]] == ["waypoints"]
    assert "reference" not in written


def test_settings_that_the_scenario_gives_the_controller_are_listed(folder):
    variability = "__import__('pythonfmu').Fmi2Variability.tunable"
    declared = (
        f"Real('speed_command', causality=Fmi2Causality.parameter, variability={variability})"
    )
    candidate = keeper(
        folder, first=f"self.speed_command = 0.5; self.register_variable({declared})"
    )
    applied = "speed_command = 1.0"
    done = bench(folder, candidate)
    assert f"\n        settings applied: {applied}\n" in done.stdout.partition("FAILED  sail")[2], (
        done.stdout + done.stderr
    )
    page = read_page(folder / "runs/bench/vessel_autopilot/bench.html")
    assert f"Settings applied to Keeper: {applied}." in page
    (scenario,) = json.loads(bench(folder, candidate, "--json").stdout)["scenarios"]
    assert scenario["applied_settings"] == {"usv": {"speed_command": 1.0}}


def test_notes_of_several_scenarios_stand_once_after_the_ranking(folder):
    (folder / "scenarios/row.json").write_text(json.dumps({**SAIL, "name": "row"}))
    ranking, notes = bench(folder, keeper(folder)).stdout.split("\n\n")[-2:]
    assert ranking.splitlines()[-1].startswith(
        "Keeper is worse than the scenarios' own controllers"
    )
    assert notes.splitlines()[:-1] == [
        "note: ignored settings, for which the controller has no variable (number of scenarios): "
        "speed_command (2), acceptance_radius (2), waypoint_count (2), waypoint_x (2), waypoint_y "
        "(2), heading_P (2)",
        'note: left out (number of scenarios): kpi "away" without "distance" (2)',
    ]


def test_the_page_of_a_single_controller_shows_it_beside_the_controller_of_the_scenario(folder):
    """The KPI that the candidate has no signal for has a value of the scenario's own controller
    only.
    """
    page = read_page(
        folder / bench(folder, keeper(folder)).stdout.splitlines()[-1].removeprefix("page: ")
    )
    assert "The scenario's own controller is strider_autopilot." in page
    assert "cost" not in page.split("<body>")[1]
    assert "lanes*.reached" in page
    assert "* stands for any text" in page
    row = page.partition(">waypoints.reached</td>")[2].partition("</tr>")[0]
    assert re.findall(r'data-label="([^"]*)" class="number[ a-z]*" ?>(\d)<', row) == [
        ("scenario&#39;s own", "2"),
        ("Keeper", "1"),
    ]
    assert (
        "<li>Keeper: left out (number of scenarios): kpi &#34;away&#34; without "
        "&#34;distance&#34; (1)</li>"
    ) in page


def test_a_scenario_that_does_not_feed_an_input_is_not_applicable(folder):
    """A measuring vessel, of which only the position is connected, has no output for the
    candidate's heading.
    """
    measured = {**SAIL, "name": "measured", "connections": SAIL["connections"][1:]}
    measured["connections"].append({"from": "vessel.position", "to": "usv.vehicle.position"})
    measured["connections"].append({"from": "vessel.attitude", "to": "usv.vehicle.attitude"})
    measured["connections"].append({"from": "vessel.position", "to": "usv.vehicle"})
    (folder / "scenarios/measured.json").write_text(json.dumps(measured))
    done = bench(
        folder, keeper(folder, ["vehicle.position.x", "vehicle.rates.r", "vehicle.velocity.x"])
    )
    assert done.stdout.splitlines()[0] == (
        "n/a     measured                     not applicable: input usv.vehicle.rates.r has no "
        "matching output "
        "vessel.position.rates.r; connect vessel.rates.r to it (and 1 more input)"
    )
    assert "2. Keeper          0 of 1 scenario passed" in done.stdout


@pytest.fixture(scope="module")
def fault_libraries(tmp_path_factory):
    library = tmp_path_factory.mktemp("fault")
    return {2: build_library(2, library)}


def test_an_fmu_that_crashes_fails_only_its_scenario(tmp_path, fault_libraries):
    """The role of a user's project: a lag."""
    shipped = FaultFmus(fault_libraries, tmp_path)(2, name="shipped")
    role = {
        "description": "A lag.",
        "controllers": ["shipped.fmu"],
        "inputs": {"u": ""},
        "outputs": {"y": ""},
    }
    (tmp_path / "lag.json").write_text(json.dumps(role))
    (tmp_path / "scenarios").mkdir()
    for name, stop_time in (("short", 0.03), ("long", 0.1)):
        kpis = [{"name": "end", "python": "cosim.kpis:final", "arguments": {"signal": "lag.y"}}]
        content = {
            "name": name,
            "stop_time": stop_time,
            "step_size": 0.01,
            "components": {"lag": {"fmu": str(shipped)}},
        }
        (tmp_path / f"scenarios/{name}.json").write_text(json.dumps({**content, "kpis": kpis}))
    crashing = FaultFmus(fault_libraries, tmp_path)(2, "DoStep 6 segv", name="crashing")
    done = bench(tmp_path, crashing, role="lag.json")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "passed  short" in done.stdout
    assert "FAILED  long" in done.stdout
    assert "lag: fmi2DoStep failed at t = 0.05 s" in done.stdout, done.stdout
    assert "SIGSEGV" in done.stdout


RAISING = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Raising(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.u = self.y = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if current_time > 0.5:
            raise ValueError("it is late")
        return True
"""


@pytest.mark.parametrize(
    ("last", "cells", "message"),
    [
        (
            "late.py:Raising",
            ["-", "-"],
            "the cost of late.py:Raising is not measured: controller: do_step failed at t = ",
        ),
        ("crashing.fmu", None, "WARNING no cost is measured: "),
    ],
)
def test_a_controller_that_fails_while_costs_are_measured_keeps_the_table_and_the_page(
    tmp_path, fault_libraries, last, cells, message
):
    """The scenario has 3 steps, the measurement hundreds. A crash ends the measurement of all
    costs, an exception that of one.
    """
    shipped = FaultFmus(fault_libraries, tmp_path)(2, name="shipped")
    FaultFmus(fault_libraries, tmp_path)(2, "DoStep 6 segv", name="crashing")
    (tmp_path / "late.py").write_text(RAISING)
    role = {
        "description": "A lag.",
        "controllers": ["shipped.fmu"],
        "inputs": {"u": ""},
        "outputs": {"y": ""},
    }
    (tmp_path / "lag.json").write_text(json.dumps(role))
    (tmp_path / "scenarios").mkdir()
    content = {
        "name": "short",
        "stop_time": 0.03,
        "step_size": 0.01,
        "components": {"lag": {"fmu": str(shipped)}},
    }
    content["kpis"] = [
        {"name": "end", "python": "cosim.kpis:final", "arguments": {"signal": "lag.y"}}
    ]
    (tmp_path / "scenarios/short.json").write_text(json.dumps(content))
    done = bench(tmp_path, shipped, last, role="lag.json")
    assert message in done.stderr, done.stdout + done.stderr
    rows = {
        line.split()[0]: line.split()[-2:]
        for line in done.stdout.splitlines()
        if re.match(r"(shipped|Raising|crashing) +\d+ of", line)
    }
    assert len(rows) == 2, done.stdout + done.stderr
    assert "nan" not in done.stdout
    if cells:
        assert rows["Raising"] == cells
        assert float(rows["shipped"][0]) > 0
    else:
        assert set(map(tuple, rows.values())) == {("-", "-")}
        assert "the costs were not measured\n" in done.stdout
    assert done.stdout.splitlines()[-1].startswith("page: ")


def test_a_part_of_a_shipped_controller_is_replaced(folder):
    """The scenario contains the autopilot as one FMU; it is replaced by the nested system with the
    new heading controller.
    """
    shutil.copy(ROOT / "fmus/fmi3/heading_controller.fmu", folder / "heading.fmu")
    done = bench(folder, "heading.fmu", "--json", role="usv_heading")
    assert done.returncode == 0, done.stdout + done.stderr
    (sail,) = json.loads(done.stdout)["scenarios"]
    assert all(kpi["candidate"] == kpi["shipped"] for kpi in sail["kpis"])
    lame = bench(folder, "heading.fmu", "--json", "--set", "rudder_limit=0.02", role="usv_heading")
    assert lame.returncode == 3
    assert "worse" in [
        kpi["against_shipped"] for kpi in json.loads(lame.stdout)["scenarios"][0]["kpis"]
    ]


def test_several_controllers_are_shown_side_by_side_with_their_costs(folder):
    """A weak nested system, a class in Python that does not steer, and the shipped FMU, which is
    listed first.
    """
    done = bench(folder, lazy(folder), keeper(folder), ROOT / "fmus/strider_autopilot.fmu")
    assert done.returncode == 3, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    cost_line = lines.index("cost: smallest processor time per step; ratio: to ar_drone_geometric")
    differ = (
        "the totals differ: scenarios that are not applicable (n/a) and checks of KPIs that are "
        "left out do not count"
    )
    assert lines[cost_line - 2 : cost_line] == [
        "order: passed checks, then passed scenarios, then the goals of the role",
        differ,
    ]
    rows = [line.split() for line in lines[lines.index("") + 3 : cost_line - 3]]
    assert rows[0][:7] == ["strider_autopilot", "1", "of", "1", "2", "of", "2"]
    costs = {row[0]: float(row[-2]) for row in rows}
    ratios = {row[0]: float(row[-1]) for row in rows}
    assert set(costs) == {"strider_autopilot", "lazy", "Keeper"}
    assert costs["Keeper"] > 3 * costs["strider_autopilot"] > 0
    assert 0.05 < ratios["strider_autopilot"] < 3
    assert costs["lazy"] / ratios["lazy"] == pytest.approx(
        costs["Keeper"] / ratios["Keeper"], rel=0.02
    )
    assert [line.partition(" (number")[0] for line in lines[cost_line + 1 : -1]] == [
        "note: Keeper: ignored settings, for which the controller has no variable",
        "note: Keeper: left out",
    ]
    page = read_page(folder / lines[-1].removeprefix("page: "))
    assert page.index("strider_autopilot</td>") < page.index("lazy</td>")
    _, *headings = (
        page.split("<h2>")[2]
        .partition("<thead>")[2]
        .partition("</thead>")[0]
        .split('<th class="number">')
    )
    names = [each.replace("<wbr>", "").partition("<")[0] for each in headings]
    assert names == ["scenario's own", "lazy", "Keeper", "strider_autopilot"]
    assert "Its reference is ar_drone_geometric" in page
    assert 'class="number missed" title="check: equals true">no' in page
    assert 'title="true if all waypoints were reached in order">waypoints.all_reached</td>' in page
    assert (
        "<dd>value, the last value of a signal in its own unit" not in page
    )  # not of `cosim.kpis:final`
    assert (
        "<dt>away.<wbr>value</dt><dd>the error in the last row (signal usv.distance)</dd>" in page
    )
    assert "http" not in page.split("<body>")[1]


def test_the_table_says_that_scenarios_which_are_not_applicable_make_totals_differ(capsys):
    def benched(name, applicable):
        runs = [
            ScenarioKpis(RunKpis({"a": 0.0}, {}, {}), None, [{"kpi": "a", "max": 1}])
            for _ in range(applicable)
        ]
        return BenchedController(name, rank(runs, []), {}, [], [])

    print_side_by_side([benched("first", 2), benched("second", 2)], "")
    assert "totals differ" not in capsys.readouterr().out
    print_side_by_side([benched("first", 2), benched("second", 1)], "")
    assert "totals differ" in capsys.readouterr().out


def test_failures_of_shipped_controllers_do_not_affect_the_exit_code_of_an_own_one(folder):
    """The role of a user's project, whose shipped controller is weak; the own controller is the
    reference of the costs.
    """
    fmu, role = (
        str(ROOT / "fmus/strider_autopilot.fmu"),
        json.loads((ROOT / "scenarios/roles/vessel_autopilot.json").read_text()),
    )
    role["inputs"]["vehicle"]["outputs_of"] = str(ROOT / "fmus/strider.fmu")
    role |= {"controllers": [str(lazy(folder)), fmu], "cost_reference": fmu}
    (folder / "own.json").write_text(json.dumps(role))
    done = bench(folder, fmu, "--all", role="own.json")
    assert done.returncode == 0, done.stdout + done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "strider_autopilot (controller 1 of 2)"
    assert lines[2].startswith("lazy (controller 2 of 2, about ")
    assert "FAILED  sail" in done.stdout
    ratios = {line.split()[0]: line.split()[-1] for line in lines if " of 1 " in line}
    assert ratios["strider_autopilot"] == "1"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "name a CONTROLLER, or --all"),
        (["lazy.json", "other/lazy.json"], '2 controllers are called "lazy"'),
        (["lazy.json", "--all", "--set", "speed_P=1"], "--set needs a single CONTROLLER"),
    ],
)
def test_controllers_that_cannot_be_compared_are_refused(folder, arguments, message):
    (folder / "other").mkdir()
    shutil.copy(lazy(folder), folder / "other/lazy.json")
    done = run_cosim("bench-controller", *arguments, "--role", "vessel_autopilot", cwd=folder)
    assert done.returncode == 2
    assert message in done.stderr


def test_scenarios_with_equal_names_are_refused(folder):
    shutil.copytree(folder / "scenarios", folder / "more")
    done = bench(folder, lazy(folder), "--scenarios", "scenarios", "--scenarios", "more")
    assert (done.returncode, done.stderr) == (
        2,
        '2 scenarios are called "sail.json": their results would go to one folder\n',
    )
