"""Routes of three values through the code, as tables of (file, function, value).

    python tests/support/value_routes.py

A function is on the route of a value if it receives the value, or an object that holds it at most
two levels deep (attributes, elements, items), and hands it on: it calls a function that receives
it, or returns it. Functions that only read it are not on the route. The values are the path of an
FMU (until the first macro step), the mass in a vehicle file (until the first macro step), and the
name of an output (until the files of the run are written).
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import io
import json
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
PACKAGES = ("cosim", "plant_src")
#: a value is held at most so many levels deep
DEPTH = 2
#: calls of a function that are examined; later ones are like these
MAX_CALLS = 40
#: function that runs the first macro step
FIRST_STEP = "_run_macro_steps"
MASS = 2.1234567

#: a file and the name of a function in it
Function = tuple[str, str]


class Route:
    """Profile function that notes which functions receive and hand on a value."""

    def __init__(self, is_value: Callable[[Any], bool], ends_with_the_first_step: bool):
        self._is_value, self._ends_with_the_first_step = is_value, ends_with_the_first_step
        self._received: dict[Function, str] = {}
        self._handed_on: set[Function] = set()
        self._calls: dict[tuple[Function, str], int] = {}
        self._is_ended = False

    def rows(self) -> list[tuple[str, str, str]]:
        """Return file, function and value of each function on the route, in the order of calls."""
        return [
            (*function, value)
            for function, value in self._received.items()
            if function in self._handed_on
        ]

    def __call__(self, frame: FrameType, event: str, returned: Any) -> None:
        """Note a call or a return; see `sys.setprofile`."""
        if self._is_ended or event not in ("call", "return"):
            return
        function = function_of(frame)
        if function is None:
            return
        if self._ends_with_the_first_step and frame.f_code.co_name == FIRST_STEP:
            self._is_ended = True
            return
        count = self._calls.get((function, event), 0)
        if count >= MAX_CALLS:
            return
        self._calls[function, event] = count + 1
        if event == "call":
            self._note_call(frame, function)
        elif self._holds(returned, DEPTH):
            self._received.setdefault(function, f"returns {describe(returned)}")
            self._handed_on.add(function)

    def _note_call(self, frame: FrameType, function: Function) -> None:
        for name in argument_names(frame):
            argument = frame.f_locals.get(name)
            if self._holds(argument, DEPTH):
                self._received.setdefault(function, f"{name}: {describe(argument)}")
                caller = caller_of(frame)
                if caller and caller != function:
                    self._handed_on.add(caller)
                return

    def _holds(self, value: Any, depth: int) -> bool:
        if self._is_value(value):
            return True
        if depth == 0:
            return False
        return any(self._holds(part, depth - 1) for part in parts_of(value))


def parts_of(value: Any) -> list[Any]:
    """Return elements, items or attributes of a value; none of those of foreign classes."""
    if isinstance(value, np.ndarray):
        return list(value.ravel()[:1000]) if value.dtype.kind == "f" else []
    if isinstance(value, dict):
        return [*value.keys(), *value.values()]
    if isinstance(value, list | tuple | set | frozenset):
        return list(value)
    if not is_of_the_project(type(value)):
        return []
    parts = list(vars(value).values()) if hasattr(value, "__dict__") else []
    for name in getattr(type(value), "__slots__", ()):
        if name in dir(type(value)) and hasattr(value, name):
            parts.append(getattr(value, name))
    return parts


@functools.cache
def is_of_the_project(kind: type) -> bool:
    """Return whether a class is defined in a file of the packages, whatever its module's name."""
    file = getattr(sys.modules.get(kind.__module__), "__file__", None) or ""
    return os.path.relpath(file or "/", ROOT).partition(os.sep)[0] in PACKAGES


def function_of(frame: FrameType) -> Function | None:
    """Return file and function of a frame, None outside of the packages and in comprehensions."""
    code = frame.f_code
    path = os.path.relpath(code.co_filename, ROOT).replace(os.sep, "/")
    if path.partition("/")[0] not in PACKAGES or code.co_name.startswith("<"):
        return None
    return path, code.co_qualname


def caller_of(frame: FrameType) -> Function | None:
    """Return the nearest function of the packages that has called a frame."""
    outer = frame.f_back
    while outer is not None:
        function = function_of(outer)
        if function:
            return function
        outer = outer.f_back
    return None


def argument_names(frame: FrameType) -> tuple[str, ...]:
    """Return the names of all arguments of the function of a frame."""
    code = frame.f_code
    count = code.co_argcount + code.co_kwonlyargcount
    count += bool(code.co_flags & 0x04) + bool(code.co_flags & 0x08)  # *args, **kwargs
    return code.co_varnames[:count]


def describe(value: Any) -> str:
    return "text" if isinstance(value, str) else type(value).__name__


def trace(route: Route, function: Callable[[], object]) -> list[tuple[str, str, str]]:
    """Return the rows of a route while a function is called."""
    threading.setprofile(route)
    sys.setprofile(route)
    try:
        function()
    except SystemExit:  # of a command
        pass
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return route.rows()


def write_scenario(folder: Path, component: dict[str, Any]) -> Path:
    scenario = {"name": "route", "stop_time": 0.1, "step_size": 0.01, "components": {}}
    scenario["components"] = {"c": component}
    path = folder / "scenario.json"
    path.write_text(json.dumps(scenario))
    return path


def fmu_route(folder: Path) -> list[tuple[str, str, str]]:
    """Return the route of the path of an FMU in a scenario."""
    import cosim

    shutil.copy(ROOT / "fmus/mixer.fmu", folder / "followed.fmu")
    scenario = write_scenario(folder, {"fmu": "followed.fmu"})
    route = Route(lambda value: isinstance(value, str | Path) and "followed" in str(value), True)
    return trace(route, lambda: cosim.run(scenario))


def mass_route(folder: Path) -> list[tuple[str, str, str]]:
    """Return the route of the mass in a vehicle file."""
    import cosim

    vehicle = json.loads((ROOT / "plant_src/vehicles/data/x500.json").read_text())
    (folder / "vehicle.json").write_text(json.dumps({**vehicle, "mass": MASS}))
    arguments = {"vehicles": {"uav": {"model": "vehicle.json", "position": [0, 0, 2]}}}
    scenario = write_scenario(
        folder, {"python": f"{ROOT}/plant_src/world.py:World", "arguments": arguments}
    )
    route = Route(lambda value: isinstance(value, float) and value == MASS, True)
    return trace(route, lambda: cosim.run(scenario))


def output_route(folder: Path) -> list[tuple[str, str, str]]:
    """Return the route of the name of an output into the files of a run."""
    from cosim.cli import main

    scenario = write_scenario(folder, {"fmu": f"{ROOT}/fmus/mixer.fmu"})
    words = ["run", str(scenario), "--output-dir", str(folder / "run"), "--isolation", "none"]
    route = Route(lambda value: value.__class__ is str and value == "c.rotor_speed[1]", False)
    with contextlib.redirect_stdout(io.StringIO()):
        return trace(route, lambda: main(words))


ROUTES = {
    "The path of an FMU, from the scenario to the first step": fmu_route,
    "The mass in a vehicle file, to the compiled equations": mass_route,
    "An output, to the CSV file and the report": output_route,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args()
    for title, follow in ROUTES.items():
        with tempfile.TemporaryDirectory() as folder:
            rows = follow(Path(folder))
        files = list(dict.fromkeys(file for file, _, _ in rows))
        print(f"## {title}\n\n{len(files)} files.\n\n| file | function | value |\n|---|---|---|")
        for file, function, value in rows:
            print(f"| `{file}` | `{function}` | {value} |")
        print()


if __name__ == "__main__":
    main()
