"""Files of a tuning."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...results.files import write_json
from ..execution.bundle import cosim_fingerprint
from ..factor_schema import TRIAL_COLUMNS
from ..tune import Trial, Tuning
from .table import write_csv_rows


def write_tuning_files(tuning: Tuning, folder: Path) -> Trial:
    """Write trials.csv and best.json and return the best trial.

    There must be at least one trial.
    """
    names = [spec.name for spec in tuning.spec.parameters]
    lines = (
        [*trial.parameters.values(), trial.value, trial.violation, trial.failure]
        for trial in tuning.trials
    )
    write_csv_rows([*names, *TRIAL_COLUMNS], lines, folder / "trials.csv")
    best = min(tuning.trials, key=lambda trial: trial.rank)
    write_json(describe_best(tuning, best), folder / "best.json")
    return best


def describe_best(tuning: Tuning, best: Trial) -> dict[str, Any]:
    """Return the best trial with everything that its evaluation depends on, as a JSON value."""
    return {
        "name": tuning.spec.name,
        "tuning": tuning.study_file.document.value,
        "parameters": best.parameters,
        "settings": tuning.settings(best.parameters),
        "value": best.value,
        "violation": best.violation,
        "trials": len(tuning.trials),
        "cosim": cosim_fingerprint(),
        "sha256": dict(tuning.study.bundle.files),
    }
