"""One run of a sweep, in a supervised child process of its own."""

from __future__ import annotations

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

from ...components.fmi import FmuFile
from ...core.errors import ComponentError, CosimError, InputError, Problem
from ...engine.run_loop import simulating
from ...process.journal import EXIT_CODE, Deadlines, Phase, current_journal
from ...process.run_files.folder import keeping_run_files
from ...process.supervisor import SupervisedOutcome, run_supervised
from ...results import Result
from ...results.kpi import evaluate_kpis
from ...scenario import PreparedRun, prepare
from .job import Job, Record, StudyContext

#: so much of what components printed is kept of a run that failed (bytes)
_MAX_OUTPUT = 2000

FmuFiles = Mapping[Path, FmuFile]


class ReplayRequest(NamedTuple):
    """The page that is to be made of a run."""

    title: str
    page: str


def supervised_run(order: StudyContext, job: Job, fmu_files: FmuFiles, replay: ReplayRequest | None = None) -> Record:
    """Run a job in a child process; what it prints goes to this process's standard error, which is a file.

    Whatever the run does, a record comes of it. With `replay` its 3-D replay is written.
    """
    work = _run_job if replay is None else partial(_run_with_replay, replay)
    began = time.monotonic()
    os.ftruncate(2, 0)
    with tempfile.TemporaryFile("w+") as reply:
        outcome = run_supervised(lambda: _run_reporting_failure(reply, lambda: work(order, job, fmu_files, reply)))
        record = _make_record(order, job, outcome, reply)
    record = replace(record, seconds=round(time.monotonic() - began, 4))
    return replace(record, output=_last_output()) if record.failure else record


def supervised_check(order: StudyContext, job: Job, fmu_files: FmuFiles) -> list[Problem]:
    """What keeps a job from being run, without running it. Raises ComponentError when that ends the process."""
    with tempfile.TemporaryFile("w+") as reply:
        outcome = run_supervised(lambda: _run_reporting_failure(reply, lambda: _check_job(order, job, fmu_files, reply)))
        if outcome.failure:
            raise outcome.failure
        reply.seek(0)
        return [Problem(message, where) for message, where in json.load(reply)]


# -- in the child ------------------------------------------------------------------------------------------------------------


def _run_reporting_failure(reply: IO[str], work: Callable[[], None]) -> int:
    """Do the work; what it raises becomes the reply."""
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


def _run_job(order: StudyContext, job: Job, prepared: FmuFiles, reply: IO[str]) -> None:
    _set_deadline(order)
    assembly = _prepare_job(order, job, prepared)
    with keeping_run_files(Path(tempfile.gettempdir()) / "run"), simulating(assembly.system, assembly.settings) as outcome:
        if outcome.failure:
            raise outcome.failure
        kpis = evaluate_kpis(Result(outcome.recording), assembly.kpis())
        _write_reply(reply, {"kpis": kpis})
        _results_written()


def _run_with_replay(replay: ReplayRequest, order: StudyContext, job: Job, prepared: FmuFiles, reply: IO[str]) -> None:
    from ...api import executing
    from ...report.replay import write_replay

    _set_deadline(order)
    with keeping_run_files(Path(tempfile.gettempdir()) / "run"), executing(_prepare_job(order, job, prepared)) as execution:
        result = execution.result
        write_replay([replace(result, metadata={**result.metadata, "name": replay.title})], Path(replay.page))
        if execution.failure:
            raise execution.failure
        _write_reply(reply, {"kpis": result.kpis})
        _results_written()


def _set_deadline(order: StudyContext) -> None:
    if order.deadline:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, order.deadline)


def _prepare_job(order: StudyContext, job: Job, prepared: FmuFiles) -> PreparedRun:
    assembly = prepare(order.scenario, job.settings, loaded_fmus={path: file.share() for path, file in prepared.items()})
    if journal := current_journal():
        journal.deadlines = Deadlines(**assembly.spec.deadlines.model_dump())
    return assembly


def _results_written() -> None:
    """All results are written: what components do from now on cannot change them."""
    signal.setitimer(signal.ITIMER_REAL, 0)
    if journal := current_journal():
        journal[EXIT_CODE] = 0
        journal.enter_phase(Phase.RESULTS_WRITTEN)


def _check_job(order: StudyContext, job: Job, prepared: FmuFiles, reply: IO[str]) -> None:
    problems: list[Problem] = []
    try:
        _prepare_job(order, job, prepared).free()
    except InputError as error:
        problems = list(error.problems)
    _write_reply(reply, [(problem.message, _without_root(order, problem.where)) for problem in problems])


# -- in the supervisor -------------------------------------------------------------------------------------------------------


def _make_record(order: StudyContext, job: Job, outcome: SupervisedOutcome, reply: IO[str]) -> Record:
    if outcome.failure:
        return Record(job.key, failure=_without_root(order, _failure_cause(order, outcome.failure)))
    reply.seek(0)
    answer = json.load(reply)
    return Record(job.key, answer.get("kpis", {}), _without_root(order, answer.get("failure", "")))


def _failure_cause(order: StudyContext, failure: ComponentError) -> str:
    """How the child ended; that it was late does not depend on where it was then."""
    if order.deadline and f"signal {signal.SIGALRM:d} " in failure.reason:
        return f"the run did not end within {order.deadline:g} s"
    return str(failure)


def _without_root(order: StudyContext, text: str) -> str:
    """The same text on every machine."""
    return text.replace(f"{order.root}/", "")


def _last_output() -> str:
    size = os.fstat(2).st_size
    return os.pread(2, _MAX_OUTPUT, max(0, size - _MAX_OUTPUT)).decode("utf-8", "replace")
