"""Python FMUs contain the modules that they import and stay independent in a shared interpreter."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import pytest
from controller_fmu import ControllerFmu
from fmpy import extract

from cosim.core.errors import InputError
from cosim.export.build import build_to

SOURCE = '''"""Answers with what its helper knows."""

from __future__ import annotations

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

from .parts.helper import answer


class Oracle(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.y = answer()
        return True
'''


def oracle(folder: Path, number: float) -> Path:
    """Sources of the same names with another content each."""
    (folder / "parts").mkdir(parents=True)
    (folder / "oracle.py").write_text(SOURCE)
    (folder / "parts/helper.py").write_text(
        f"from .numbers import NUMBER\n\n\ndef answer():\n    return {number} + NUMBER\n"
    )
    (folder / "parts/numbers.py").write_text("NUMBER = 0.5\n")
    (folder / "parts/unused.py").write_text("raise RuntimeError\n")
    return folder / "oracle.py"


def test_modules_with_equal_names_are_independent(tmp_path: Path) -> None:
    instances = []
    for number in (1.0, 2.0):
        folder = tmp_path / str(number)
        fmu = build_to(oracle(folder, number), None, folder / "oracle.fmu")
        instances.append(ControllerFmu(str(extract(str(fmu), str(folder / "unpacked"))), {}))
    assert [instance.step({})["y"] for instance in instances] == [1.5, 2.5]
    assert [instance.step({})["y"] for instance in instances] == [1.5, 2.5]
    for instance in instances:
        instance.close()


def test_an_fmu_contains_exactly_the_imported_modules(tmp_path: Path) -> None:
    with ZipFile(build_to(oracle(tmp_path, 1.0), None, tmp_path / "oracle.fmu")) as archive:
        names = {name.removeprefix("resources/") for name in archive.namelist()}
    assert {"oracle.py", "parts/helper.py", "parts/numbers.py"} <= names
    assert "parts/unused.py" not in names


def test_a_changed_imported_module_changes_the_guid(tmp_path: Path) -> None:
    guids = set()
    for number in (1.0, 2.0):
        folder = tmp_path / str(number)
        with ZipFile(build_to(oracle(folder, number), None, folder / "oracle.fmu")) as archive:
            guids.add(archive.read("modelDescription.xml").partition(b'guid="')[2][:38])
    assert len(guids) == 2


def test_imports_from_above_the_source_are_rejected(tmp_path: Path) -> None:
    source = oracle(tmp_path / "inner", 1.0)
    (tmp_path / "outer.py").write_text("answer = None\n")
    source.write_text(SOURCE.replace(".parts.helper", "..outer"))
    with pytest.raises(InputError, match=r"outer\.py: is imported, but an FMU can only contain"):
        build_to(source, None, tmp_path / "oracle.fmu")


def test_a_source_with_a_syntax_error_is_rejected(tmp_path: Path) -> None:
    source = tmp_path / "broken.py"
    source.write_text("class Broken(:\n")
    with pytest.raises(InputError, match=r"broken\.py: cannot be exported: invalid syntax"):
        build_to(source, None, tmp_path / "broken.fmu")
