"""Regression tests: runs of scenarios that are compared with checks and references."""

from __future__ import annotations

import json
import math
import os
import shlex
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..components.fmi.changed_sources import OTHER_VERSION
from ..core import resources
from ..core.errors import CosimError, InputError
from ..core.paths import open_text
from ..core.text import count_noun
from ..scenario import find_scenario

if TYPE_CHECKING:
    from ..results import Result
    from ..results.comparison import Comparison
    from ..results.tolerance_tube import Tolerance


#: keys of a scenario that state expectations of its results
EXPECTATION_KEYS = ("checks", "reference")

#: exit codes from the most to the least severe; the most severe one is returned
EXIT_CODE_SEVERITY = (130, 70, 2, 1, 3, 0)


def has_keys(file: Path, *groups: Sequence[str]) -> bool:
    """Return whether a JSON file, or one that it extends, has a key of each group.

    True for an unreadable file, because its run reports the error.
    """
    from ..scenario.extension import read_system_document

    try:
        with open_text(file, encoding="utf-8-sig") as stream:
            content = json.load(stream)
        if isinstance(content, dict) and "extends" in content:
            content = read_system_document(file).value
    except (OSError, ValueError, RecursionError, InputError):
        return True
    return isinstance(content, dict) and all(any(map(content.get, group)) for group in groups)


@dataclass(frozen=True)
class RegressionOutcome:
    """Outcome of one regression test.

    Attributes:
        name: name of the scenario's file without its suffix.
        code: exit code of the test.
        summary: what was checked or written.
        details: problems, one line each.
        seconds: wall time (s).
        accept: the scenario file if `--update` would accept the run as new reference; else "".
    """

    name: str
    code: int
    summary: str = ""
    details: tuple[str, ...] = ()
    seconds: float = 0.0
    accept: str = ""


#: runs a `cosim` command, given by its words, in a separate process and returns the exit code and
#: standard error
CommandRunner = Callable[[Sequence[str]], subprocess.CompletedProcess[str]]


def run_in_new_process(words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Run a `cosim` command in a new process."""
    command = [sys.executable, "-m", "cosim", *words]
    return subprocess.run(  # noqa: S603
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )


@dataclass(frozen=True)
class Regression:
    """Regression test of a scenario file.

    Attributes:
        file: the scenario file.
        directory: output directory.
        update: the reference is written again.
        run_command: runs commands of `cosim`.
    """

    file: Path
    directory: Path
    update: bool
    run_command: CommandRunner = run_in_new_process

    def run(self) -> RegressionOutcome:
        """Run the scenario in a separate process, and check its results or update the reference."""
        began = time.perf_counter()
        return replace(self._run(), seconds=time.perf_counter() - began)

    def _run(self) -> RegressionOutcome:
        from ..report.runs import read_run

        done = self.run_command(
            ["run", str(self.file), "--no-report", "--output-dir", str(self.directory)]
        )
        if done.returncode < 0:
            return RegressionOutcome(
                self.file.stem,
                1,
                "did not run to its end",
                (f"cosim run: ended by signal {-done.returncode}",),
            )
        if done.returncode not in (0, 3):
            report = (
                self._write_report()
                if done.returncode == 1 and (self.directory / "result.csv").is_file()
                else []
            )
            details = (*done.stderr.splitlines(), *report)
            summary = "was refused" if done.returncode == 2 else "did not run to its end"
            return RegressionOutcome(self.file.stem, done.returncode, summary, details)
        try:
            result = read_run(self.directory)
            run = _FinishedRun(result, result.metadata["scenario"], self.file.parent)
            outcome = self._update_reference(run) if self.update else self._compare(run)
        except CosimError as error:
            return RegressionOutcome(
                self.file.stem,
                error.exit_code,
                "cannot be compared",
                tuple(str(error).splitlines()),
            )
        ending = (
            "" if run.result.crashed else run.result.termination
        )  # a crash is one of the details
        outdated = [line for line in done.stderr.splitlines() if OTHER_VERSION in line]
        summary = "; ".join(filter(None, (outcome.summary, ending)))
        return replace(outcome, summary=summary, details=(*outdated, *outcome.details))

    def _compare(self, run: _FinishedRun) -> RegressionOutcome:
        from ..api.reference_comparison import reference_changes
        from ..results.comparison import compare, needed_share

        failed = run.failed_checks()
        counts = [(len(run.failed_checks(checks_only=True)), len(run.checks), "check")]
        notes, accept = list[str](), ""
        if run.scenario.get("reference"):
            compared = (run.result, run.reference, run.tolerances)
            comparison = compare(*compared)
            if comparison.passed:
                notes = [f"{needed_share(*compared):.0%} of the tolerances"]
            notes += run.later_rows()
            counts.append((len(comparison.failures), len(comparison.verdicts), "signal"))
            if not comparison.passed:
                reason = run.scenario["reference"].get("reason")
                accept = "" if failed else str(self.file)
                failed += [
                    *str(comparison).splitlines(),
                    (
                        'tube: the reference plus and minus its tolerances (key "reference" of the '
                        "scenario)"
                    ),
                    *([f"reason of the tolerances: {reason}"] if reason else []),
                    *filter(None, [reference_changes(run.result, run.reference_path, run.folder)]),
                    f"see {run.draw_tubes(comparison, self.directory / 'tubes.png')}",
                ]
        if failed:
            failed += self._write_report(
                *(["--reference", str(self.file)] if run.scenario.get("reference") else [])
            )
        return RegressionOutcome(
            self.file.stem,
            3 if failed else 0,
            _summarize(counts, notes),
            tuple(failed),
            accept=accept,
        )

    def _write_report(self, *options: str) -> list[str]:
        """Write the report of the run in a separate process, and return a line that names it."""
        done = self.run_command(["report", str(self.directory), *options])
        return (
            [f"see {self.directory / 'report.html'}"]
            if done.returncode == 0
            else [f"no report: {done.stderr.strip()}"]
        )

    def _update_reference(self, run: _FinishedRun) -> RegressionOutcome:
        from ..results.reference import write_reference

        if failed := run.failed_checks():
            return RegressionOutcome(
                self.file.stem, 3, "a failed run becomes no reference", tuple(failed)
            )
        written = write_reference(run.result, run.reference_path, run.tolerances)
        size = run.reference_path.stat().st_size / 1000
        amount = f"{count_noun(len(written), 'signal')}, {count_noun(len(written.time), 'row')}"
        return RegressionOutcome(
            self.file.stem, 0, f"{amount}, {size:.0f} kB in {run.reference_path}"
        )


def _summarize(counts: Collection[tuple[int, int, str]], notes: Sequence[str]) -> str:
    """Return the numbers of checks and signals, and notes on the comparison.

    Each count is (number of failures, number of all, noun).
    """
    ending = f" ({'; '.join(notes)})" if notes else ""
    if not any(failed for failed, _, _ in counts):
        return ", ".join(count_noun(number, noun) for _, number, noun in counts) + ending
    parts = (
        f"{failed} of {count_noun(number, noun)} failed"
        if failed
        else f"{count_noun(number, noun)} passed"
        for failed, number, noun in counts
    )
    return ", ".join(parts) + ending


def accept_command(scenarios: Sequence[str]) -> str:
    """Return a line with the command that makes the runs of scenarios their references."""
    files = " ".join(shlex.quote(os.path.relpath(each)) for each in scenarios)
    runs = "this run" if len(scenarios) == 1 else "these runs"
    return f"if the change is meant, make {runs} the reference: cosim regress --update {files}"


@dataclass(frozen=True)
class _FinishedRun:
    """Result of a run, its scenario as it was run, and the folder of the scenario's file."""

    result: Result
    scenario: Mapping[str, Any]
    folder: Path

    @property
    def checks(self) -> list[dict[str, Any]]:
        checks: list[dict[str, Any]] = self.scenario.get("checks", [])
        return checks

    def failed_checks(self, checks_only: bool = False) -> list[str]:
        """Return the failed checks, after the crash that ended the run early.

        `checks_only` leaves out the crash.
        """
        from ..results.checks import evaluate_all_checks

        kpis = {
            name: math.nan if value is None else value for name, value in self.result.kpis.items()
        }
        crash = [self.result.termination] if self.result.crashed and not checks_only else []
        units = self.result.metadata.get("kpi_units") or {}
        return crash + [
            outcome.text(units)
            for outcome in evaluate_all_checks(kpis, self.checks)
            if not outcome.passed
        ]

    @property
    def reference_path(self) -> Path:
        return self.folder / str(self.scenario["reference"]["file"])

    @cached_property
    def tolerances(self) -> dict[str, Tolerance]:
        from ..results.tolerance_tube import Tolerance

        return {
            pattern: Tolerance(**tolerance)
            for pattern, tolerance in self.scenario["reference"]["tolerances"].items()
        }

    @cached_property
    def reference(self) -> Result:
        from ..results import Result

        if not self.reference_path.is_file():
            raise InputError(
                f'the reference "{self.reference_path}" does not exist: `cosim regress --update` '
                "writes it"
            )
        return Result.from_csv(self.reference_path)

    def later_rows(self) -> Iterator[str]:
        """Yield a note if the run continues after the end of the reference."""
        from ..results.tolerance_tube import time_tolerance

        own, expected = self.result.time, self.reference.time
        if own.size and expected.size and own[-1] > expected[-1] + time_tolerance(expected):
            yield f"the reference ends at {expected[-1]:g} s"

    def draw_tubes(self, comparison: Comparison, path: Path) -> Path:
        """Draw the worst signals in their tubes to a file and return its path."""
        from ..report.comparison_figures import draw_tubes
        from ..report.figures import draw_figure, save_figure

        arguments = {
            "reference": self.reference,
            "tolerances": self.tolerances,
            "comparison": comparison,
        }
        save_figure(draw_figure(self.result, "tubes", draw_tubes, arguments), path)
        return path


T = TypeVar("T")

#: makes, for a number of threads, the context in which commands can be run
CommandContext = Callable[[int], AbstractContextManager[CommandRunner]]


def new_processes(_threads: int) -> AbstractContextManager[CommandRunner]:
    """Return a context in which each command runs in a new process."""
    return nullcontext(run_in_new_process)


def run_regressions(
    paths: Iterable[Path],
    update: bool,
    output_dir: Path,
    jobs: int,
    commands: CommandContext = new_processes,
) -> Iterator[RegressionOutcome]:
    """Run all scenarios that have checks or a reference, and yield their outcomes in order.

    Args:
        paths: Scenario files, names of shipped scenarios, and folders of scenario files.
        update: Write the references instead of comparing with them.
        output_dir: Folder of the folders of results.
        jobs: Number of scenarios that run at a time.
        commands: Makes the context in which `cosim run` is called.

    Raises:
        InputError: There is no such scenario, or two files have the same name.
    """
    expected = ("reference",) if update else EXPECTATION_KEYS
    files = [file for file in find_scenario_files(paths) if has_keys(file, expected)]
    if not files:
        raise InputError(
            'found no scenario with a "reference" (or, without --update, with "checks")'
        )
    check_unique_names(files)
    with commands(min(jobs, len(files))) as run_command:
        work = [Regression(file, output_dir / file.stem, update, run_command).run for file in files]
        yield from run_in_parallel(work, jobs)


def default_folder() -> Path:
    """Return the folder scenarios/ here if it exists, else that of the shipped scenarios."""
    folder = Path("scenarios")
    return folder if folder.is_dir() else resources.root() / folder


def find_scenario_files(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the scenario files for files, names of shipped scenarios and folders.

    Raises:
        InputError: if a file does not exist, a folder has no scenarios, or a name is that of a
            folder and of a shipped scenario.
    """
    for path in paths:
        if not path.is_dir():
            yield find_scenario(path)
        elif str(path) in resources.shipped_names("scenarios/*.json"):
            shipped = resources.root() / "scenarios" / f"{path}.json"
            raise InputError(
                f'"{path}" is a folder here and a shipped scenario: write {path.absolute()} or '
                f"{shipped}"
            )
        elif files := sorted(path.glob("*.json")):
            yield from files
        else:
            raise InputError(f'the folder "{path}" contains no scenario (*.json)')


def check_unique_names(files: Iterable[Path]) -> None:
    """Raise InputError if two files have the same name.

    The results of both would have the same folder.
    """
    counts = Counter(file.stem for file in files)
    if repeated := [name for name, count in counts.items() if count > 1]:
        raise InputError(
            [
                (
                    f'{counts[name]} scenarios are called "{name}.json": their results would go to '
                    "one folder"
                )
                for name in repeated
            ]
        )


def run_in_parallel(work: Sequence[Callable[[], T]], jobs: int) -> Iterator[T]:
    """Call functions on `jobs` threads and yield their return values, in order.

    After an interrupt, functions that have not started are not called.
    """
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(jobs)
    try:
        yield from pool.map(lambda function: function(), work)
    finally:
        pool.shutdown(cancel_futures=True)
