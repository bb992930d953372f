"""Vehicle files as arguments of commands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from ..core.errors import InputError, Problem

_Result = TypeVar("_Result")

#: keys that a scenario or a study has, and a vehicle file has not
SCENARIO_KEYS = frozenset({"components", "extends", "scenario"})


def read_vehicle_file(file: Path, read: Callable[[Mapping[str, Any], str], _Result]) -> _Result:
    """Return the result of `read` for the data in a vehicle file and the name of the file.

    Raises:
        InputError: The file is no vehicle file; each problem names file, line and column.
    """
    from ..scenario.json_document import read_document

    document = read_document(file)
    if document.problems:
        raise InputError(document.problems)
    if not isinstance(document.value, dict):
        raise InputError(Problem("expected an object, the data of a vehicle", document.where(())))
    if "family" not in document.value and not SCENARIO_KEYS.isdisjoint(document.value):
        raise InputError(
            f"{file} is a scenario or a study, expected a vehicle file; `cosim check {file}` "
            "describes a scenario"
        )
    try:
        return read(document.value, file.stem)
    except InputError as error:
        raise InputError(
            [replace(each, where=document.where(each.subject[1:])) for each in error.problems]
        ) from None
