"""Command lines that repeat single runs of a study."""

from __future__ import annotations

import json
import shlex
from functools import lru_cache
from os.path import normpath
from pathlib import Path
from typing import Any

from ...core import resources
from ...scenario.file_paths import SHIPPED, change_pointed, relocating
from ...scenario.schema_types import PathChange
from ..sweep import Sweep


def run_command(sweep: Sweep, run: int) -> str:
    """Return the command line that repeats a run with all signals that the scenario records."""
    return format_run_command(sweep.study_file.scenario, run_settings(sweep, run))


def run_settings(sweep: Sweep, run: int) -> dict[str, Any]:
    """Return the settings that repeat a run with all signals that the scenario records, not only those that the sweep needs."""
    settings = sweep.study.job(sweep.design[run].settings).settings
    return {name: value for name, value in settings.items() if not name.startswith("/record")}


def format_run_command(scenario: Path, settings: Any) -> str:
    """Return the command line that makes this run alone in the working directory.

    It refers to a shipped scenario by its name.

    Paths in settings of a study start from the folder of the scenario, those of the option `--set`
    from the working directory.
    """
    change = _path_changes(scenario.parent, Path.cwd())
    moved = {
        name: change_pointed(name, value, change) if name.startswith("/") else value
        for name, value in settings.items()
    }
    words = [
        word
        for name, value in moved.items()
        for word in ("--set", f"{name}={_setting_text(value)}")
    ]
    return shlex.join(["cosim", "run", _scenario_text(scenario), *words])


@lru_cache(1)  # a sweep writes a command for each run without success
def _path_changes(folder: Path, working: Path) -> PathChange:
    """Return a function that makes paths relative to the folder shipped ones, or relative to the working directory."""
    to_shipped, to_working = relocating(folder, resources.root()), relocating(folder, working)

    def change(text: str) -> str:
        shipped = to_shipped(text)
        return (
            to_working(text)
            if Path(shipped).is_absolute() or shipped.startswith("..")
            else f"{SHIPPED}{shipped}"
        )

    return change


@lru_cache(1)
def _scenario_text(scenario: Path) -> str:
    is_shipped = scenario.resolve().parent == (resources.root() / "scenarios").resolve()
    return scenario.stem if is_shipped else normpath(scenario)


def _setting_text(value: Any) -> str:
    """Return a value as `--set` reads it: JSON, or a string that is not JSON."""
    try:
        json.loads(value)
    except (TypeError, ValueError, RecursionError):
        return value if isinstance(value, str) else json.dumps(value)
    return json.dumps(value)
