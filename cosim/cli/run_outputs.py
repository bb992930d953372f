"""Files and text that `cosim run` produces from a run that has ended or failed."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import click

from ..core.errors import CosimError, OutputError
from ..core.text import count_noun
from ..process.journal import STEP_COUNT
from . import current_command_line, exit_code_of, report_error, supervision
from .messages import print_json, print_log
from .unfinished_runs import writing_results

if TYPE_CHECKING:
    from ..engine.pacer import LatePolicy
    from ..process.supervisor import SupervisedOutcome
    from ..results import Result
    from ..results.checks import CheckOutcome
    from ..scenario import PreparedRun

_LATENESS_LABELS = {"max": "max_lateness", "mean": "mean_lateness", "99 %": "lateness_99_percent"}


@dataclass(frozen=True)
class RunOptions:
    """Options of `cosim run`, apart from those of its supervision and its live view."""

    scenario: str
    output_dir: Path | None
    stop_time: str | None
    step_size: str | None
    settings: tuple[str, ...]
    real_time: float | None
    late: LatePolicy
    parquet: bool
    mcap: bool
    no_report: bool
    as_json: bool
    isolation: Literal["fmu", "none"]
    sandbox: bool

    def output_folder(self, name: str) -> Path:
        """Return the output directory of the scenario called `name`, as messages show it."""
        return self.output_dir or Path("runs") / name


@dataclass(frozen=True)
class RunOutcome:
    """A run that has ended, and the outputs made from it so far.

    Attributes:
        options: options of the command.
        prepared: the run as it was prepared.
        result: its result; after a failure, what was recorded until then.
        began: `time.perf_counter()` before the scenario was loaded (s).
        files: names of the files that the summary lists.
    """

    options: RunOptions
    prepared: PreparedRun
    result: Result
    began: float
    files: list[str] = field(default_factory=list)

    @property
    def shown_folder(self) -> Path:
        """The output directory as messages show it."""
        return self.options.output_folder(self.prepared.spec.name)

    @cached_property
    def folder(self) -> Path:
        """The output directory as an absolute path."""
        return self.shown_folder.absolute()

    @property
    def kpi_units(self) -> Mapping[str, str]:
        """Units of the KPIs by name."""
        return self.result.metadata.get("kpi_units") or {}

    @cached_property
    def checks(self) -> Sequence[CheckOutcome]:
        """Outcomes of the scenario's checks."""
        from ..api import evaluate_scenario_checks

        return evaluate_scenario_checks(self.prepared, self.result)


def write_outputs(outcome: RunOutcome) -> int:
    """Write, print and draw all outputs of a run, and return the exit code of the command."""
    result, options = outcome.result, outcome.options
    if failure := result.failure:
        code = _end_failed_run(outcome, failure)
    else:
        from ..process.run_files import remove_run_files, run_folder
        from ..results.result import write_run

        with writing_results(outcome.result, run_folder(), outcome.shown_folder):
            write_run(outcome.result, outcome.folder)
        remove_run_files()
        outcome.files.extend(("result.csv", "kpis.json", "run.json"))
        if not options.as_json:
            _print_kpis(outcome)
        if not options.no_report:
            _write_report(outcome)
        if not options.as_json:
            _print_summary(outcome)
        passed = not result.crashed and all(check.passed for check in outcome.checks)
        code = 0 if passed else 3
    if result.termination and not options.as_json:
        click.echo(result.termination)
    if options.parquet:
        result.to_parquet(outcome.folder / "result.parquet")
    if options.mcap:
        from ..report.scene import build_scene

        result.to_mcap(outcome.folder / "result.mcap", build_scene(result.metadata))
    if options.as_json and not failure:
        print_json(
            _summarize_run(result, outcome.checks, outcome.shown_folder, outcome.files, code)
        )
    return code


def _end_failed_run(outcome: RunOutcome, failure: BaseException) -> int:
    from ..process.run_files import remove_run_files, run_folder

    metadata = outcome.result.metadata
    metadata["failure"] = metadata["failure"] or str(failure)  # a KPI may have failed
    try:
        _write_partial_result(outcome.result, outcome.folder, outcome.shown_folder, run_folder())
        remove_run_files()
        if not isinstance(failure, KeyboardInterrupt):
            _report_failed_run(
                outcome.result, outcome.folder, outcome.options, exit_code_of(failure)
            )
    except CosimError as error:
        if isinstance(failure, OSError | OutputError):  # most likely the same cause
            raise
        report_error(error, current_command_line())
    return report_error(failure, current_command_line())


def _write_partial_result(
    partial: Result, folder: Path, shown_folder: Path, unfinished: Path | None
) -> None:
    """Write the rows recorded before a failure, if there are any; see `writing_results`."""
    from ..results.result import write_run

    if len(partial.time):
        with writing_results(partial, unfinished, shown_folder):
            write_run(partial, folder)
        rows = count_noun(len(partial.time), "row")
        click.echo(f"{rows} until t = {partial.time[-1]:g} s kept in {shown_folder}", err=True)


def _report_failed_run(partial: Result, folder: Path, options: RunOptions, exit_code: int) -> int:
    """Write the report of a run that failed, and print its summary for --json.

    Args:
        partial: what was recorded until the failure, already written.
        folder: the output directory.
        options: options of the command.
        exit_code: exit code of the command.

    Returns:
        The exit code.
    """
    from ..report.run_page import write_folder_report

    files = ["result.csv", "run.json"] if len(partial.time) else []
    if files and not options.no_report:
        try:
            write_folder_report(folder, folder / "report.html")
            files.append("report.html")
        except CosimError as error:
            click.echo(f"no report: {error}", err=True)
    if options.as_json:
        print_json(_summarize_run(partial, (), folder, files, exit_code))
    return exit_code


def save_after_crash(outcome: SupervisedOutcome, options: RunOptions) -> None:
    """Write the rows of a child process that crashed, was killed or was interrupted.

    A crash also has a report.

    The report is written by another supervised process, because it calls functions of the user.
    """
    from ..process.run_files import read_metadata, recover_recording
    from ..results import Result, RunMetadata
    from ..results.checks import warn_non_finite

    folder = outcome.journal.folder
    if folder is not None:
        failure = "interrupted" if outcome.interrupted else str(outcome.failure)
        metadata: RunMetadata = {
            **cast("RunMetadata", read_metadata(folder)),
            "macro_steps": outcome.journal[STEP_COUNT],
            "failure": failure,
        }
        recording = recover_recording(folder, outcome.row_count)
        if metadata.get("scenario", {}).get("non_finite") != "allow":
            print_log()
            metadata["non_finite"] = warn_non_finite(recording)
        partial = Result(recording, metadata=metadata)
        _write_partial_result(partial, folder.parent, folder.parent, folder)
        if outcome.failure:
            code = outcome.failure.exit_code
            supervision.run_supervised_command(
                lambda: _report_failed_run(partial, folder.parent, options, code)
            )


def _print_kpis(outcome: RunOutcome) -> None:
    """Print the table of KPIs; with --quiet, print only the failed checks."""
    if current_command_line().verbosity < 0:
        for check in outcome.checks:
            if not check.passed:
                click.echo(f"check failed: {check.text(outcome.kpi_units)}", err=True)
    from ..report.tables import print_kpis

    result, notes = outcome.result, outcome.result.metadata.get("kpi_notes", ())
    print_kpis(result.kpis, outcome.checks, outcome.kpi_units, notes=notes)


def _write_report(outcome: RunOutcome) -> None:
    """Write the figures and the report that shows them."""
    from ..report.run_page import write_report

    write_report(
        outcome.result, outcome.checks, _write_figures(outcome), outcome.folder / "report.html"
    )
    outcome.files.append("report.html")


def _write_figures(outcome: RunOutcome) -> Iterator[tuple[str, str]]:
    """Write the figures, and yield name and SVG text of each."""
    from matplotlib import artist

    from ..process.journal import calling_component
    from ..report.figures import draw_figure, figure_to_svg, save_figure

    # matplotlib lists all properties in the documentation of each class when it is imported; a
    # command does not show it, and it takes a twentieth of the processor time of a short run
    cast(Any, artist).kwdoc = str
    for name, function, arguments in outcome.prepared.figures():
        with calling_component(f'figure "{name}"', function.__name__):
            figure = draw_figure(outcome.result, name, function, arguments)
            save_figure(figure, outcome.folder / f"{name}.png")
            picture = figure_to_svg(figure)
        outcome.files.append(f"{name}.png")
        yield name, picture


def _print_summary(outcome: RunOutcome) -> None:
    result = outcome.result
    loop, simulated = result.timing["loop_seconds"], float(result.time[-1] - result.time[0])
    seconds = time.perf_counter() - outcome.began
    checks = _summarize_checks(outcome.checks, outcome.kpi_units)
    click.echo(
        f"\n{checks}{simulated:g} s simulated in {loop:.2f} s: {simulated / loop:.0f} times real "
        "time"
    )
    click.echo(f"{', '.join(outcome.files)} in {outcome.shown_folder} ({seconds:.1f} s in all)")
    if pacing := result.metadata["real_time"]:
        lateness = ", ".join(
            f"{label} {1e3 * pacing[key]:.3g} ms" for label, key in _LATENESS_LABELS.items()
        )
        late = f"{pacing['late_steps']} of {count_noun(pacing['steps'], 'step')} late"
        click.echo(f"paced to {pacing['factor']:g} times real time: {late}; lateness {lateness}")
    if events := result.metadata.get("live_events"):
        times = count_noun(len(events), "time")
        click.echo(
            f"values were set {times} while it ran: copy live_events of run.json into the "
            "scenario's events to repeat the run"
        )
    if current_command_line().verbosity > 0:
        for name, value in result.timing.items():
            click.echo(f"{name:24} {value:.3f}")


def _summarize_checks(checks: Sequence[CheckOutcome], units: Mapping[str, str]) -> str:
    """Return a line that says how many checks passed, and which ones failed.

    "" if there are none.
    """
    if not checks:
        return ""
    failed = "".join(f"\n  {check.text(units)}" for check in checks if not check.passed)
    passed = sum(check.passed for check in checks)
    return (
        f"{passed} of {count_noun(len(checks), 'check')} passed{failed and ', failed:'}{failed}\n"
    )


def _summarize_run(
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
