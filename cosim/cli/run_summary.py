"""Summary of a run for `cosim run --json`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..results import Result
    from ..results.checks import CheckOutcome


def summarize_run(
    result: Result,
    checks: Sequence[CheckOutcome],
    folder: Path,
    files: Sequence[str],
    exit_code: int,
) -> dict[str, Any]:
    """Return the JSON value that `cosim run --json` prints.

    Args:
        result: the result; after a failure, what was recorded until then.
        checks: outcomes of the checks.
        folder: the output directory.
        files: names of the files in it.
        exit_code: exit code of the command.
    """
    about, times = result.metadata, result.time
    return {
        "name": about.get("name"),
        "exit_code": exit_code,
        "failure": about.get("failure"),
        "termination": result.termination or None,
        "start_time": times[0] if len(times) else None,
        "end_time": times[-1] if len(times) else None,
        "loop_seconds": result.timing.get("loop_seconds"),
        "kpis": dict(result.kpis),
        "checks": [
            {**check.check, "value": check.value, "passed": check.passed} for check in checks
        ],
        "warnings": about.get("warnings", []),
        "folder": folder,
        "files": files,
    }
