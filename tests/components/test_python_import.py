"""Files of a folder import each other as the files of a script do, and folders with modules of
equal names do not mix.
"""

from pathlib import Path

import pytest

from cosim.components.python_import import load_object, package_files, read_with_relative_imports
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
