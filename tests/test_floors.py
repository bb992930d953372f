"""The floors of the house (imports point downwards only) and what may not be imported early."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "cosim"

#: rooms from the ground up; a room imports only from its own floor or from below
FLOORS = [
    {"errors", "resources", "log", "stopwatch", "temporary", "float_mode", "streams", "memento"},
    {"journal", "paths"},
    {"timing", "units", "sandbox", "process_state"},
    {"component", "pacer"},
    {"system", "recording", "contract"},
    {"engine"},
    {"unfinished"},
    {"live_csv", "text_rows"},
    {"simulate", "supervise"},
    {"fmi", "python_component", "table"},
    {"export"},
    {"scenario"},
    {"results"},
    {"kpi", "compare"},
    {"kpis"},
    {"api", "bench", "report"},
    {"sweep", "live"},
    {"cli"},
    {"__main__", "pytest_plugin"},
]
#: export stands aside: only the assembly of `modelica` sources and `cosim build` look into it
ALLOWED = {("scenario", "export"), ("cli", "export")}


def room(path):
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def floor(name):
    return next(i for i, rooms in enumerate(FLOORS) if name in rooms)


def imported_rooms(path):
    """Rooms of cosim that a file imports, at any place in it, except for type checking."""
    package = ["cosim", *path.relative_to(PACKAGE).parent.parts]
    for node in runtime_nodes(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package[: len(package) - node.level + 1]
            parts = [*base, *(node.module or "").split(".")] if node.module else base
            names = [parts] if len(parts) > 1 else [[*parts, alias.name] for alias in node.names]
            yield from (name[1] for name in names)


def runtime_nodes(tree):
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            continue
        yield node
        yield from runtime_nodes(node)


FILES = sorted(path for path in PACKAGE.rglob("*.py") if "_bundle" not in path.parts and path != PACKAGE / "__init__.py")


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_point_downwards(path):
    own = room(path)
    for other in set(imported_rooms(path)) - {own, "__version__"}:
        assert floor(other) < floor(own) or (own, other) in ALLOWED, f"{own} imports {other}"


def test_the_plan_of_the_house_has_every_room():
    plan = (PACKAGE.parent / "CONTRIBUTING.md").read_text()
    assert {name for name in set().union(*FLOORS) - {"__main__"} if f"`{name}`" not in plan} == set()


def test_cosim_knows_no_vehicle_and_no_bullet():
    for path in FILES:
        tree = ast.parse(path.read_text())
        modules = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
        modules |= {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert not {"pybullet", "plant_src"} & {module.split(".")[0] for module in modules}, path


def test_only_the_fmi_room_and_the_exporter_use_fmpy():
    users = {room(path) for path in FILES if "fmpy" in path.read_text() and imports(path, "fmpy")}
    assert users <= {"fmi", "export"}


def imports(path, package):
    nodes = list(ast.walk(ast.parse(path.read_text())))
    plain = any(a.name.split(".")[0] == package for n in nodes if isinstance(n, ast.Import) for a in n.names)
    return plain or any((n.module or "").split(".")[0] == package for n in nodes if isinstance(n, ast.ImportFrom) and not n.level)


def test_only_faces_print():
    for path in FILES:
        calls = [n for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Call)]
        if any(getattr(call.func, "id", "") == "print" for call in calls):
            assert room(path) in ("cli", "report"), path


HEAVY = ("numpy", "scipy", "matplotlib", "fmpy", "pybullet", "pydantic", "rich", "casadi", "rumoca", "jinja2")


@pytest.mark.parametrize("statement", ["import cosim", "from cosim.cli import cli; cli(['--help'], standalone_mode=False)"])
def test_importing_and_helping_load_nothing_heavy(statement):
    code = f"import sys; {statement}; print(*(m for m in {HEAVY!r} if m in sys.modules), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.split() == []
