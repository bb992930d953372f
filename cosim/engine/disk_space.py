"""Check that a recording fits on the disk."""

from __future__ import annotations

import shutil
from pathlib import Path

from ..core.csv_text import BYTES_PER_NUMBER
from ..core.errors import Problem
from ..core.text import count_noun
from .plan import Plan

#: size of a number in the rows (bytes), approximately
_BYTES_PER_VALUE = 8
#: size of the recording (bytes) from which the free disk space is checked
_SIZE_CHECK_THRESHOLD = 1_000_000_000


def find_space_problems(plan: Plan, folder: Path, csv: bool, replaced: int = 0) -> list[Problem]:
    """Return a problem if the recording is larger than the free disk space; empty if it fits.

    Args:
        plan: the compiled system.
        folder: folder of the rows.
        csv: a CSV file is written there, too.
        replaced: size of the files there that are removed before (bytes).
    """
    rows, columns = plan.row_count, len(plan.settings.columns)
    size = rows * (columns + 1) * (_BYTES_PER_VALUE + csv * BYTES_PER_NUMBER)
    if size < _SIZE_CHECK_THRESHOLD or size <= (free := shutil.disk_usage(folder).free + replaced):
        return []
    amount = f"{count_noun(rows, 'row')} of {count_noun(columns, 'signal')}"
    text = f"{amount} take about {size / 1e9:.3g} GB, {free / 1e9:.3g} GB are free in {folder}"
    return [
        Problem(
            f'{text}; make the step longer, or set "record": {{"interval": ...}}',
            subject=("step_size",),
        )
    ]
