"""`cosim doctor` on incomplete machines, simulated by search paths, metadata and PATH."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from importlib import metadata
from importlib.util import find_spec

import pytest
from cosim_command import run_cosim

from cosim.engine import native_available as native_available

METADATA = """Metadata-Version: 2.1
Name: fmi-cosim
Version: 0.2.0
Provides-Extra: wings
Requires-Dist: {required}
Requires-Dist: no-such-feathers>=2; extra == "wings"
"""


def doctor(*options, **environment):
    """Run the command; PYTHONPATH needs a new interpreter."""
    if "PYTHONPATH" not in environment:
        return run_cosim("doctor", *options, cwd="/", env=environment)
    command = [sys.executable, "-m", "cosim", "doctor", *options]
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        cwd="/",
        env={**os.environ, **environment},
    )


def findings(**environment):
    """Return the exit code and the findings by name."""
    done = doctor("--json", **environment)
    return done.returncode, {finding["name"]: finding for finding in json.loads(done.stdout)}


@pytest.fixture
def requiring(tmp_path):
    """Function that returns an environment in which the distribution has other requirements."""

    def make(required):
        folder = tmp_path / "fmi_cosim-0.2.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(METADATA.format(required=required))
        return {"PYTHONPATH": str(tmp_path)}

    return make


def test_this_environment_has_no_broken_parts():
    code, found = findings()
    assert code == 0
    assert found["Python"]["found"].startswith(platform.python_version())
    assert found["numpy"]["found"] == metadata.version("numpy")
    assert found["executor"]["found"].startswith("native" if native_available() else "Python only")
    assert str(os.cpu_count()) in found["processors"]["found"]


def test_text_and_json_agree():
    text = doctor().stdout
    assert all(finding["found"] in text for finding in findings()[1].values())


@pytest.mark.parametrize(
    ("required", "words"),
    [
        ("no-such-package>=1", "not installed"),
        ("numpy>=1000", f"{metadata.version('numpy')}, required is >=1000"),
    ],
)
def test_a_required_package_that_is_missing_or_too_old_is_broken(requiring, required, words):
    environment = requiring(required)
    done = doctor(**environment)
    assert done.returncode == 1
    assert f"BROKEN: {words}" in done.stdout


def test_a_missing_extra_does_not_fail(requiring):
    code, found = findings(**requiring("numpy>=1"))
    assert (code, found["wings"]["state"]) == (0, "missing")
    assert (
        found["wings"]["found"]
        == "no-such-feathers: not installed (pip install 'fmi-cosim[wings]')"
    )


def test_tools_are_looked_for_on_the_path(tmp_path):
    code, found = findings(PATH=str(tmp_path), CC="")
    assert code == 0
    compiler = "ok" if find_spec("ziglang") else "missing"  # a package, not a program on the path
    assert [found[name]["state"] for name in ("C compiler", "bubblewrap")] == [
        compiler,
        "missing",
    ]


def test_a_program_that_does_not_work_is_missing(tmp_path):
    for name, text in {
        "bwrap": "exit 1",
        "cc": "exit 0",
    }.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    _, found = findings(PATH=f"{tmp_path}:/bin", CC="")
    assert found["bubblewrap"]["state"] == "missing"


def test_the_cache_folder_follows_the_environment(tmp_path):
    _, found = findings(XDG_CACHE_HOME=str(tmp_path))
    assert found["cache"]["found"] == str(tmp_path / "cosim")


def test_restrictions_of_a_sandbox_are_reported():
    """The restrictions are probed in a process inside the sandbox."""
    imports = "from cosim.process.sandbox import *; from cosim.cli import main"
    enter = "enter_sandbox(SandboxSettings(readable=interpreter_folders(), open_files=77))"
    words = [sys.executable, "-c", f"{imports}; {enter}; main(['doctor', '--json'])"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    found = {finding["name"]: finding["found"] for finding in json.loads(done.stdout)}
    assert found["open files"] == "77"
    assert found["no new privileges"] == "yes"
    assert found["files confined"] == ("yes" if found["Landlock"].startswith("version") else "no")
