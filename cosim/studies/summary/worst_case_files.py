"""Files of a search for the worst case."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...results.files import write_json
from ...scenario.nested_systems import extending_scenario
from ..execution.bundle import cosim_fingerprint
from ..worst_case import WorstCase
from .table import write_csv_rows


def write_worst_case_files(search: WorstCase, folder: Path) -> list[Path]:
    """Write trials.csv and worst.json, and each counterexample as a scenario that extends that of the search.

    Returns:
        The files of the counterexamples, the worst one first.
    """
    names = [spec.name for spec in search.spec.parameters]
    rows = (
        [*each.parameters.values(), each.severity, each.passed, each.reason]
        for each in search.attempts
    )
    write_csv_rows([*names, "severity", "passed", "reason"], rows, folder / "trials.csv")
    write_json(describe_worst_case(search), folder / "worst.json")
    files, scenario = [], search.study_file.scenario
    for number, each in enumerate(search.counterexamples, 1):
        name = f"{search.spec.name}_{number}"
        file = folder / "counterexamples" / f"{name}.json"
        file.parent.mkdir(exist_ok=True)
        settings = search.settings(each)
        write_json(
            extending_scenario(scenario, file.parent, name, each.reason, settings, scenario.parent),
            file,
        )
        files.append(file)
    return files


def describe_worst_case(search: WorstCase) -> dict[str, Any]:
    """Return the worst run and the counterexamples with everything that they depend on, as a JSON value."""
    return {
        "name": search.spec.name,
        "search": search.study_file.document.value,
        "worst": vars(search.worst),
        "counterexamples": [vars(each) for each in search.counterexamples],
        "runs": len(search.attempts),
        "cosim": cosim_fingerprint(),
        "sha256": dict(search.study.bundle.files),
    }
