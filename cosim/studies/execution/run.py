"""One run of a study in a separate, supervised child process."""

import json
import os
import signal
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from ...components.fmi import FmuFile
from ...core.errors import CosimError, InputError, Problem
from ...core.json_values import parse_object
from ...engine.plan_run import simulating
from ...process.float_mode import default_float_mode
from ...process.journal import EXIT_CODE, Phase, current_journal
from ...process.run_files import keeping_run_files
from ...process.supervisor import SupervisedOutcome, run_supervised
from ...results import Result
from ...results.checks import evaluate_all_checks
from ...results.kpi import evaluate_kpis, kpi_units
from ...scenario import PreparedRun, load
from .job import Job, Record, StudyContext

#: length kept of the text that components printed in a failed run (bytes)
_MAX_OUTPUT = 2000
#: longest time of a timer (s); the system accepts no more than its integers can hold
_LONGEST_TIMER = 1e9

#: unpacked FMUs by path
FmuFiles = Mapping[Path, FmuFile]


class ReplayRequest(NamedTuple):
    """Request for the replay of a run.

    Attributes:
        title: title of the page.
        page: path of the page.
        checks: checks that the run should pass.
    """

    title: str
    page: str
    checks: list[dict[str, Any]]


def supervised_run(
    context: StudyContext, job: Job, fmu_files: FmuFiles, replay: ReplayRequest | None = None
) -> Record:
    """Run a job in a child process and return its record, whatever happens to the child.

    Args:
        context: properties that all runs of the study share.
        job: the run.
        fmu_files: FMUs that are unpacked already.
        replay: page to which the 3-D replay of the run is written; None: none.

    The output of the child goes to this process's standard error, which must be a file.
    """
    work = _run_job if replay is None else partial(_run_with_replay, replay)
    began = time.monotonic()
    os.ftruncate(2, 0)
    with tempfile.TemporaryFile("w+") as reply:
        outcome = run_supervised(
            lambda: _run_reporting_failure(reply, lambda: work(context, job, fmu_files, reply))
        )
        record = _make_record(context, job, outcome, reply)
    record = replace(record, seconds=round(time.monotonic() - began, 4))
    if not record.failure:
        return record
    begin = max(0, os.fstat(2).st_size - _MAX_OUTPUT)
    output = os.pread(2, _MAX_OUTPUT, begin).decode("utf-8", "replace")
    return replace(record, output=output)


def supervised_check(context: StudyContext, job: Job, fmu_files: FmuFiles) -> list[Problem]:
    """Prepare a job in a child process and return the problems for which it cannot be run.

    Raises:
        ComponentError: if the child process crashes.
    """
    with tempfile.TemporaryFile("w+") as reply:
        outcome = run_supervised(
            lambda: _run_reporting_failure(
                reply, lambda: _check_job(context, job, fmu_files, reply)
            )
        )
        if outcome.failure:
            raise outcome.failure
        reply.seek(0)
        return [Problem(message, where) for message, where in json.load(reply)]


# -- in the child
# ----------------------------------------------------------------------------------------


def _run_reporting_failure(reply: IO[str], work: Callable[[], None]) -> int:
    """Call `work` and return an exit code; write the text of an exception to `reply`.

    The forked process first gets a random state of its own: otherwise unseeded noise would be the
    same in all runs.
    """
    np.random.seed()  # noqa: NPY002  # the global state, which components may use
    try:
        work()
        return 0
    except CosimError as error:
        _write_reply(reply, {"failure": str(error)})
        return error.exit_code
    except Exception as error:
        _write_reply(reply, {"failure": f"internal error: {type(error).__name__}: {error}"})
        return 70


def _write_reply(reply: IO[str], value: Any) -> None:
    reply.seek(0)
    reply.truncate()
    json.dump(value, reply)
    reply.flush()


def _run_job(context: StudyContext, job: Job, fmu_files: FmuFiles, reply: IO[str]) -> None:
    _set_deadline(context)
    prepared = _prepare_job(context, job, fmu_files)
    with (
        keeping_run_files(Path(tempfile.gettempdir()) / "run"),
        simulating(prepared.plan) as outcome,
    ):
        if outcome.failure:
            raise outcome.failure
        result, functions = Result(outcome.recording, metadata=prepared.origin), prepared.kpis()
        kpis = evaluate_kpis(result, functions)
        _write_results(reply, kpis, kpi_units(functions, kpis, result.units))


def _run_with_replay(
    replay: ReplayRequest, context: StudyContext, job: Job, fmu_files: FmuFiles, reply: IO[str]
) -> None:
    from ...api import Simulation
    from ...report.replay import write_judged_replay

    _set_deadline(context)
    simulation = Simulation(lambda _: _prepare_job(context, job, fmu_files))
    with keeping_run_files(Path(tempfile.gettempdir()) / "run"), default_float_mode(), simulation:
        result = simulation.execute()
        named = replace(result, metadata={**result.metadata, "name": replay.title})
        write_judged_replay(
            named, evaluate_all_checks(result.kpis, replay.checks), Path(replay.page)
        )
        if result.failure:
            raise result.failure
        _write_results(reply, result.kpis, result.metadata["kpi_units"])


def _set_deadline(context: StudyContext) -> None:
    if context.deadline:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, min(context.deadline, _LONGEST_TIMER))


def _prepare_job(context: StudyContext, job: Job, fmu_files: FmuFiles) -> PreparedRun:
    shared = {path: file.share() for path, file in fmu_files.items()}
    return load(
        context.scenario, job.settings, settings_folder=context.scenario.parent, loaded_fmus=shared
    )


def _write_results(reply: IO[str], kpis: Mapping[str, Any], units: Mapping[str, str]) -> None:
    """Write the results and record that in the journal: later failures no longer count."""
    known_units = {name: unit for name, unit in units.items() if unit}
    _write_reply(reply, {"kpis": kpis, "units": known_units})
    signal.setitimer(signal.ITIMER_REAL, 0)
    if journal := current_journal():
        journal[EXIT_CODE] = 0
        journal.enter_phase(Phase.RESULTS_WRITTEN)


def _check_job(context: StudyContext, job: Job, fmu_files: FmuFiles, reply: IO[str]) -> None:
    problems: list[Problem] = []
    try:
        _prepare_job(context, job, fmu_files).free()
    except InputError as error:
        problems = list(error.problems)
    _write_reply(
        reply, [(problem.message, _without_root(context, problem.where)) for problem in problems]
    )


# -- in the supervisor
# ----------------------------------------------------------------------------------------


def _make_record(
    context: StudyContext, job: Job, outcome: SupervisedOutcome, reply: IO[str]
) -> Record:
    if outcome.failure:
        cause = str(outcome.failure)
        # the text for a missed deadline does not name the present call
        if context.deadline and f"signal {signal.SIGALRM:d} " in outcome.failure.reason:
            cause = f"the run did not end within {context.deadline:g} s"
        return Record(job.key, failure=_without_root(context, cause))
    reply.seek(0)
    try:
        answer = parse_object(reply.read())
        record = Record.from_json(json.dumps({"key": job.key, **answer}))
    except ValueError:  # foreign code has written to the file
        return Record(job.key, failure="the process of the run left no valid result")
    return replace(record, failure=_without_root(context, record.failure))


def _without_root(context: StudyContext, text: str) -> str:
    """Return a text with paths relative to the study's root, so that all machines give the same."""
    return text.replace(f"{context.root}/", "")
