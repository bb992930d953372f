"""References: few rows of a run with which later runs are compared, and their provenance."""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import CheckError, pattern_hint
from ..core.recording import Recording
from . import Result
from .comparison import Comparer, compare, match_tolerances
from .files import write_json
from .tolerance_tube import Tolerance

#: largest distance between selected rows
MAX_ROW_DISTANCE = 64
#: fraction of the tolerances that the run itself may deviate from its reference
TOLERANCE_FRACTION = 0.25
#: fraction of the half width of a tube to which values are rounded
ROUNDING_FRACTION = 0.01
#: largest number of Python files of a folder that have a hash each; those of larger folders have
#: one
MAX_SINGLE_MODULES = 5

_PROVENANCE_KEYS = ("versions", "machine", "sha256")


def decimate(result: Result, tolerances: Mapping[str, Tolerance]) -> Result:
    """Select few rows, with the first and last one, that describe a run within its tolerances.

    Args:
        result: The run.
        tolerances: Tolerance by pattern of signals, see `compare`.

    Returns:
        The matching signals at the selected rows, rounded to about a hundredth of their tolerances.

    Raises:
        CheckError: The run cannot be a reference: a pattern matches no signal, or a value is not
            finite.
    """
    if unmatched := [pattern for pattern in tolerances if not result.signals(pattern)]:
        texts = (
            f'"{pattern}" matches no recorded signal{pattern_hint(pattern, result)}'
            for pattern in unmatched
        )
        raise CheckError(f"this run is no reference: {'; '.join(texts)}")
    selected = match_tolerances(tolerances, list(result))
    rounded = {name: _round(result[name], tolerance) for name, tolerance in selected.items()}
    source = Result(
        Recording(result.time, rounded, {name: result.units[name] for name in selected})
    )
    whole = _select_rows(np.arange(len(result.time)), source)
    comparison = compare(result, whole, tolerances)
    if not comparison.passed:
        raise CheckError(f"this run is no reference: {comparison}")
    rows = np.unique(
        np.append(np.arange(0, len(result.time), MAX_ROW_DISTANCE), len(result.time) - 1)
    )
    while (
        outside := _find_rows_outside(
            result, reference := _select_rows(rows, source), selected, rows
        )
    ).size:
        gaps = np.searchsorted(rows, outside) - 1
        rows = np.union1d(rows, (rows[gaps] + rows[gaps + 1]) // 2)
    return reference


def _round(values: np.ndarray, tolerance: Tolerance) -> np.ndarray:
    """Round floating-point values to the decimal place below a hundredth of the tolerance.

    Keep all others.
    """
    half_width = tolerance.half_width(values) if values.dtype.kind == "f" else 0.0
    if not 0 < half_width < math.inf:
        return values
    return (
        np.round(values, -math.floor(math.log10(ROUNDING_FRACTION * half_width))) + 0.0
    )  # no negative zeros


def _select_rows(rows: np.ndarray, result: Result) -> Result:
    return Result(
        Recording(
            result.time[rows], {name: result[name][rows] for name in result}, dict(result.units)
        )
    )


def _find_rows_outside(
    result: Result, reference: Result, tolerances: Mapping[str, Tolerance], rows: np.ndarray
) -> np.ndarray:
    """Return the rows outside a fraction of the tolerances around a reference made of `rows`."""
    comparer = Comparer(result, reference)
    last = np.searchsorted(reference.time, result.time, "right") - 1
    outside = np.zeros(len(result.time), dtype=bool)
    for name, tolerance in tolerances.items():
        if result[name].dtype == object:
            outside |= result[name] != reference[name][last]
        else:
            outside |= comparer.is_outside(name, tolerance.scaled(TOLERANCE_FRACTION))
    outside[rows] = False
    return np.flatnonzero(outside)


def write_reference(result: Result, path: Path, tolerances: Mapping[str, Tolerance]) -> Result:
    """Write a reference (CSV) and its provenance (JSON with the same name).

    Versions, machine and hashes of all files.

    Args:
        result: The run; the same run gives the same bytes.
        path: The CSV file.
        tolerances: Tolerance by pattern of signals, see `compare`.

    Returns:
        The written rows.

    Raises:
        CheckError: The run cannot be a reference, see `decimate`.
        InputError: The files cannot be written.
        OutputError: The disk is full or defective.
    """
    reference = decimate(result, tolerances)
    reference.to_csv(path)
    about: dict[str, Any] = {
        "name": result.metadata.get("name"),
        "signals": len(reference),
        "rows": len(reference.time),
    }
    about |= {key: result.metadata.get(key) for key in _PROVENANCE_KEYS}
    hashes = result.metadata.get("sha256") or {}
    counts = Counter(filter(None, map(_modules_of, hashes)))
    # the Python files of a folder with many of them have one hash
    joined = {name for name, count in counts.items() if count > MAX_SINGLE_MODULES}
    about["sha256"] = _join_modules(hashes, joined)
    write_json(about, path.with_suffix(".json"))
    return reference


def _modules_of(name: str) -> str:
    """Return the pattern of the Python files in the folder of a Python file, such as "a/*.py".

    "" for another file.
    """
    return f"{name.rpartition('/')[0]}/*.py".lstrip("/") if name.endswith(".py") else ""


def _join_modules(hashes: Mapping[str, str], joined: Collection[str]) -> dict[str, str]:
    """Return the hashes of files, with one for all Python files of each pattern in `joined`."""
    lines: dict[str, list[str]] = defaultdict(list)
    for name in sorted(hashes):
        lines[pattern if (pattern := _modules_of(name)) in joined else name].append(
            f"{name} {hashes[name]}\n"
        )
    return {
        name: hashes[name] if name in hashes else sha256("".join(own).encode()).hexdigest()
        for name, own in sorted(lines.items())
    }


def describe_provenance_changes(
    before: Mapping[str, Any], after: Mapping[str, Any], shown: Callable[[str], str] = str
) -> list[str]:
    """Return the differences of provenance from a reference to a run, such as "numpy 2.1 -> 2.2".

    Args:
        before: Provenance of the reference, as in its JSON file.
        after: Metadata of the run.
        shown: Function that returns how a file is named, from its path relative to the scenario's
            folder or "cosim:...".
    """
    changes = []
    for key in _PROVENANCE_KEYS:
        old, new = before.get(key), after.get(key) or {}
        old = old if isinstance(old, dict) else {}
        if key == "sha256":
            new = _join_modules(new, old.keys())
        names = [name for name in {**old, **new} if old.get(name) != new.get(name)]
        changes += [
            shown(name) if key == "sha256" else f"{name} {old.get(name)} -> {new.get(name)}"
            for name in names
        ]
    return changes
