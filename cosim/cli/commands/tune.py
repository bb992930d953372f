"""`cosim tune`: search for parameters that minimise a KPI."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import CosimError, InputError
from ...core.text import count_noun
from .. import study_options
from ..completion import complete_study
from ..messages import print_json
from ..output_options import json_option

if TYPE_CHECKING:
    from ...studies.execution.run_store import RunStore
    from ...studies.tune import Trial, Tuning


@click.command()
@click.argument("tuning", metavar="TUNE", shell_complete=complete_study)
@click.option("--output-dir", type=click.Path(path_type=Path), help="Folder for the results; default: runs/NAME.")
@json_option("the object of best.json, with failure, the reason why no point is feasible, or null")
@study_options.study_options
def command(tuning: str, output_dir: Path | None, as_json: bool, **study: Any) -> int:
    """Find the parameters that minimise a KPI.

    TUNE is a JSON file or the name of a shipped tuning. Writes trials.csv (all evaluated points) and best.json to the output
    directory. Called again, the command continues an interrupted tuning. Exit code 0: a point was found; 1: a run failed at
    every point; 2: the tuning was refused; 3: no point meets the constraints, or none has a value; 130: interrupted.
    """
    from ...studies.tune import Tuning

    loaded = Tuning.from_file(tuning, study.pop("max_runs"))
    folder = output_dir or Path("runs") / loaded.spec.name
    with study_options.open_run_store(folder, study.pop("retry_failed")) as run_store:
        return _run_tuning(loaded, run_store, folder, as_json, **study)


def _run_tuning(
    tuning: Tuning, run_store: RunStore, folder: Path, as_json: bool, workers: int | None, scheduler: str | None
) -> int:
    from ...process.supervisor import interrupt_on_termination
    from ...studies.summary.tuning_files import describe_best, write_tuning_files

    try:
        with (
            interrupt_on_termination(),
            study_options.show_progress(tuning.spec.max_runs) as progress,
            study_options.create_runner(tuning.study, workers, scheduler) as runner,
        ):
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
    return 0 if best.feasible else 1 if best.failure else 3


def _print_best(tuning: Tuning, best: Trial, folder: Path, failure: str | None) -> None:
    from ...studies.summary.sweep_files import format_run_command

    first = tuning.trials[0]
    rows = [[name, f"{first.parameters[name]:.6g}", f"{value:.6g}"] for name, value in best.parameters.items()]
    rows.append([tuning.objective.text, f"{first.value:.6g}", f"{best.value:.6g}"])
    study_options.print_table(["", "start", "best"], rows)
    if failure:
        click.echo(failure, err=True)
    settings = {**tuning.spec.settings, **tuning.spec.cases[0], **tuning.settings(best.parameters)}
    click.echo(f"{count_noun(len(tuning.trials), 'point')} evaluated; trials.csv and best.json in {folder}")
    click.echo(format_run_command(tuning.study_file.scenario, settings))


def _failure_text(tuning: Tuning, best: Trial) -> str:
    """Return the reason why even the best point is not feasible."""
    if best.failure:
        return f"a run failed at every point; at the first one: {best.failure}"
    if not best.value < math.inf:
        return f"the value of {tuning.objective.text} is {best.value:g} at every point"
    return f"no point meets the constraints: the best one violates them by {best.violation:.3g}"
