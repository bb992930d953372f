"""Paths of files in the JSON of scenarios and nested systems."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core import paths, resources
from ..core.errors import InputError, did_you_mean
from .component_schema import change_paths
from .json_document import pointer_keys
from .schema_types import PathChange

#: a path that begins so starts from the files that cosim ships
SHIPPED = "cosim:"


def find_scenario(scenario: str | Path) -> Path:
    """Return the path of a scenario file.

    It is given by its path (also "cosim:...") with or without ".json", or by a shipped name.

    Raises:
        InputError: There is neither such a file nor a shipped scenario of this name, or it is an
            FMU or a Python file.
    """
    path = path_in(Path(), str(scenario))
    if path.suffix == ".fmu":
        raise InputError(
            f"{scenario} is an FMU, expected a scenario; `cosim simulate {scenario}` simulates a "
            "single FMU"
        )
    if path.suffix == ".py":
        raise InputError(
            f"{scenario} is a Python file, expected a scenario, which is a JSON file that names "
            "its classes"
        )
    if path.suffix == ".json" or paths.is_file(path):
        return path
    names = resources.shipped_names("scenarios/*.json")
    if str(scenario) in names:
        return resources.root() / "scenarios" / f"{scenario}.json"
    if path.name and paths.is_file(completed := path.with_name(f"{path.name}.json")):
        return completed
    if str(scenario) and paths.is_folder(path):
        raise InputError(f"{scenario} is a folder, expected a scenario file")
    raise InputError(
        f'no scenario file and no shipped scenario "{scenario}"{did_you_mean(path.name, names)}'
    )


def path_in(folder: Path, text: str) -> Path:
    """Return the file that a path in a file of `folder` names.

    With "cosim:" it starts from the files that cosim ships.
    """
    return (
        resources.root() / text.removeprefix(SHIPPED) if text.startswith(SHIPPED) else folder / text
    )


def relocating(old_folder: Path, new_folder: Path | None) -> PathChange:
    """Return a function that changes paths from one folder to another one; None: absolute paths."""

    def change(text: str) -> str:
        path = path_in(old, text)
        stays_absolute = new is None or Path(text).is_absolute()
        changed = os.path.normpath(path) if stays_absolute else os.path.relpath(path, new)
        return changed.replace(os.sep, "/")

    old, new = paths.resolve_path(old_folder), new_folder and paths.resolve_path(new_folder)
    return change


def resolve_shipped_paths(system: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return a copy of a system in `folder` with relative paths of shipped files ("cosim:...")."""
    change = relocating(folder, folder)
    return change_paths(system, lambda text: change(text) if text.startswith(SHIPPED) else text)


def change_pointed(pointer: str, value: Any, change: PathChange) -> Any:
    """Return the value of a JSON pointer into a scenario with every path changed."""
    keys = pointer_keys(pointer)
    for key in reversed(keys):
        value = {key: value}
    value = change_paths(value, change)
    for key in keys:
        value = value[key]
    return value
