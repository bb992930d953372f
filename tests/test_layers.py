"""Layers: imports only point to lower layers, and light commands import no heavy packages."""

import ast
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

#: folders and modules of `cosim`, the lowest layer first
LAYERS = (
    "core",
    "process",
    "results",
    "kpis",
    "components",
    "engine",
    "export",
    "scenario",
    "report",
    "api",
    "analysis",
    "studies",
    "cli",
    "__main__",
    "pytest_plugin",
)

#: folders and modules of `plant_src`, the lowest layer first
PLANT_LAYERS = (
    "json_reader",
    "variable_views",
    "recorded_motion",
    "vehicles",
    "catalogue",
    "placement",
    "vehicle_files",
    "physics",
    "environment",
    "schemas",
    "world_settings",
    "kpis",
    "manoeuvres",
    "scene",
    "figures",
    "sensors",
    "world",
    "world_fmu",
    "replica",
)


def module_name(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def sources(package):
    """Return the Python files and stubs of a package, without those that are package data."""
    return sorted(
        path
        for path in (ROOT / package).rglob("*.py*")
        if not {"_bundle", "templates", "__pycache__"} & set(path.parts)
    )


@cache
def syntax_tree(path):
    return ast.parse(path.read_text())


MODULES = {
    module_name(path): path
    for package in ("cosim", "plant_src")
    for path in sources(package)
    if path.suffix in (".py", ".pyi")
}


def runtime_nodes(tree):
    """Yield all nodes of a syntax tree, except those below `if TYPE_CHECKING`."""
    waiting = [tree]
    while waiting:
        for node in ast.iter_child_nodes(waiting.pop()):
            if not (isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"):
                waiting.append(node)
                yield node


def imported(name):
    """Yield the modules that a module imports, also inside functions, or names in a string such as
    "cosim.kpis:rms".
    """
    path = MODULES[name]
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in runtime_nodes(syntax_tree(path)):
        if isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            for alias in node.names:
                yield f"{module}.{alias.name}" if f"{module}.{alias.name}" in MODULES else module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif (
            isinstance(node, ast.Constant)
            and "." in (module := str(node.value).partition(":")[0])
            and module in MODULES
        ):
            yield module


@cache
def import_graph():
    """Return the modules that each module imports."""
    return {name: set(imported(name)) & MODULES.keys() - {name} for name in MODULES}


def layer(name):
    return name.split(".")[1]


@pytest.mark.parametrize(("package", "layers"), [("cosim", LAYERS), ("plant_src", PLANT_LAYERS)])
def test_imports_between_folders_point_down(package, layers):
    upward = [
        f"{name} imports {other}"
        for name, others in import_graph().items()
        for other in sorted(others)
        if name.startswith(f"{package}.")
        and other.startswith(f"{package}.")
        and layer(name) != layer(other)
        if layers.index(layer(name)) < layers.index(layer(other))
    ]
    assert upward == []


def test_no_files_import_each_other_in_a_cycle():
    graph = {name: others for name, others in import_graph().items() if name != "cosim"}
    try:
        list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_cosim_knows_no_vehicle_and_no_bullet():
    for path in sources("cosim"):
        assert not {"pybullet", "plant_src"} & imported_packages(path), path


@cache
def imported_packages(path):
    """Return the names of the packages that a file imports, except by relative imports."""
    nodes = [
        node
        for node in ast.walk(syntax_tree(path))
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    plain = {
        alias.name.split(".")[0]
        for node in nodes
        if isinstance(node, ast.Import)
        for alias in node.names
    }
    return plain | {
        (node.module or "").split(".")[0]
        for node in nodes
        if isinstance(node, ast.ImportFrom) and not node.level
    }


def test_only_the_build_names_files_of_the_plant():
    named = [path for path in sources("cosim") if "plant_src" in path.read_text()]
    assert {module_name(path) for path in named} <= {
        "cosim.export.fmu_sources",
        "cosim.export.plant",
    }


def test_only_fmi_components_and_export_use_fmpy():
    users = {
        layer(module_name(path)) for path in sources("cosim") if "fmpy" in imported_packages(path)
    }
    assert users <= {"components", "export"}


def test_only_cli_and_report_print():
    for path in sources("cosim"):
        if "print(" not in path.read_text():
            continue
        calls = [n for n in ast.walk(syntax_tree(path)) if isinstance(n, ast.Call)]
        if any(getattr(call.func, "id", "") == "print" for call in calls):
            assert layer(module_name(path)) in ("cli", "report"), path


HEAVY = (
    "numpy",
    "scipy",
    "matplotlib",
    "fmpy",
    "pybullet",
    "pydantic",
    "rich",
    "casadi",
    "rumoca",
    "jinja2",
)


@pytest.mark.parametrize(
    "statement",
    ["import cosim", "from cosim.cli import cli; cli(['--help'], standalone_mode=False)"],
)
def test_importing_and_helping_load_nothing_heavy(statement):
    code = (
        f"import sys; {statement}; print(*(m for m in {HEAVY!r} if m in sys.modules), "
        "file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.split() == []


def test_a_world_loads_neither_scipy_nor_matplotlib():
    """A run imports the world in each new process."""
    code = (
        "import sys, plant_src.world; print(*({'scipy', 'matplotlib', 'casadi', 'trimesh'} & "
        "set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.split() == []
