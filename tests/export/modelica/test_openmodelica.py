"""Export by OpenModelica: the script for omc, and errors. A shell script replaces omc; OpenModelica
itself is not tested.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from cosim.core.errors import InputError
from cosim.export.modelica.frontend.openmodelica import export_with_omc

MODEL = "model M\n  output Real x;\nequation\n  der(x) = 1;\nend M;\n"


@pytest.fixture
def omc(tmp_path, monkeypatch):
    """Return a function that puts a shell script with the given commands on PATH under the name
    omc.
    """

    def install(commands: str) -> Path:
        script = tmp_path / "bin" / "omc"
        script.parent.mkdir()
        script.write_text(f"#!/bin/sh\n{commands}\n")
        script.chmod(0o755)
        monkeypatch.setenv("PATH", str(script.parent), prepend=":")
        return tmp_path / "script.mos"

    return install


def test_the_command_loads_packages_and_file_and_builds_a_co_simulation_fmu(
    omc, write_model, tmp_path
):
    path = write_model(MODEL)
    (tmp_path / "Library").mkdir()
    (tmp_path / "Library" / "package.mo").write_text("package Library\nend Library;\n")
    script = omc(f'cp "$1" "{tmp_path}/script.mos"; echo archive > M.fmu')
    export_with_omc(path, tmp_path / "fmus" / "m.fmu")
    assert script.read_text().splitlines() == [
        f'loadFile("{tmp_path}/Library/package.mo");',
        f'loadFile("{path}");',
        'buildModelFMU(M, version="2.0", fmuType="cs", platforms={"static"});',
        "print(getErrorString());",
    ]
    assert (tmp_path / "fmus" / "m.fmu").read_text() == "archive\n"


def test_a_member_of_a_package_is_loaded_with_its_package(omc, tmp_path):
    (tmp_path / "Library").mkdir()
    (tmp_path / "Library" / "package.mo").write_text("package Library\nend Library;\n")
    member = tmp_path / "Library" / "M.mo"
    member.write_text(f"within Library;\n{MODEL}")
    script = omc(f'cp "$1" "{tmp_path}/script.mos"; echo archive > Library.M.fmu')
    export_with_omc(member, tmp_path / "m.fmu")
    lines = script.read_text().splitlines()
    assert lines[0] == f'loadFile("{tmp_path}/Library/package.mo");'
    assert lines[1].startswith("buildModelFMU(Library.M, ")


def test_errors_are_reported_with_file_and_line(omc, write_model, tmp_path):
    path = write_model(MODEL)
    omc(
        f'echo "true"; echo "[{path}:4:3-4:13:writable] Error: Variable y not found in scope M."; '
        'echo "Error: no code"; exit 1'
    )
    with pytest.raises(InputError) as refused:
        export_with_omc(path, tmp_path / "m.fmu")
    assert str(refused.value).splitlines() == [
        f"{path}:4: Variable y not found in scope M.",
        f"{path}: no code",
    ]
    assert not (tmp_path / "m.fmu").exists()


def test_it_is_an_error_if_omc_creates_no_fmu_and_prints_nothing(omc, write_model, tmp_path):
    path = write_model(MODEL)
    omc("exit 0")
    with pytest.raises(InputError, match="OpenModelica has created no FMU: it printed nothing"):
        export_with_omc(path, tmp_path / "m.fmu")


def test_without_omc_the_error_says_what_is_missing(write_model, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match='there is no "omc" on PATH'):
        export_with_omc(write_model(MODEL), tmp_path / "m.fmu")


def test_a_missing_file_is_refused(omc, tmp_path):
    omc("exit 0")
    with pytest.raises(InputError, match="no such Modelica file"):
        export_with_omc(tmp_path / "None.mo", tmp_path / "m.fmu")
