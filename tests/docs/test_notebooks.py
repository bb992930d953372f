"""The notebooks of the documentation run from the first to the last cell."""

import ast
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[2] / "docs/notebooks"


def run_cell(source, names):
    """Execute a cell and return the value of its last expression, as a notebook does."""
    *statements, last = ast.parse(source).body
    if not isinstance(last, ast.Expr):
        statements, last = [*statements, last], None
    exec(compile(ast.Module(statements, []), "cell", "exec"), names)  # noqa: S102 (cells of this repository)
    return eval(compile(ast.Expression(last.value), "cell", "eval"), names) if last else None  # noqa: S307


@pytest.fixture
def run_notebook(tmp_path, monkeypatch):
    """Function that runs a notebook in an empty folder and returns its names and the values of its
    cells.
    """
    nbformat = pytest.importorskip("nbformat")
    monkeypatch.chdir(tmp_path)

    def run(name):
        book, names = (
            nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4),
            {"__name__": "__main__"},
        )
        nbformat.validate(book)
        assert not any(cell.get("outputs") for cell in book.cells)  # results are made by running it
        return names, [
            run_cell(cell.source, names) for cell in book.cells if cell.cell_type == "code"
        ]

    return run


def test_landing(run_notebook):
    names, values = run_notebook("landing")
    assert names["result"].kpis["landing.landed_at_end"]
    usual, fast = values[3].values()
    assert fast > 1.3 * usual
    assert values[4] > 0.05  # m, the gust


def test_own_controller(run_notebook):
    names, values = run_notebook("own_controller")
    assert all(check.passed for check in names["result"].checks)
    assert values[-1] == pytest.approx(1.2, abs=0.05)


@pytest.mark.long
def test_envelope(run_notebook):
    _, values = run_notebook("envelope")
    assert [passed for height, passed in values[-1] if height == 0.3] == [True, True]
    for high in (0.9, 1.2):
        assert sum(passed for height, passed in values[-1] if height == high) == 1
