"""Scenario files that extend another scenario by changed values."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core import resources
from .file_paths import change_paths, find_scenario, relocating
from .json_pointer import pointer_keys
from .nested_systems import load_scenario


def extending_scenario(
    base: str | Path,
    folder: Path,
    name: str,
    description: str,
    settings: Mapping[str, Any] | None = None,
    settings_folder: Path | None = None,
) -> dict[str, Any]:
    """Return the content of a scenario file that extends another one.

    Args:
        base: Path of a scenario file, or name of a shipped scenario. A shipped scenario is extended
            by its name, so that the new file runs wherever cosim is installed.
        folder: Folder of the new file.
        name: Name of the new scenario.
        description: Its description.
        settings: Changed values by names of variables or JSON pointers, as for `cosim.load`.
        settings_folder: Folder that paths in the values of JSON pointers start from; None: the
            working directory.

    Raises:
        InputError: The base does not exist, or a JSON pointer leads nowhere.
    """
    found = find_scenario(base)
    is_shipped = found.resolve().parent == (resources.root() / "scenarios").resolve()
    extended = found.stem if is_shipped else os.path.relpath(found, folder).replace(os.sep, "/")
    changed = (
        load_scenario(found, settings, settings_folder).root.document.value if settings else {}
    )
    values: dict[str, Any] = {}
    for key in settings or {}:
        if key.startswith("/"):
            _copy_pointed(changed, values, pointer_keys(key))
    values = change_paths(values, relocating(found.parent, folder))
    for key, value in (settings or {}).items():
        if not key.startswith("/"):
            component, _, variable = key.partition(".")
            values.setdefault("components", {}).setdefault(component, {}).setdefault(
                "parameters", {}
            )[variable] = value
    return {"extends": extended, "name": name, "description": description, **values}


def _copy_pointed(source: Any, target: dict[str, Any], keys: list[str]) -> None:
    """Copy the value that keys lead to; a list on the way is copied as a whole."""
    key, *rest = keys
    if rest and isinstance(source.get(key), dict):
        _copy_pointed(source[key], target.setdefault(key, {}), rest)
    else:
        target[key] = source[key]
