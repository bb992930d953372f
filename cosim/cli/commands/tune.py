"""`cosim tune`: search for parameters that minimise a KPI."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import CosimError, InputError
from ...core.text import count_noun
from ...report.tables import print_table
from .. import study_options
from ..messages import print_json
from ..options import complete_study, flag_option, json_option, output_dir_option

if TYPE_CHECKING:
    from ...studies.execution.run_store import RunStore
    from ...studies.tune import Trial, Tuning


@click.command()
@click.argument("tuning", metavar="TUNE", shell_complete=complete_study)
@output_dir_option
@json_option(
    "the object of best.json, with failure, the reason why no point is feasible, or null; with "
    "--worst that of worst.json"
)
@flag_option(
    "--worst",
    help="Search for the run that breaks a controller; TUNE is then a file of such a search.",
)
@study_options.study_options
def command(tuning: str, output_dir: Path | None, as_json: bool, worst: bool, **study: Any) -> int:
    """Find the parameters that minimise a KPI, or with --worst the run that breaks a controller.

    TUNE is a JSON file or the name of a shipped tuning. Writes trials.csv (all evaluated points)
    and best.json to the output directory. Called again, the command continues an interrupted
    tuning. Exit code 0: a point was found; 1: a run failed at every point; 2: the tuning was
    refused; 3: no point meets the constraints, or none has a value; 130: interrupted.

    --worst searches wind, waves, faults and seeds for the run that misses its checks the most.
    Writes trials.csv, worst.json and the worst runs as scenarios to the output directory. Exit code
    0: the checks of all runs passed; 3: one failed.
    """
    if worst:
        return _find_worst(tuning, output_dir, as_json, **study)
    from ...studies.tune import Tuning

    loaded = Tuning.from_file(tuning, study.pop("max_runs"))
    folder = output_dir or Path("runs") / loaded.spec.name
    with study_options.open_run_store(folder, study.pop("retry_failed")) as run_store:
        return _run_tuning(loaded, run_store, folder, as_json, **study)


def _run_tuning(
    tuning: Tuning,
    run_store: RunStore,
    folder: Path,
    as_json: bool,
    workers: int | None,
    scheduler: str | None,
) -> int:
    from ...studies.tune import describe_best, write_tuning_files

    try:
        with study_options.running_study(
            tuning.study, tuning.spec.max_runs, workers, scheduler
        ) as (runner, progress):
            tuning.run(run_store, runner, progress)
    except (CosimError, KeyboardInterrupt) as error:
        if tuning.trials and not isinstance(error, InputError):
            write_tuning_files(tuning, folder)
        raise
    best = write_tuning_files(tuning, folder)
    failure = None if best.feasible else _failure_text(tuning, best)
    if as_json:
        print_json({**describe_best(tuning, best), "failure": failure})
    else:
        _print_best(tuning, best, folder, failure)
    if best.feasible:
        return 0
    return 1 if best.failure else 3


def _find_worst(
    file: str,
    output_dir: Path | None,
    as_json: bool,
    workers: int | None,
    scheduler: str | None,
    max_runs: int,
    retry_failed: bool,
) -> int:
    """Search for the run that breaks a controller."""
    from ...studies.worst_case import WorstCase, describe_worst_case, write_worst_case_files

    search = WorstCase.from_file(file, max_runs)
    folder = output_dir or Path("runs") / search.spec.name
    with (
        study_options.open_run_store(folder, retry_failed) as run_store,
        study_options.running_study(search.study, search.spec.max_runs, workers, scheduler) as (
            runner,
            progress,
        ),
    ):
        search.run(run_store, runner, progress)
    files = write_worst_case_files(search, folder)
    if as_json:
        print_json({**describe_worst_case(search), "files": [str(each) for each in files]})
    else:
        shown = search.counterexamples or [search.worst]
        rows = []
        for each in shown:
            values = [f"{value:.6g}" for value in each.parameters.values()]
            rows.append([f"{each.severity:.3g}", *values])
        print_table(["severity", *shown[0].parameters], rows)
        for attempt, path in zip(shown, files, strict=False):
            click.echo(f"{attempt.reason}\n  cosim run {path}")
        broken = sum(not each.passed for each in search.attempts)
        verdict = (
            f"a check of {broken} failed"
            if files
            else f"all checks passed; closest: {shown[0].reason}"
        )
        click.echo(f"{count_noun(len(search.attempts), 'run')}: {verdict}")
    return 3 if files else 0


def _print_best(tuning: Tuning, best: Trial, folder: Path, failure: str | None) -> None:
    from ...studies.summary.unsuccessful_runs import format_run_command

    first = tuning.trials[0]
    rows = [
        [name, f"{first.parameters[name]:.6g}", f"{value:.6g}"]
        for name, value in best.parameters.items()
    ]
    rows.append(
        [
            tuning.objective.text,
            *("-" if math.isnan(each.value) else f"{each.value:.6g}" for each in (first, best)),
        ]
    )
    print_table(["", "start", "best"], rows)
    if failure:
        click.echo(failure, err=True)
    settings = {**tuning.spec.settings, **tuning.spec.cases[0], **tuning.settings(best.parameters)}
    click.echo(
        f"{count_noun(len(tuning.trials), 'point')} evaluated; trials.csv and best.json in {folder}"
    )
    click.echo(format_run_command(tuning.study_file.scenario, settings))


def _failure_text(tuning: Tuning, best: Trial) -> str:
    """Return the reason why even the best point is not feasible."""
    if best.failure:
        return f"a run failed at every point; at the first one: {best.failure}"
    if not best.value < math.inf:
        return (
            f"{tuning.objective.text} has no {'finite ' if best.value == math.inf else ''}value at "
            "any point"
        )
    return f"no point meets the constraints: the best one violates them by {best.violation:.3g}"
