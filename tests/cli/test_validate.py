"""`cosim validate` in a real process."""

import json
import subprocess
import sys
from zipfile import ZipFile

import pytest
from cosim_command import run_cosim

from cosim.components.fmi.preflight.validation import validate_fmu as examine
from cosim.core import resources

FMUS = sorted(resources.root().glob("fmus/**/*.fmu"))


def validate(*arguments, cwd=None):
    return run_cosim("validate", *arguments, cwd=cwd)


@pytest.fixture
def bad(probes, tmp_path):
    """Path of an FMU with one error and one warning."""
    changes = {b'<Real start="0"': b'<Real start="NaN"', b'stopTime="2"': b'stopTime="0"'}
    path = tmp_path / "bad.fmu"
    with ZipFile(probes[2]) as source, ZipFile(path, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            for old, new in changes.items() if name.endswith(".xml") else ():
                content = content.replace(old, new)
            target.writestr(name, content)
    return path


@pytest.mark.parametrize("path", FMUS, ids=lambda path: str(path.relative_to(resources.root())))
def test_shipped_fmus_have_no_findings(path):
    assert list(map(str, examine(path))) == []


def test_the_exit_code_is_0_without_findings(probes):
    done = validate(probes[2], probes[3])
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == [f"{probes[2]}: no findings", f"{probes[3]}: no findings"]


def test_each_finding_is_a_line_and_the_exit_code_is_2(bad, probes):
    done = validate(probes[2], bad)
    assert (done.returncode, done.stderr) == (2, "")
    good, first, second = done.stdout.splitlines()
    assert good.endswith("no findings")
    assert first.startswith(
        f'{bad}: error: modelDescription.xml:13: variable "u": found start value NaN, expected a '
        "finite"
    )
    assert first.endswith("[start.finite, FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.5]")
    assert second.startswith(
        f"{bad}: warning: modelDescription.xml:11: found stopTime 0, expected more than the "
        "startTime 0"
    )


def test_json_has_the_same_findings(bad):
    done = validate(bad, "--json")
    assert done.returncode == 2
    error, warning = json.loads(done.stdout)
    assert (error["file"], error["severity"], error["rule"]) == (str(bad), "error", "start.finite")
    assert (warning["severity"], warning["member"], warning["line"]) == (
        "warning",
        "modelDescription.xml",
        11,
    )
    assert json.loads(validate(FMUS[0], "--json").stdout) == []


def test_missing_files_and_folders_are_findings(tmp_path):
    done = validate("missing.fmu", tmp_path, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "")
    assert 'missing.fmu: error: FMU "missing.fmu" does not exist' in done.stdout
    assert "is a folder, expected a regular file" in done.stdout


WATCHED = """
import sys
from cosim.cli import main

def watch(event, arguments):
    if event == "ctypes.dlopen" and "probe" in str(arguments):
        print("a library was loaded")

sys.addaudithook(watch)
main(sys.argv[1:])
"""


def watched(*arguments):
    command = [sys.executable, "-c", WATCHED, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("command", ["validate", "simulate", "info"])
def test_the_library_of_an_invalid_fmu_is_not_loaded(command, bad):
    done = watched(command, bad)
    assert done.returncode == 2
    assert "found start value NaN" in done.stdout + done.stderr
    assert "a library was loaded" not in done.stdout


def test_validate_does_not_load_the_library_of_a_valid_fmu(probes):
    assert "a library was loaded" in watched("simulate", probes[2]).stdout
    assert "a library was loaded" not in watched("validate", probes[2]).stdout


def test_help_and_usage_errors():
    assert validate().returncode == 2
    assert "without running them" in validate("--help").stdout
