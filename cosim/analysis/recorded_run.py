"""Scenario of a recorded run, so that KPIs and figures of the run can analyse it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..results import Result
from ..scenario.file_paths import relocating
from ..scenario.sources import change_paths


def recorded_scenario(result: Result) -> dict[str, Any]:
    """Return the scenario of a run with absolute paths, and with the values that the caller set.

    Raises:
        InputError: The result does not hold its scenario, as that of a CSV file.
    """
    about = result.metadata
    if "scenario" not in about or "scenario_file" not in about:
        raise InputError(
            "the result does not hold its scenario, expected one of cosim.run or of a folder that "
            "cosim run wrote"
        )
    folder = Path(about["scenario_file"]).parent
    scenario = change_paths(about["scenario"], relocating(folder, None))
    for name, value in about.get("parameters", {}).items():
        component, _, variable = name.partition(".")
        spec = scenario["components"][component]
        scenario["components"] |= {
            component: {**spec, "parameters": {**spec.get("parameters", {}), variable: value}}
        }
    return scenario
