"""References: the few numbers of a run that later runs are held against, and a note of what made them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import CheckError
from ...core.recording import Recording
from .. import Result
from ..files import write_json
from .comparison import Comparer, compare, match_tolerances
from .tube import Tolerance

#: of so many rows at least one is kept, and more where the run itself would leave SHARE of its tolerances around them
MAX_ROW_DISTANCE = 64
TOLERANCE_FRACTION = 0.25

_PROVENANCE_KEYS = ("versions", "machine", "sha256")


def decimate(result: Result, tolerances: Mapping[str, Tolerance]) -> Result:
    """The signals that match a pattern of `tolerances`, at as few rows as describe them; the first and the last are among them.

    Raises CheckError when the run would not pass against it: a pattern matches nothing, a signal is not finite.
    """
    chosen = match_tolerances(tolerances, list(result))
    whole = _select_rows(np.arange(len(result.time)), result, chosen)
    comparison = compare(result, whole, tolerances)
    if not comparison.passed:
        raise CheckError(f"this run is no reference: {comparison}")
    rows = np.unique(np.append(np.arange(0, len(result.time), MAX_ROW_DISTANCE), len(result.time) - 1))
    while (outside := _find_rows_outside(result, reference := _select_rows(rows, result, chosen), chosen, rows)).size:
        gaps = np.searchsorted(rows, outside) - 1
        rows = np.union1d(rows, (rows[gaps] + rows[gaps + 1]) // 2)
    return reference


def _select_rows(rows: np.ndarray, result: Result, names: Iterable[str]) -> Result:
    columns = {name: result[name][rows] for name in names}
    return Result(Recording(result.time[rows], columns, {name: result.units[name] for name in names}))


def _find_rows_outside(result: Result, reference: Result, tolerances: Mapping[str, Tolerance], kept: np.ndarray) -> np.ndarray:
    """The rows of the result that are not within SHARE of the tolerances around a reference made of the rows `kept`."""
    comparer = Comparer(result, reference)
    last = np.searchsorted(reference.time, result.time, "right") - 1
    outside = np.zeros(len(result.time), dtype=bool)
    for name, tolerance in tolerances.items():
        if result[name].dtype == object:
            outside |= result[name] != reference[name][last]
        else:
            outside |= comparer.is_outside(name, tolerance.scaled(TOLERANCE_FRACTION))
    outside[kept] = False
    return np.flatnonzero(outside)


def write_reference(result: Result, path: Path, tolerances: Mapping[str, Tolerance]) -> Result:
    """Write `path` (CSV), and beside it as JSON what made it: versions, machine and the hashes of all files.

    Returns what it holds. The same run writes the same bytes. Raises CheckError as `thinned`, InputError when the files
    cannot be written.
    """
    reference = decimate(result, tolerances)
    reference.to_csv(path)
    about = {"name": result.metadata.get("name"), "signals": len(reference), "rows": len(reference.time)}
    write_json({**about, **{key: result.metadata.get(key) for key in _PROVENANCE_KEYS}}, path.with_suffix(".json"))
    return reference


def describe_provenance_changes(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """What differs between what made a reference and what made a run (their JSON), by name, as "numpy 2.1 -> 2.2"."""
    found = []
    for key in _PROVENANCE_KEYS:
        old, new = before.get(key) or {}, after.get(key) or {}
        names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
        found += [name if key == "sha256" else f"{name} {old.get(name)} -> {new.get(name)}" for name in names]
    return found
