"""Comparison of results with references: results, files, run folders or scenarios."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..core.errors import InputError, abbreviate_names
from ..core.json_values import parse_object
from ..results import Result
from ..results.comparison import Comparison, needed_share
from ..results.comparison import compare as compare_results
from ..results.reference import describe_provenance_changes
from ..results.tolerance_tube import Tolerance
from ..scenario import find_scenario, load_scenario
from ..scenario.file_paths import SHIPPED
from .arguments import expect, is_number

if TYPE_CHECKING:
    from ..results.kpi import NamedCall

#: number of names in the line that lists what has changed since a reference was made
MAX_LISTED_CHANGES = 5

#: a result, a CSV file, or a folder that `cosim run` has written
ResultSource = Result | str | Path


class ComparisonTask(NamedTuple):
    """A result, its reference, and the tolerances by patterns of signals.

    Attributes:
        result: The result.
        reference: The reference.
        tolerances: Tolerances by patterns of signals.
        changes: What has changed since the reference of a scenario was made, in one line; "" if
            nothing is known.
    """

    result: Result
    reference: Result
    tolerances: Mapping[str, Tolerance]
    changes: str = ""

    @classmethod
    def read(
        cls,
        result: ResultSource,
        reference: ResultSource,
        tolerance: Tolerance,
        signals: Sequence[str] = (),
    ) -> ComparisonTask:
        """Read a result and its reference.

        Args:
            result: A result, a CSV file, or a folder that `cosim run` has written.
            reference: The same, or a scenario (JSON file or name of a shipped scenario) with its
                own reference and tolerances.
            tolerance: Tolerance of all signals, unless the reference is a scenario.
            signals: Patterns of the signals that are compared; all by default.

        Raises:
            InputError: A file cannot be read, or the scenario has no reference.
        """
        if not isinstance(reference, Result) and is_scenario(Path(reference)):
            scenario = find_scenario(Path(reference))
            spec = load_scenario(scenario).spec.reference
            if spec is None:
                raise InputError(f'{scenario} has no "reference"')
            file, run = scenario.parent / spec.file, _read_result(result)
            tolerances = {name: Tolerance(**vars(part)) for name, part in spec.tolerances.items()}
            changes = reference_changes(run, file, scenario.parent)
            return cls(run, _read_result(file), tolerances, changes)
        return cls(
            _read_result(result),
            _read_result(reference),
            dict.fromkeys(signals or ("*",), tolerance),
        )

    def compare(self) -> Comparison:
        """Return the verdict on each signal of the reference."""
        return compare_results(self.result, self.reference, self.tolerances)

    def figure(self, comparison: Comparison) -> NamedCall:
        """Return name, function and arguments of the figure with the largest deviations."""
        from ..report.comparison_figures import draw_tubes

        arguments = {
            "reference": self.reference,
            "tolerances": self.tolerances,
            "comparison": comparison,
        }
        return "comparison", draw_tubes, arguments

    def needed_share(self) -> float:
        """Return the smallest share (1) of all tolerances with which a comparison still passes.

        It is 0 if all signals are equal. The comparison must pass.
        """
        return needed_share(self.result, self.reference, self.tolerances)


def compare(
    result: ResultSource,
    reference: ResultSource,
    *,
    absolute: float = 0.0,
    relative: float = 0.0,
    time: float = 0.0,
    signals: Sequence[str] = (),
) -> Comparison:
    """Compare a result with a reference, signal by signal.

    Every signal must stay within the larger of the absolute and the relative tolerance, and within
    the tolerance of time. Without tolerances it must be equal.

    Args:
        result: A result, a CSV file, or a folder that `cosim run` has written.
        reference: The same, or a scenario (JSON file or name of a shipped scenario) whose reference
            and tolerances are used.
        absolute: Absolute tolerance, in the unit of each signal.
        relative: Relative tolerance, a fraction of the range of the reference signal.
        time: Tolerance along the time axis (s).
        signals: Patterns of the signals of the reference that are compared; "*" matches any text.
            All by default.

    Returns:
        The comparison with `passed`, `failures` and one verdict for each signal.

    Raises:
        InputError: A file cannot be read, the scenario has no reference, or a tolerance is
            negative.
    """
    for name, source in (("result", result), ("reference", reference)):
        expect(name, source, isinstance(source, Result | str | os.PathLike), "a result or a path")
    for name, value in (("absolute", absolute), ("relative", relative), ("time", time)):
        expect(name, value, is_number(value), "a number")
    patterns = [signals] if isinstance(signals, str) else signals
    expect(
        "signals", signals, all(isinstance(each, str) for each in patterns), "a list of patterns"
    )
    return ComparisonTask.read(
        result, reference, Tolerance(absolute, relative, time), patterns
    ).compare()


def reference_changes(result: Result, reference: Path, folder: Path) -> str:
    """Return one line that lists what has changed since the reference of a scenario was made.

    "" if nothing is known.

    Args:
        result: A run of the scenario.
        reference: The reference, a CSV file with a JSON file of the same name that states its
            origin.
        folder: Folder of the scenario.
    """

    def shown(name: str) -> str:
        """Return a file of the run relative to the working directory.

        Metadata name it from the scenario's folder.
        """
        if name.startswith(SHIPPED):
            return name
        return os.path.relpath(folder / name).replace(os.sep, "/")

    try:
        made_by = parse_object(reference.with_suffix(".json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    changes = describe_provenance_changes(made_by, result.metadata, shown)
    own_first = sorted(changes, key=lambda change: change.startswith(SHIPPED))
    listed = abbreviate_names(own_first, MAX_LISTED_CHANGES)
    return f"changed since the reference was made: {listed}" if changes else ""


def _read_result(source: ResultSource) -> Result:
    if isinstance(source, Result):
        return source
    path = Path(source)
    folder = path.parent if path.name == "result.csv" else path
    if (folder / "run.json").exists():
        from ..report.runs import read_run  # its units: angles of a whole turn are equal

        return read_run(folder)
    return Result.from_csv(path / "result.csv" if path.is_dir() else path)


def is_scenario(path: Path) -> bool:
    """Return whether a path names a scenario.

    It is a JSON file, or the name of a shipped scenario: without a folder, and no existing file.
    """
    return path.suffix == ".json" or (
        path.name == str(path) and not path.suffix and not path.exists()
    )
