"""Wording rules that a program can check: docstrings name a thing or say what a function does."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OPENINGS = ("What", "Whether", "When", "How", "Where", "Of", "Who", "Which", "That", "As")
FILES = sorted(
    path
    for package in ("cosim", "plant_src", "controllers", "tests")
    for path in (ROOT / package).rglob("*.py")
    if "_bundle" not in path.parts
)


def docstrings(path):
    """Return the first lines of the docstrings of a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield (ast.get_docstring(node) or "").partition("\n")[0]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_no_docstring_opens_with_a_question_word(path):
    assert [line for line in docstrings(path) if line.split(" ")[0] in OPENINGS] == []
