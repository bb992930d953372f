"""Wording rules that a program can check: docstrings name a thing or say what a function does."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OPENINGS = ("What", "Whether", "When", "How", "Where", "Of", "Who", "Which", "That", "As")


def docstrings(path):
    """Yield the first lines of the docstrings of a file."""
    waiting = [ast.parse(path.read_text())]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield (ast.get_docstring(node) or "").partition("\n")[0]
        waiting += [
            child
            for child in ast.iter_child_nodes(node)
            if isinstance(child, ast.stmt | ast.excepthandler)
        ]


@pytest.mark.parametrize("package", ["cosim", "plant_src", "controllers", "tests"])
def test_no_docstring_opens_with_a_question_word(package):
    files = [path for path in sorted((ROOT / package).rglob("*.py")) if "_bundle" not in path.parts]
    assert files
    opened = [f"{path.relative_to(ROOT)}: {line}" for path in files for line in docstrings(path)]
    assert [line for line in opened if line.split(": ", 1)[1].split(" ")[0] in OPENINGS] == []
