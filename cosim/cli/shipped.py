"""Lists of what cosim ships: scenarios, sweeps, vehicle models, roles of controllers and KPIs."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from ..core import resources
from ..core.json_values import parse_object

#: files whose public functions are KPIs
_KPI_FILES = ("cosim/kpis.py", "plant_src/kpis.py", "plant_src/manoeuvres.py")


@dataclass(frozen=True)
class Entry:
    """Shipped item.

    Attributes:
        name: name by which commands and scenarios refer to it.
        description: one line.
        file: file that defines it; that of a model describes it.
    """

    name: str
    description: str
    file: str


def _list_documents(pattern: str) -> Iterator[Entry]:
    """Yield the JSON files that match a pattern, with their "description"."""
    for path in sorted(resources.root().glob(pattern)):
        yield Entry(path.stem, parse_object(path.read_text(encoding="utf-8")).get("description", ""), str(path))


def _list_models() -> Iterator[Entry]:
    """Yield the vehicles of the plant, with the titles of their README files."""
    for path in sorted(resources.root().glob("plant_src/vehicles/*/README.md")):
        yield Entry(path.parent.name, path.read_text(encoding="utf-8").partition("\n")[0].lstrip("# "), str(path))


def _list_kpis() -> Iterator[Entry]:
    """Yield the public functions of the KPI files, with the first sentences of their docstrings."""
    for file in _KPI_FILES:
        in_package = file.startswith("cosim/")
        path = (resources.package_folder().parent if in_package else resources.root()) / file
        module = file.removesuffix(".py").replace("/", ".")
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                text = (ast.get_docstring(node) or "").partition("\n")[0]
                yield Entry(f"{module if in_package else file}:{node.name}", text, str(path))


#: function that yields the entries of each kind
CATALOGUE: Mapping[str, Callable[[], Iterator[Entry]]] = {
    "scenarios": lambda: _list_documents("scenarios/*.json"),
    "sweeps": lambda: _list_documents("scenarios/sweeps/*.json"),
    "models": _list_models,
    "roles": lambda: _list_documents("scenarios/roles/*.json"),
    "kpis": _list_kpis,
}
