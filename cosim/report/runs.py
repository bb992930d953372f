"""What `cosim run` left behind, read again: results, and the figures that their scenarios ask for."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..results import Kpis, Result
from ..scenario.named_functions import load_function

NamedCall = tuple[str, Callable[..., Any], Mapping[str, Any]]


def read_run(directory: str | Path) -> Result:
    """The result in a folder that `cosim run` wrote, with its KPIs, timing and metadata.

    Booleans return as 0 and 1, see `Result.from_csv`. Raises InputError when a file cannot be read.
    """
    directory = Path(directory)
    about = _read_json(directory / "run.json")
    timing, units = about.pop("timing", {}), about.pop("units", {})
    kpis = _read_json(directory / "kpis.json") if (directory / "kpis.json").exists() else {}
    numbers = {name: math.nan if value is None else value for name, value in kpis.items()}
    recording = Result.from_csv(directory / "result.csv").recording
    return Result(replace(recording, units={**recording.units, **units}), Kpis(numbers), timing, about)


def _read_json(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}; expected a folder that `cosim run` wrote") from error
    except ValueError as error:
        raise InputError(f"{path} is no JSON: {error}") from error
    if not isinstance(value, dict):
        raise InputError(f"{path} holds no JSON object; expected what `cosim run` wrote")
    return value


def load_figures(result: Result) -> list[NamedCall]:
    """(name, function, arguments) of every figure that the result's scenario asks for."""
    specs = result.metadata.get("scenario", {}).get("figures", [])
    if not specs:
        return []
    if "scenario_file" not in result.metadata:
        raise InputError("run.json does not say where its scenario is (scenario_file): run the scenario again")
    folder = Path(result.metadata["scenario_file"]).parent
    return [(spec["name"], load_function(spec["python"], folder), spec.get("arguments", {})) for spec in specs]
