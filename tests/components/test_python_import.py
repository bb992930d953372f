"""Files of a folder import each other as the files of a script do, and folders with modules of
equal names do not mix.
"""

import os
import py_compile
from pathlib import Path

import pytest

from cosim.components import python_import
from cosim.components.python_import import load_object, package_files, read_with_relative_imports
from cosim.core import resources
from cosim.core.errors import InputError

MAIN = """\
from __future__ import annotations
import math, helper, parts.wing as w
from helper import (value,
    other)
import parts.wing; last = 1
def answer():
    import helper as h; return h.value
line = __import__("sys")._getframe().f_lineno
"""


def write(folder: Path, value: int) -> Path:
    (folder / "parts").mkdir(parents=True)
    (folder / "main.py").write_text(MAIN)
    (folder / "helper.py").write_text(f"value = other = {value}")
    (folder / "parts/wing.py").write_text("import helper; span = helper.value + 1")
    (folder / "math.py").write_text("raise RuntimeError")
    return folder


def test_each_folder_has_its_own_modules(tmp_path):
    for value in (3, 4):
        module = load_object("main.py:answer", write(tmp_path / str(value), value)).__globals__
        assert module["answer"]() == module["value"] == module["other"] == value
        assert module["w"].span == module["parts"].wing.span == value + 1
        assert module["line"] == 8


def test_only_imports_of_the_folder_are_changed(tmp_path):
    folder = write(tmp_path / "one", 1)
    text = read_with_relative_imports(folder / "main.py", folder)
    assert text.splitlines()[1:4] == [
        "import math; from . import helper; from .parts import wing as w",
        *text.splitlines()[2:4],
    ]
    assert text.count("\n") == MAIN.count("\n")
    assert text.splitlines()[6:] == [
        "    from . import helper as h; return h.value",
        MAIN.splitlines()[7],
    ]


def test_the_files_of_a_run_contain_the_imported_ones(tmp_path):
    folder = write(tmp_path / "one", 1)
    names = {path.relative_to(folder).as_posix() for path in package_files([folder / "main.py"])}
    assert names == {"main.py", "helper.py", "parts/wing.py"}


def test_a_file_of_a_package_is_not_changed(tmp_path):
    folder = write(tmp_path / "one", 1)
    (folder / "__init__.py").touch()
    assert read_with_relative_imports(folder / "main.py", folder) == MAIN
    with pytest.raises(InputError, match=r"No module named 'helper' \(main\.py:2\)"):
        load_object("main.py:answer", folder)


def test_the_shipped_plant_is_the_package_that_users_import():
    from plant_src.placement import read_obstacles

    file = "plant_src/placement.py:read_obstacles"
    assert load_object(file, resources.root()) is read_obstacles
    assert load_object(f"../{file}", resources.root() / "scenarios") is read_obstacles


def test_a_copy_of_the_shipped_plant_is_another_package(tmp_path):
    import plant_src.placement

    (folder := tmp_path / "plant_src").mkdir()
    for name in ("__init__", "placement"):
        (folder / f"{name}.py").write_text("from pathlib import Path\nclass Platform: pass\n")
    copy = load_object("plant_src/placement.py:Platform", tmp_path)
    shipped = load_object("plant_src/placement.py:Platform", resources.root())
    assert shipped is plant_src.placement.Platform is not copy
    assert copy.__module__.startswith("_cosim_")


@pytest.mark.parametrize("is_taken", [False, True])
def test_a_shipped_package_gets_its_name_only_if_that_is_free(tmp_path, monkeypatch, is_taken):
    name = f"shipped_package_{is_taken}".lower()
    for folder in ("shipped", "other"):
        (package := tmp_path / folder / name).mkdir(parents=True)
        for module in ("__init__", "part"):
            (package / f"{module}.py").write_text(f"origin = {folder!r}\n")
    if is_taken:
        monkeypatch.syspath_prepend(str(tmp_path / "other"))
    monkeypatch.setattr(resources, "root", lambda: tmp_path / "shipped")
    part = python_import.import_shipped(f"{name}.part")
    assert part.origin == "shipped"
    assert (part.__name__ == f"{name}.part") is not is_taken


@pytest.mark.parametrize("written", [0.4, 0.8], ids=["older", "newer"])
def test_a_compiled_file_of_a_package_is_used_only_if_it_is_newer(tmp_path, written):
    package = tmp_path / "package"
    package.mkdir()
    (package / "__init__.py").touch()
    file = package / "gain.py"
    for value in (1, 2):
        file.write_text(f"value = {value}")
        os.utime(file, (0, 0.2 * value + 0.1))  # of one second, and of one size
        if value == 1:
            cached = Path(py_compile.compile(file, doraise=True))
            os.utime(cached, (0, written))
    assert load_object("gain.py:value", package) == (2 if written < 0.5 else 1)
