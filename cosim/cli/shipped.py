"""Lists of what cosim ships.

Scenarios, sweeps, vehicle models, controllers, roles of controllers and KPIs.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..core import resources
from ..core.json_values import parse_object

#: modules of the KPIs of any signal and of control loops, with their files in the package
_KPI_MODULES = {"cosim.kpis": "kpis.py", "cosim.analysis.kpis": "analysis/kpis.py"}
#: types of the values that KPI functions return
_KPI_TYPES = ("dict[str, Number]", "dict[str, float]")


@dataclass(frozen=True)
class Entry:
    """Shipped item.

    Attributes:
        name: name by which commands and scenarios refer to it.
        description: one line.
        file: file that defines it; that of a model describes it.
        arguments: of a KPI: names, types and defaults of the arguments that a scenario gives.
    """

    name: str
    description: str
    file: str
    arguments: str = ""


def _list_documents(pattern: str) -> Iterator[Entry]:
    """Yield the JSON files that match a pattern, with their "description"."""
    for path in sorted(resources.root().glob(pattern)):
        yield Entry(
            path.stem,
            parse_object(path.read_text(encoding="utf-8")).get("description", ""),
            str(path),
        )


def _list_models() -> Iterator[Entry]:
    """Yield the vehicle files with their "description", and the equations with a README file with its title."""
    from ..export.sources import find_sources

    for source in find_sources(resources.root()):
        readme = source.path.parent / "README.md"
        if source.kind.name == "vehicle file":
            yield Entry(
                source.name,
                parse_object(source.path.read_text(encoding="utf-8"))["description"],
                str(source.path),
            )
        elif source.kind.name == "equations" and readme.is_file():
            yield Entry(
                source.name,
                readme.read_text(encoding="utf-8").partition("\n")[0].lstrip("# "),
                str(readme),
            )


def shipped_fmus() -> dict[str, Path]:
    """Return the shipped FMUs by name; of those with the same name the one for FMI 2.0."""
    folders = ("fmus", "fmus/python", "fmus/c", "fmus/fmi3")
    files = [
        path for folder in folders for path in sorted((resources.root() / folder).glob("*.fmu"))
    ]
    return {path.stem: path for path in reversed(files)}


def _list_controllers() -> Iterator[Entry]:
    """Yield the FMUs that are exported from `controllers/`, with the descriptions in them."""
    from ..components.fmi import FmuFile
    from ..export.sources import find_sources

    folder, files = resources.root() / "controllers", shipped_fmus()
    names = {
        source.name for source in find_sources(resources.root()) if folder in source.path.parents
    }
    for name in sorted(names & files.keys()):
        yield Entry(name, FmuFile(files[name]).description.description, str(files[name]))


def _list_kpis() -> Iterator[Entry]:
    """Yield the KPI functions in the files from which shipped scenarios name KPIs, with the first lines of their docstrings."""
    from ..scenario.function_definitions import function_definitions

    for name, path in sorted(_kpi_files().items()):
        for node in function_definitions(path).values():
            if (
                node.returns
                and ast.unparse(node.returns) in _KPI_TYPES
                and not node.name.startswith("_")
            ):
                text = (ast.get_docstring(node) or "").partition("\n")[0]
                arguments = ast.unparse(node.args).partition(", ")[2]  # without the result
                yield Entry(f"{name}:{node.name}", text, str(path), arguments.replace("'", '"'))


def _kpi_files() -> dict[str, Path]:
    """Return the files of KPI functions by their names relative to the folder of shipped files, or as modules."""
    folder, files = (
        resources.root() / "scenarios",
        {name: resources.package_folder() / file for name, file in _KPI_MODULES.items()},
    )
    for scenario in folder.glob("*.json"):
        kpis = parse_object(scenario.read_text(encoding="utf-8")).get("kpis", [])
        for kpi in (
            kpis if isinstance(kpis, list) else ()
        ):  # a scenario that extends another may change single KPIs
            path = (folder / kpi["python"].rpartition(":")[0]).resolve()
            if path.suffix == ".py":
                files[path.relative_to(resources.root().resolve()).as_posix()] = path
    return files


#: function that yields the entries of each kind
CATALOGUE: Mapping[str, Callable[[], Iterator[Entry]]] = {
    "scenarios": lambda: _list_documents("scenarios/*.json"),
    "sweeps": lambda: _list_documents("scenarios/sweeps/*.json"),
    "models": _list_models,
    "controllers": _list_controllers,
    "roles": lambda: _list_documents("scenarios/roles/*.json"),
    "kpis": _list_kpis,
}
