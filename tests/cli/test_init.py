"""`cosim init`: a new project passes its tests, and detects changes of its controller."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cosim import __version__
from cosim.cli.commands.init import pip_origin, pip_requirement

pytestmark = pytest.mark.slow


def run(*command, cwd):
    """Run a command of this environment as from a user's shell."""
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTEST_ADDOPTS": "",
    }
    return subprocess.run(
        [*map(str, command)], cwd=cwd, capture_output=True, text=True, check=False, env=environment
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("own")


@pytest.fixture(scope="module")
def made(folder):
    (folder / "my controllers/tests").mkdir(parents=True)
    for name in ("notes.txt", "tests/own.py"):
        (folder / "my controllers" / name).touch()
    return run("cosim", "init", "my controllers", cwd=folder)


@pytest.fixture(scope="module")
def project(folder, made):
    assert made.returncode == 0, made.stderr
    listed = {
        Path(line).relative_to("my controllers").as_posix()
        for line in made.stdout.splitlines()
        if line.startswith("my ")
    }
    root = folder / "my controllers"
    files = {
        path.relative_to(root).as_posix()
        for path in root.rglob("*")
        if path.is_file() and "runs" not in path.parts
    }
    assert files - listed <= {"scenarios/references/course.json", "notes.txt", "tests/own.py"}
    assert "\nleft as they are: notes.txt, tests/own.py\n" in made.stdout
    assert "__pycache__" not in str(files)
    return root


def test_the_commands_of_the_ci_workflow_pass(project):
    commands = re.findall(r"- run: (.*)", (project / ".github/workflows/ci.yml").read_text())
    assert commands[0] == "pip install -r requirements.txt"
    assert len(commands) == 3
    regressed, tested = (run(*shlex.split(command), cwd=project) for command in commands[1:])
    assert regressed.returncode == 0, regressed.stdout + regressed.stderr
    assert "1 scenario, all passed" in regressed.stdout
    assert tested.returncode == 0, tested.stdout + tested.stderr
    assert "4 passed" in tested.stdout
    assert (project / "junit.xml").is_file()


def test_a_changed_controller_fails_the_regression(project, tmp_path):
    own = tmp_path / "copy"
    for folder in ("scenarios", "controllers", "fmus"):
        shutil.copytree(project / folder, own / folder)
    source = own / "controllers/speed_keeper.py"
    text = source.read_text()
    source.write_text(text.replace("self.course_P * error", "0.5 * self.course_P * error"))
    assert source.read_text() != text
    done = run("cosim", "regress", cwd=own)
    assert done.returncode == 3
    assert "vessel.attitude.yaw leaves its tube at t = " in done.stdout
    assert "changed since the reference was made: controllers/speed_keeper.py\n" in done.stdout


def test_a_run_writes_the_figure_and_the_replay_of_the_readme(project):
    done = run("cosim", "run", "scenarios/course.json", cwd=project)
    assert done.returncode == 0
    assert "course.png, report.html in runs/course" in done.stdout
    replayed = run("cosim", "replay", "runs/course", cwd=project)
    assert (replayed.returncode, replayed.stderr) == (0, "")


@pytest.mark.parametrize(
    ("source", "line"),
    [
        (None, f"fmi-cosim=={__version__}"),
        (
            {"url": "https://host/cosim.git", "vcs_info": {"vcs": "git", "commit_id": "1ab2"}},
            "fmi-cosim @ git+https://host/cosim.git@1ab2",
        ),
        ({"url": "file:///home/me/cosim", "dir_info": {}}, "fmi-cosim @ file:///home/me/cosim"),
        (
            {"url": "file:///home/me/cosim", "dir_info": {"editable": True}},
            "-e file:///home/me/cosim",
        ),
        (
            {"url": "https://host/fmi_cosim.whl", "archive_info": {}},
            "fmi-cosim @ https://host/fmi_cosim.whl",
        ),
    ],
)
def test_the_requirements_name_the_origin_of_cosim(source, line):
    """No package index has this package, so that its version alone could not be installed."""
    assert pip_requirement(source) == line


def test_the_requirements_are_installed_first_and_the_readme_has_the_projects_name(made, project):
    commands = [line.strip() for line in made.stdout.partition("Next:\n")[2].splitlines()]
    assert commands[1] == "pip install -r requirements.txt"
    assert commands[-1] == "python -m pytest"
    named = [
        line
        for line in (project / "requirements.txt").read_text().splitlines()
        if not line.startswith("#")
    ]
    assert named == [pip_requirement(pip_origin()), "pytest"]
    assert (project / "README.md").read_text().startswith("# my controllers\n")


def test_files_are_overwritten_only_with_force(project):
    readme = project / "README.md"
    readme.write_text("mine")
    refused = run("cosim", "init", project, cwd=project)
    assert refused.returncode == 2
    assert f"{readme}: exists; --force overwrites it" in refused.stderr.splitlines()
    assert readme.read_text() == "mine"
