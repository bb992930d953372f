"""Results folders of `cosim run`: read results and load the figure functions of their scenarios."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ..core.errors import InputError
from ..core.json_values import parse_object
from ..results import Kpis, Result
from ..scenario.json_document import read_document
from ..scenario.named_functions import load_function
from ..scenario.validation import schema_problems
from .run_schema import KpiFile, RunFile

#: name, function and keyword arguments of a figure
NamedCall = tuple[str, Callable[..., Any], Mapping[str, Any]]


def read_run(directory: str | Path) -> Result:
    """Read the result, KPIs, timing and metadata from a folder that `cosim run` wrote.

    Boolean signals become 0 and 1, see `Result.from_csv`.

    Raises:
        InputError: A file is missing or invalid.
    """
    directory = Path(directory)
    about = _read_json(directory / "run.json", RunFile)
    timing, units = about.pop("timing", {}), about.pop("units", {})
    kpis = (
        _read_json(directory / "kpis.json", KpiFile) if (directory / "kpis.json").exists() else {}
    )
    numbers = {name: math.nan if value is None else value for name, value in kpis.items()}
    recording = Result.from_csv(directory / "result.csv").recording
    return Result(
        replace(recording, units={**recording.units, **units}), Kpis(numbers), timing, about
    )


def _read_json(path: Path, schema: type[BaseModel]) -> dict[str, Any]:
    """Read a JSON object that `cosim run` has written.

    Raise InputError, with the line, if another program has changed it.
    """
    try:
        value = parse_object(path.read_text(encoding="utf-8"))
        schema.model_validate(value)
    except OSError as error:
        raise InputError(
            f"cannot read {path}: {error.strerror}; expected a folder that `cosim run` wrote"
        ) from error
    except ValidationError as error:
        raise InputError(schema_problems(schema, read_document(path), error)) from None
    except ValueError as error:
        raise InputError(
            f"{path} is not valid JSON: {error}; expected a file that `cosim run` wrote"
        ) from error
    return value


def load_figures(result: Result) -> list[NamedCall]:
    """Import the figure functions of a result's scenario and return (name, function, arguments) of each.

    Raises:
        InputError: The scenario file is unknown, or a function does not exist.
    """
    specs = result.metadata.get("scenario", {}).get("figures", [])
    if not specs:
        return []
    if "scenario_file" not in result.metadata:
        raise InputError(
            'run.json has no "scenario_file", so the figure functions cannot be found: run the '
            "scenario again"
        )
    folder = Path(result.metadata["scenario_file"]).parent
    return [
        (spec["name"], load_function(spec["python"], folder), spec.get("arguments", {}))
        for spec in specs
    ]
