"""Functions that run studies from Python.

`cosim.sweep`, `cosim.tune`, `cosim.worst_case` and `cosim.regress`.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..api.arguments import expect, is_integer
from ..core.resources import available_processors
from ..core.size_limits import MAX_RUNS
from .execution.run_store import RunStore
from .execution.worker_pool import LocalRunner
from .regression import RegressionOutcome, default_folder, run_regressions
from .study import Study, StudySource
from .summary.sweep_files import SweepSummary, write_sweep_files
from .sweep import Sweep, SweepRow
from .tune import Trial, Tuning, write_tuning_files
from .worst_case import Attempt, WorstCase, write_worst_case_files


@dataclass(frozen=True)
class SweepResult:
    """Finished sweep.

    Attributes:
        rows: The runs in the order of the design, each with `point` (labels and settings), `record`
            (KPIs or failure) and `passed`.
        summary: Statistics of the KPIs and success rates, by groups of runs.
        folder: Folder of the files that `cosim sweep` writes.
    """

    rows: Sequence[SweepRow]
    summary: SweepSummary
    folder: Path

    @property
    def success_rate(self) -> float:
        """Share of the runs that meet all criteria."""
        return sum(row.passed for row in self.rows) / len(self.rows)

    def to_dataframe(self) -> Any:
        """Return a pandas DataFrame with a row for each run.

        Labels of the factors, `passed`, `failure` and all KPIs.

        Raises:
            InputError: The package pandas is not installed.
        """
        from ..results.parquet_files import require_pandas

        rows = [
            {
                **row.point.labels,
                "passed": row.passed,
                "failure": row.record.failure,
                **row.record.kpis,
            }
            for row in self.rows
        ]
        return require_pandas().DataFrame(rows)


@dataclass(frozen=True)
class TuningResult:
    """Finished tuning.

    Attributes:
        best: The best point, with its `parameters`, its `value` and whether it is `feasible`.
        trials: All evaluated points.
        folder: Folder of the files that `cosim tune` writes.
    """

    best: Trial
    trials: Sequence[Trial]
    folder: Path


@dataclass(frozen=True)
class WorstCaseResult:
    """Finished search for the worst case.

    Attributes:
        worst: The worst run, with its `parameters`, `severity`, `reason` and whether it `passed`.
        attempts: All runs.
        counterexamples: Scenario files of the worst runs that miss a check.
    """

    worst: Attempt
    attempts: Sequence[Attempt]
    counterexamples: Sequence[Path]


def sweep(
    study: StudySource,
    *,
    output_dir: str | Path | None = None,
    workers: int | None = None,
    max_runs: int = MAX_RUNS,
    retry_failed: bool = False,
) -> SweepResult:
    """Run a scenario at many points, as `cosim sweep`.

    Runs that an earlier call has finished in the same folder are not repeated.

    Args:
        study: Path of a sweep file, name of a shipped sweep, or the content of a sweep file as a
            dict.
        output_dir: Folder of the results; None: runs/NAME.
        workers: Number of runs at a time; None: one for each processor.
        max_runs: Largest accepted number of runs.
        retry_failed: Repeat the runs that failed in an earlier call.

    Returns:
        All runs and their statistics. A run that failed raises no error.

    Raises:
        InputError: The sweep cannot be run, or an argument is of a wrong type.
    """
    _check_arguments(study, output_dir, workers, max_runs)
    loaded = Sweep.from_file(study, max_runs)
    folder = _folder(output_dir, loaded.study)
    with RunStore(folder, retry_failed) as run_store:
        if any(key not in run_store for key in loaded.keys):
            with _runner(loaded.study, workers) as runner:
                loaded.run(run_store, runner, lambda _: None)
        loaded.check_names(run_store)
        return SweepResult(
            list(loaded.rows(run_store)),
            write_sweep_files(loaded, run_store, folder, parquet=False),
            folder,
        )


def tune(
    study: StudySource,
    *,
    output_dir: str | Path | None = None,
    workers: int | None = None,
    max_runs: int = MAX_RUNS,
    retry_failed: bool = False,
) -> TuningResult:
    """Find the parameters that minimise a KPI, as `cosim tune`.

    Args:
        study: Path of a tuning file, name of a shipped tuning, or the content of a tuning file as a
            dict.
        output_dir: Folder of the results; None: runs/NAME.
        workers: Number of runs at a time; None: one for each processor.
        max_runs: Largest accepted number of runs.
        retry_failed: Repeat the runs that failed in an earlier call.

    Returns:
        The best point and all evaluated points.

    Raises:
        InputError: The tuning cannot be run, or an argument is of a wrong type.
    """
    _check_arguments(study, output_dir, workers, max_runs)
    loaded = Tuning.from_file(study, max_runs)
    folder = _folder(output_dir, loaded.study)
    with RunStore(folder, retry_failed) as run_store, _runner(loaded.study, workers) as runner:
        best = loaded.run(run_store, runner, lambda _: None)
    write_tuning_files(loaded, folder)
    return TuningResult(best, loaded.trials, folder)


def worst_case(
    study: StudySource,
    *,
    output_dir: str | Path | None = None,
    workers: int | None = None,
    max_runs: int = MAX_RUNS,
    retry_failed: bool = False,
) -> WorstCaseResult:
    """Search for the run that breaks a controller, as `cosim tune --worst`.

    Args:
        study: Path of the file of a search, name of a shipped search, or the content of such a file
            as a dict.
        output_dir: Folder of the results; None: runs/NAME.
        workers: Number of runs at a time; None: one for each processor.
        max_runs: Largest accepted number of runs.
        retry_failed: Repeat the runs that failed in an earlier call.

    Returns:
        The worst run, and the runs that miss a check.

    Raises:
        InputError: The search cannot be run, or an argument is of a wrong type.
    """
    _check_arguments(study, output_dir, workers, max_runs)
    search = WorstCase.from_file(study, max_runs)
    folder = _folder(output_dir, search.study)
    with RunStore(folder, retry_failed) as run_store, _runner(search.study, workers) as runner:
        search.run(run_store, runner, lambda _: None)
    return WorstCaseResult(search.worst, search.attempts, write_worst_case_files(search, folder))


def regress(
    scenarios: str | Path | Sequence[str | Path] = (),
    *,
    update: bool = False,
    output_dir: str | Path = "runs",
    jobs: int | None = None,
) -> list[RegressionOutcome]:
    """Run all scenarios with checks or a reference, and compare their results, as `cosim regress`.

    Args:
        scenarios: Scenario files, names of shipped scenarios, and folders; none: the folder
            scenarios/.
        update: Write the references instead of comparing with them.
        output_dir: Folder of the results.
        jobs: Number of scenarios that run at a time; None: one for each processor.

    Returns:
        The outcome of each scenario, with `code` (0: passed, otherwise the exit code of the
        command), `summary` and `details`.

    Raises:
        InputError: There is no such scenario, two files have the same name, or an argument is of a
            wrong type.
    """
    given = [scenarios] if isinstance(scenarios, str | os.PathLike) else scenarios
    accepted = isinstance(given, Sequence) and all(
        isinstance(each, str | os.PathLike) for each in given
    )
    expect(
        "scenarios",
        scenarios,
        accepted,
        "a path, the name of a shipped scenario, or a list of them",
    )
    expect("output_dir", output_dir, isinstance(output_dir, str | os.PathLike), "a path")
    _check_count("jobs", jobs)
    paths = [Path(each) for each in given] or [default_folder()]
    return list(run_regressions(paths, update, Path(output_dir), jobs or available_processors()))


def _folder(output_dir: str | Path | None, study: Study) -> Path:
    return Path(output_dir) if output_dir else Path("runs") / study.spec.name


def _runner(study: Study, workers: int | None) -> LocalRunner:
    return LocalRunner(study.context, workers or available_processors())


def _check_arguments(study: Any, output_dir: Any, workers: Any, max_runs: Any) -> None:
    accepted = isinstance(study, str | os.PathLike | Mapping)
    expect(
        "study", study, accepted, "the path of a study file, the name of a shipped study, or a dict"
    )
    expect(
        "output_dir",
        output_dir,
        output_dir is None or isinstance(output_dir, str | os.PathLike),
        "a path",
    )
    _check_count("workers", workers)
    _check_count("max_runs", max_runs)


def _check_count(name: str, value: Any) -> None:
    expect(name, value, value is None or (is_integer(value) and value > 0), "a positive number")
