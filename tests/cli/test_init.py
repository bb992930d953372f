"""`cosim init`: the project that it makes passes at once, and notices when its controller changes."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest


def run(*command, cwd):
    """A command of this environment, as from a user's shell."""
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}", "PYTEST_ADDOPTS": ""}
    return subprocess.run([*map(str, command)], cwd=cwd, capture_output=True, text=True, check=False, env=environment)


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    made = run("cosim", "init", "my controllers", cwd=folder)
    assert made.returncode == 0, made.stderr
    listed = {Path(line).relative_to("my controllers").as_posix() for line in made.stdout.splitlines() if line.startswith("my ")}
    root = folder / "my controllers"
    files = {path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_file() and "runs" not in path.parts}
    assert files - listed <= {"scenarios/references/course.json"} and "__pycache__" not in str(files)
    return root


def test_the_commands_of_its_workflow_pass(project):
    commands = re.findall(r"- run: (.*)", (project / ".github/workflows/ci.yml").read_text())
    assert commands[0] == "pip install -r requirements.txt" and len(commands) == 3
    regressed, tested = (run(*shlex.split(command), cwd=project) for command in commands[1:])
    assert regressed.returncode == 0 and "1 scenarios, all well" in regressed.stdout, regressed.stdout + regressed.stderr
    assert tested.returncode == 0 and "4 passed" in tested.stdout, tested.stdout + tested.stderr
    assert (project / "junit.xml").is_file()


def test_a_changed_controller_is_noticed(project, tmp_path):
    own = tmp_path / "copy"
    for file in ("scenarios/course.json", "scenarios/references/course.csv", "controllers/speed_keeper.py", "fmus/strider.fmu"):
        (own / file).parent.mkdir(parents=True, exist_ok=True)
        (own / file).write_bytes((project / file).read_bytes())
    source = own / "controllers/speed_keeper.py"
    text = source.read_text()
    source.write_text(text.replace("self.course_P * error", "0.5 * self.course_P * error"))
    assert source.read_text() != text
    done = run("cosim", "regress", cwd=own)
    assert done.returncode == 3
    assert "vessel.attitude.yaw leaves its tube at t = " in done.stdout


def test_the_version_stands_in_the_requirements_and_the_name_in_the_readme(project):
    from cosim import __version__

    assert (project / "requirements.txt").read_text() == f"fmi-cosim=={__version__}\npytest\n"
    assert (project / "README.md").read_text().startswith("# my controllers\n")


def test_files_are_overwritten_only_by_force(project):
    readme = project / "README.md"
    readme.write_text("mine")
    refused = run("cosim", "init", project, cwd=project)
    assert refused.returncode == 2
    assert f"{readme}: exists; --force overwrites it" in refused.stderr.splitlines()
    assert readme.read_text() == "mine"
