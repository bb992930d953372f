"""Lines of at most 100 columns in every file that people read, whatever its language."""

import json
import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LONGEST = 100
FOLDERS = (".ci", ".github", "cosim", "plant_src", "controllers", "scenarios", "docs", "tests")
KINDS = (".py", ".pyi", ".c", ".h", ".mo", ".js", ".css", ".html", ".sh", ".yml", ".yaml", ".toml")
NAMES = ("run", "requirements.txt")
#: folders of files that a program writes, and of libraries of others
WRITTEN_BY_PROGRAMS = {"_bundle", "bundle", "node_modules", "__pycache__"}
#: addresses and hashes have no place to break, and directives to a checker stand in one line
WITHOUT_BREAK = re.compile(r"\S*https?://\S+|--hash=\S+|\s+# (noqa|type: ignore)\b.*")


def sources_of_fmus():
    """Return the files whose every change means to build FMUs again."""
    manifest = json.loads((ROOT / "fmus/manifest.json").read_text())
    return {ROOT / source for entry in manifest.values() for source in entry["sources"]}


def read_by_people(folder):
    """Yield the files of a folder that people read."""
    for parent, folders, names in os.walk(folder):
        folders[:] = sorted(set(folders) - WRITTEN_BY_PROGRAMS)
        for name in sorted(names):
            if name.endswith(KINDS) or name in NAMES:
                yield Path(parent, name)


def long_lines(path):
    """Return the numbers of the lines that are longer than they may be."""
    lines = path.read_text(encoding="utf-8").splitlines()
    return [
        number
        for number, line in enumerate(lines, 1)
        if len(WITHOUT_BREAK.sub("", line).rstrip()) > LONGEST
    ]


def test_files_of_the_root_have_no_long_lines():
    files = [path for path in ROOT.iterdir() if path.is_file() and path.name.endswith(KINDS)]
    assert ROOT / "pyproject.toml" in files
    assert [path.name for path in files if long_lines(path)] == []


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_line_is_long(folder):
    exempt = sources_of_fmus()
    files = [path for path in read_by_people(ROOT / folder) if path not in exempt]
    assert files
    found = {}
    for path in files:
        if numbers := long_lines(path):
            found[path.relative_to(ROOT).as_posix()] = numbers
    assert found == {}


@pytest.mark.parametrize(
    ("line", "is_long"),
    [
        ("x" * 101, True),
        ("x" * 100, False),
        ("é" * 100, False),
        ("x" * 90 + "  # noqa: S603", False),
    ],
)
def test_a_long_line_is_found(tmp_path, line, is_long):
    path = tmp_path / "file.py"
    path.write_text(f"short\n{line}\n", encoding="utf-8")
    assert long_lines(path) == ([2] if is_long else [])
