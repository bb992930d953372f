"""`cosim new controller`: a new controller runs without changes, in every language."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from functools import cache
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from cosim_command import run_cosim

from cosim.cli import main
from cosim.components.fmi import FmuFile
from cosim.components.fmi.changed_sources import find_changed_sources
from cosim.core import resources
from cosim.report.scene import build_scene
from cosim.results import Result

pytestmark = pytest.mark.slow

MADE = {
    "python": ["my_pilot.py"],
    "modelica": ["MyPilot.mo"],
    "c": ["fmi2_block.h", "modelDescription.xml", "my_pilot.c"],
}
COMMON = ["my_pilot.json", "pictures.py", "test_my_pilot.py"]
ROLES = ("vessel_autopilot", "uav_controller")


def cosim(*arguments, cwd):
    return run_cosim(*arguments, cwd=cwd)


def new(folder, name, language, *more):
    """Run `cosim new controller` in this process, which is faster."""
    out, err = StringIO(), StringIO()
    with (
        chdir(folder),
        redirect_stdout(out),
        redirect_stderr(err),
        pytest.raises(SystemExit) as end,
    ):
        main(["new", "controller", name, "--language", language, *more])
    return subprocess.CompletedProcess("cosim new", end.value.code, out.getvalue(), err.getvalue())


def next_commands(done):
    return [
        shlex.split(line)[1:] for line in done.stdout.splitlines() if line.startswith("  cosim ")
    ]


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    """Function that creates a controller of a role in a language, runs all proposed commands and
    returns the folder.
    """

    @cache
    def move(role, language):
        folder = tmp_path_factory.mktemp(language)
        made = new(folder, "my_pilot", language, "--role", role)
        assert made.returncode == 0, made.stderr
        assert sorted(path.name for path in (folder / "my_pilot").iterdir()) == sorted(
            [*MADE[language], *COMMON, "fmus"]
        )
        for command in next_commands(made):
            done = cosim(*command, cwd=folder)
            assert done.returncode == 0, done.stdout + done.stderr
        return folder

    return move


@pytest.fixture(params=ROLES)
def role(request):
    return request.param


@pytest.mark.parametrize("language", MADE)
def test_a_new_controller_declares_the_variables_of_its_role(moved, role, language):
    """It replaces a shipped controller in `demo1_box` without a change of the wiring."""
    component, system = {"vessel_autopilot": ("usv", "fmu"), "uav_controller": ("uav", "system")}[
        role
    ]
    fmu = moved(role, language) / "my_pilot/my_pilot.fmu"
    settings = [
        f"/components/{component}/{system}=null",
        f"/components/{component}/fmu={json.dumps(str(fmu))}",
    ]
    parameters = {"altitude_command": 2.0, "yaw_command": 0.0}
    if component == "uav":
        # the KPIs and figures of the scenario read signals that only the shipped controller has
        settings += [
            f"/components/uav/parameters={json.dumps(parameters)}",
            "/kpis=[]",
            "/checks=[]",
            "/figures=[]",
        ]
    options = [f"--set={text}" for text in settings]
    done = cosim("check", "demo1_box", *options, cwd=moved(role, language))
    assert done.returncode == 0, done.stderr


def test_the_scenario_of_a_new_controller_gets_no_recommendations_and_warnings(moved, role):
    done = cosim("check", "my_pilot/my_pilot.json", cwd=moved(role, "python"))
    assert "recommendation for the order\n  none: " in done.stdout
    assert "No warnings." in done.stdout


def test_all_languages_give_the_same_trajectory(moved, role):
    ours, theirs, reference = (
        Result.from_csv(moved(role, one) / "runs/my_pilot/result.csv")
        for one in ("modelica", "c", "python")
    )
    names = [name for name in reference if name.startswith(("vessel.", "quadcopter."))]
    assert len(names) > 20
    for name in names:
        for other in (ours, theirs):
            assert np.abs(other[name].astype(float) - reference[name].astype(float)).max() < 1e-9, (
                name
            )


@pytest.mark.parametrize("language", MADE)
def test_the_exported_fmu_gives_the_same_trajectory(moved, role, language):
    """The FMU exported by the proposed command replaces the source in the scenario."""
    folder = moved(role, language)
    scenario = json.loads((folder / "my_pilot/my_pilot.json").read_text())
    name = "usv" if role == "vessel_autopilot" else "uav"
    scenario["components"][name] = {
        "fmu": "my_pilot.fmu",
        "parameters": scenario["components"][name]["parameters"],
    }
    (folder / "my_pilot/exported.json").write_text(json.dumps(scenario))
    assert (
        cosim(
            "run", "my_pilot/exported.json", "--no-report", "--output-dir", "out", cwd=folder
        ).returncode
        == 0
    )
    first, second = (
        Result.from_csv(file / "result.csv") for file in (folder / "runs/my_pilot", folder / "out")
    )
    assert np.array_equal(first["vessel.position.x"], second["vessel.position.x"])


def run_pytest(folder, name):
    """Run the test of a controller without plugins, whose imports would take half of the time."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", name]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    return subprocess.run(
        command,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env=environment,
    )


@pytest.mark.parametrize(("role", "language"), [*zip(ROLES, ["python", "c"], strict=True)])
def test_the_test_of_a_new_controller_passes(moved, role, language):
    done = run_pytest(moved(role, language), "my_pilot")
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    ("name", "expected"),
    [("PIDKeeper", "pid_keeper/PidKeeper.mo"), ("k2_slow", "k2_slow/K2Slow.mo")],
)
def test_names_take_the_form_of_the_language(tmp_path, name, expected):
    assert new(tmp_path, name, "modelica", "--directory", "mine").returncode == 0
    text = (tmp_path / "mine" / expected).read_text()
    model = Path(expected).stem
    assert text.startswith(f"block {model}\n")
    assert text.endswith(f"end {model};\n")


@pytest.mark.parametrize("language", MADE)
def test_the_templates_name_is_replaced_everywhere(moved, role, language):
    texts = [
        (moved(role, language) / "my_pilot" / name).read_text()
        for name in (*MADE[language], *COMMON)
    ]
    assert not [
        text
        for text in texts
        if re.search("waypoint_follower|deck_follower|Follower|CONTROLLER", text)
    ]


def test_a_binary_of_another_c_controller_is_refused(tmp_path):
    """The GUID contains the controller's name, so that the binary of another controller does not
    match.
    """
    for name in ("one", "two"):
        assert new(tmp_path, name, "c").returncode == 0
    shutil.copy(tmp_path / "one/one.c", tmp_path / "two/two.c")
    assert cosim("build", "two", "--output", "two/two.fmu", cwd=tmp_path).returncode == 0
    done = cosim("run", "two/two.json", cwd=tmp_path)
    assert done.returncode == 1
    assert "expected type Co-Simulation and GUID" in done.stderr


def test_the_folder_can_be_moved(tmp_path):
    """No file contains an absolute path, so the scenario runs in any folder."""
    assert new(tmp_path, "keeper", "python").returncode == 0
    given = (tmp_path / "keeper").rename(tmp_path / "given")
    texts = [path.read_text() for path in given.iterdir() if path.is_file()]
    assert not [text for text in texts if str(tmp_path) in text or str(resources.root()) in text]
    done = cosim("run", "given/keeper.json", "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


FIGURES = [
    ("vessel_autopilot", "course", ["vessel"]),
    ("uav_controller", "track", ["quadcopter", "vessel"]),
]


@pytest.mark.parametrize(("role", "figure", "bodies"), FIGURES)
def test_a_run_writes_a_figure_and_a_replay(moved, role, figure, bodies):
    folder = moved(role, "python")
    runs = folder / "runs/my_pilot"
    assert (runs / f"{figure}.png").is_file()
    assert [
        body["name"] for body in build_scene(json.loads((runs / "run.json").read_text()))["bodies"]
    ] == bodies
    done = cosim("replay", runs, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("language", MADE)
def test_an_fmu_older_than_its_source_is_recognized(moved, language, tmp_path):
    folder = shutil.copytree(
        moved("vessel_autopilot", language) / "my_pilot", tmp_path / "my_pilot"
    )
    assert find_changed_sources(FmuFile(folder / "my_pilot.fmu")) == []
    source = folder / MADE[language][-1]
    source.write_text(source.read_text() + "\n")
    assert find_changed_sources(FmuFile(folder / "my_pilot.fmu")) == [source]


def test_an_fmu_of_a_class_that_imports_another_file_is_not_older_than_its_source(moved, tmp_path):
    folder = shutil.copytree(
        moved("vessel_autopilot", "python") / "my_pilot", tmp_path / "my_pilot"
    )
    (folder / "bold.py").write_text(
        "from my_pilot import MyPilot\n\n\nclass Bold(MyPilot):\n    pass\n"
    )
    assert cosim("build", "bold.py", "--output", "bold.fmu", cwd=folder).returncode == 0
    assert find_changed_sources(FmuFile(folder / "bold.fmu")) == []
    (folder / "bold.py").write_text(
        "from my_pilot import MyPilot\n\n\nclass Bold(MyPilot):\n    gain = 2\n"
    )
    assert find_changed_sources(FmuFile(folder / "bold.fmu")) == [folder / "bold.py"]
    (folder / "bold.py").write_text("from my_pilot import\n")
    assert find_changed_sources(FmuFile(folder / "bold.fmu")) == [folder / "bold.py"]


def test_a_run_of_an_fmu_older_than_its_source_warns(moved, tmp_path):
    folder = shutil.copytree(moved("vessel_autopilot", "c") / "my_pilot", tmp_path / "my_pilot")
    with (folder / "my_pilot.c").open("a") as source:
        source.write("/* changed */\n")
    done = cosim("check", "my_pilot/my_pilot.json", cwd=tmp_path)
    command = "cosim build my_pilot --output my_pilot/my_pilot.fmu"
    warning = (
        '"my_pilot/my_pilot.fmu" was built from another version of my_pilot/my_pilot.c: '
        f"`{command}` builds it again"
    )
    assert f"WARNING {warning}\n" in done.stderr


def test_files_are_overwritten_only_with_force(tmp_path):
    assert new(tmp_path, "keeper", "python").returncode == 0
    source = tmp_path / "keeper/keeper.py"
    template = source.read_text()
    source.write_text("mine")
    refused = new(tmp_path, "keeper", "python")
    assert refused.returncode == 2
    assert refused.stderr.splitlines() == [
        f"keeper/{file}: exists; --force overwrites it"
        for file in (
            "keeper.py",
            "keeper.json",
            "test_keeper.py",
            "pictures.py",
            "fmus/strider.fmu",
        )
    ]
    assert source.read_text() == "mine"
    assert new(tmp_path, "keeper", "python", "--force").returncode == 0
    assert source.read_text() == template


@pytest.mark.parametrize(
    ("name", "language", "message"),
    [
        (
            "keeper",
            "pyton",
            'there is no template for the language "pyton"; did you mean "python"?',
        ),
        (
            "keeper",
            "ada",
            'there is no template for the language "ada"; valid: python, modelica, c',
        ),
        (
            "my-keeper",
            "c",
            (
                '"my-keeper" is not a valid name of a controller: expected a letter, then letters, '
                "digits and underscores"
            ),
        ),
        ("../keeper", "c", '"../keeper" is not a valid name of a controller'),
        ("2fast", "python", '"2fast" is not a valid name of a controller'),
        ("math", "python", '"math" is already used for something else; choose another name'),
        (
            "pictures",
            "python",
            '"pictures" is already used for something else; choose another name',
        ),
        (
            "vehicle",
            "modelica",
            '"vehicle" is already used for something else; choose another name',
        ),
        (
            "Boolean",
            "modelica",
            '"Boolean" is already used for something else; choose another name',
        ),
    ],
)
def test_unsuitable_names_and_languages_are_refused(tmp_path, name, language, message):
    done = new(tmp_path, name, language)
    assert done.returncode == 2
    assert done.stderr.startswith(message)
    assert list(tmp_path.iterdir()) == []


def test_a_missing_language_and_a_file_in_the_place_of_the_folder_are_named(tmp_path):
    (tmp_path / "room").write_text("x")
    done = new(tmp_path, "room", "python")
    assert (done.returncode, done.stderr) == (
        2,
        "room: is a file, expected the name of a new folder\n",
    )
    done = run_cosim("new", "controller", "keeper", cwd=tmp_path)
    assert "Missing option '--language': python, modelica, c" in done.stderr


def test_the_test_of_a_new_controller_ends_an_endless_loop(tmp_path):
    assert new(tmp_path, "keeper", "python").returncode == 0
    source = tmp_path / "keeper/keeper.py"
    source.write_text(
        re.sub(
            r"(    def do_step\(.*\n)",
            r"\1        while True:\n            pass\n",
            source.read_text(),
        )
    )
    scenario = tmp_path / "keeper/keeper.json"
    scenario.write_text(json.dumps(json.loads(scenario.read_text()) | {"deadlines": {"step": 0.3}}))
    done = run_pytest(tmp_path, "keeper")
    assert done.returncode == 1
    assert "did not return within 0.3 s" in done.stdout


def test_the_output_of_a_build_is_an_fmu(tmp_path):
    (tmp_path / "room.py").write_text("x = 1")
    done = run_cosim("build", "room.py", "--output", "room", cwd=tmp_path)
    assert done.returncode == 2
    assert (
        '--output: expected the name of an FMU; found "room"; did you mean "room.fmu"?'
        in done.stderr
    )


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            '{\n "family": "multirotor",\n "mass": 1.0\n "inertia": 1\n}',
            "boat.json:3:13: expected ',' or '}'",
        ),
        (
            '{"family": "submerged", "mass": NaN}',
            "boat.json:1:33: $.mass: NaN is not allowed, expected a finite number",
        ),
        (
            '{\n "family": "multirotr"}',
            """boat.json:2:2: $.family: found 'multirotr'; did you mean "multirotor"?""",
        ),
        ("[1]", "boat.json:1:1: $: expected an object, the data of a vehicle"),
    ],
)
def test_the_export_of_a_vehicle_file_names_the_place_of_a_fault(tmp_path, text, line):
    (tmp_path / "boat.json").write_text(text)
    done = run_cosim("build", "boat.json", "--output", "boat.fmu", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, f"{line}\n")


@pytest.mark.parametrize(
    ("base", "hint"),
    [("ar_drone", "cosim run demo1_box --set"), ("x500", "multirotor_controller.fmu flies it")],
)
def test_a_new_multirotor_comes_with_a_way_to_fly_it(tmp_path: Path, base: str, hint: str) -> None:
    done = run_cosim("new", "vehicle", "my_quad", "--from", base, cwd=tmp_path)
    assert hint in done.stdout


def test_a_new_boat_is_a_copy_of_the_otter(tmp_path: Path) -> None:
    done = run_cosim("new", "vehicle", "my_boat", "--from", "otter", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Name it in a scenario" in done.stdout
    assert json.loads((tmp_path / "my_boat.json").read_text())["family"] == "surface_vessel"
