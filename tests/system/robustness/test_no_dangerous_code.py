"""Forbidden code: anything that turns data into a program; and the locked environment fits the
project.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[3]
FOLDERS = [ROOT / name for name in ("cosim", "plant_src", "controllers")]
FILES = sorted(chain.from_iterable(folder.rglob("*.py") for folder in FOLDERS))
MODULES = {"pickle", "cPickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}
CALLS = {"eval", "exec", "os.system", "os.popen", "yaml.load", "yaml.unsafe_load", "torch.load"}
#: frames travel from a worker to its parent, both the same program, through a separate pipe;
#: nothing is read from a file
ALLOWED = {("cosim/report/video.py", "import of pickle")}
LOCK = ROOT / ".ci" / "requirements.txt"


def dangers(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        match node:
            case ast.Import(names=names):
                yield from (
                    f"import of {alias.name}"
                    for alias in names
                    if alias.name.split(".")[0] in MODULES
                )
            case ast.ImportFrom(module=str(module)) if module.split(".")[0] in MODULES:
                yield f"import of {module}"
            case ast.Call(func=function, keywords=keywords):
                if (name := ast.unparse(function)) in CALLS:
                    yield f"call of {name}"
                yield from (
                    f"{keyword.arg}=True"
                    for keyword in keywords
                    if keyword.arg in ("shell", "allow_pickle")
                    and ast.unparse(keyword.value) != "False"
                )


def test_no_data_is_run():
    found = set()
    for path in FILES:
        name = path.relative_to(ROOT).as_posix()
        found |= {(name, danger) for danger in dangers(ast.parse(path.read_bytes()))}
    assert len(FILES) > 100
    assert found <= ALLOWED


def test_the_search_finds_them():
    text = (
        "import pickle\nfrom marshal import loads\neval('1')\nos.system('x')\nrun('x', "
        "shell=True)\nnp.load(f, allow_pickle=x)"
    )
    assert len(list(dangers(ast.parse(text)))) == 6


def test_the_linter_looks_for_them_too():
    lint = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["ruff"]["lint"]
    assert "S" in lint["select"]
    ignored = [*lint["ignore"], *chain(*lint.get("per-file-ignores", {}).values())]
    assert not {rule for rule in ignored if re.match(r"S30|S602|S604|S605|S$", rule)}


@pytest.mark.skipif(not LOCK.exists(), reason="no checkout")
def test_the_locked_environment_is_what_the_project_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    needs = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    lines = [line for line in LOCK.read_text().splitlines() if not line.startswith("#")]
    assert all(
        re.fullmatch(r"[a-z0-9.-]+==[\w.]+ --hash=sha256:[0-9a-f]{64}", line) for line in lines
    )
    locked = dict(line.split(" ")[0].split("==") for line in lines)
    here = {"python_version": "3.11", "sys_platform": "linux", "platform_machine": "x86_64"}
    for need in map(Requirement, needs):
        if need.name != project["name"] and (need.marker is None or need.marker.evaluate(here)):
            assert need.specifier.contains(locked[need.name.lower().replace("_", "-")]), need
