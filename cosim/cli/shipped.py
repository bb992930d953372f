"""Lists of what cosim ships.

Scenarios, sweeps, vehicle models, controllers, roles of controllers and KPIs.
"""

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
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


def _read_entry(path: Path) -> Entry:
    """Return the entry of a JSON file, with its "description"."""
    content = parse_object(path.read_text(encoding="utf-8"))
    return Entry(path.stem, content.get("description", ""), str(path))


def _list_documents(pattern: str) -> Iterator[Entry]:
    """Return the entries of the JSON files that match a pattern."""
    return map(_read_entry, sorted(resources.root().glob(pattern)))


def _list_models() -> Iterator[Entry]:
    """Yield the vehicle files, and the equations whose folders have a README file."""
    from ..export.fmu_sources import find_sources

    for source in find_sources(resources.root()):
        readme = source.path.parent / "README.md"
        if source.kind.name == "vehicle file":
            yield _read_entry(source.path)
        elif source.kind.name == "equations" and readme.is_file():
            title = readme.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")
            yield Entry(source.name, title, str(readme))


def shipped_fmus() -> dict[str, Path]:
    """Return the shipped FMUs by name; of those with the same name the one for FMI 2.0."""
    found: dict[str, Path] = {}
    for folder in ("fmus/fmi3", "fmus/c", "fmus/python", "fmus"):
        found |= {path.stem: path for path in sorted((resources.root() / folder).glob("*.fmu"))}
    return found


def _list_controllers() -> Iterator[Entry]:
    """Yield the FMUs that are exported from `controllers/`, with the descriptions in them."""
    from ..components.fmi import FmuFile
    from ..export.fmu_sources import find_sources

    folder, files = resources.root() / "controllers", shipped_fmus()
    names = {
        source.name for source in find_sources(resources.root()) if folder in source.path.parents
    }
    for name in sorted(names & files.keys()):
        yield Entry(name, FmuFile(files[name]).description.description, str(files[name]))


def _list_kpis() -> Iterator[Entry]:
    """Yield the KPI functions in the files from which shipped scenarios name KPIs.

    The descriptions are the first lines of their docstrings.
    """
    from ..scenario.function_definitions import function_definitions

    for name, path in sorted(_kpi_files().items()):
        for node in function_definitions(path).values():
            returned = ast.unparse(node.returns) if node.returns else ""
            if returned in _KPI_TYPES and not node.name.startswith("_"):
                text = (ast.get_docstring(node) or "").partition("\n")[0]
                arguments = ast.unparse(node.args).partition(", ")[2]  # without the result
                yield Entry(f"{name}:{node.name}", text, str(path), arguments.replace("'", '"'))


def _kpi_files() -> dict[str, Path]:
    """Return the files of KPI functions.

    The keys are modules, or paths relative to the folder of shipped files.
    """
    root = resources.root().resolve()
    files = {name: resources.package_folder() / file for name, file in _KPI_MODULES.items()}
    for scenario in (root / "scenarios").glob("*.json"):
        kpis = parse_object(scenario.read_text(encoding="utf-8")).get("kpis", [])
        if not isinstance(kpis, list):  # a scenario that extends another may change single KPIs
            continue
        for kpi in kpis:
            path = (scenario.parent / kpi["python"].rpartition(":")[0]).resolve()
            if path.suffix == ".py":
                files[path.relative_to(root).as_posix()] = path
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

#: patterns of names by the heading of a group; the first matching pattern counts, "*" is the group
#: of all others
SCENARIO_GROUPS: Mapping[str, tuple[str, ...]] = {
    "demos of the paper": ("demo1_box", "demo2_sweep", "demo3_inverse_kinematics", "vtol_*"),
    "demo 1 in other surroundings": ("demo1_waves", "demo1_wind", "demo1_current", "harbour"),
    "landings in waves and on other vessels": (
        "landing_waves",
        "landing_on_otter",
        "landing_on_helping_vessel",
    ),
    "landings on measurements alone": ("*_on_sensors",),
    "faults": ("fault_*",),
    "vessels": ("station_keeping", "path_in_current", "otter_*", "vehicle_library"),
    "other vehicles and fleets": ("crazyflie_*", "survey_*", "rov_*", "fleet_*"),
    "connections of FMUs": ("free_flight", "mapped_*"),
    "timing runs of the paper": ("performance_*",),
    "replica of the published simulator": ("*_replica",),
    "others": ("*",),
}


def group_scenarios(entries: Iterable[Entry]) -> dict[str, list[Entry]]:
    """Return the scenarios by the headings of their groups; empty groups are left out."""
    found: dict[str, list[Entry]] = {heading: [] for heading in SCENARIO_GROUPS}
    for entry in entries:
        for heading, patterns in SCENARIO_GROUPS.items():
            if any(fnmatchcase(entry.name, pattern) for pattern in patterns):
                found[heading].append(entry)
                break
    return {heading: group for heading, group in found.items() if group}
