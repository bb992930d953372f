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
from ...engine.run_loop import simulation
from ...process.journal import CODE, Deadlines, Phase, current
from ...process.run_files.folder import unfinished
from ...process.supervisor import Outcome, supervised
from ...results import Result
from ...results.kpi import evaluate_kpis
from ...scenario import Assembly, assemble
from .job import Job, Order, Record

#: so much of what components printed is kept of a run that failed (bytes)
_OUTPUT = 2000

Prepared = Mapping[Path, FmuFile]


class Replay(NamedTuple):
    """The page that is to be made of a run."""

    title: str
    page: str


def supervised_run(order: Order, job: Job, prepared: Prepared, replay: Replay | None = None) -> Record:
    """Run a job in a child process; what it prints goes to this process's standard error, which is a file.

    Whatever the run does, a record comes of it. With `replay` its 3-D replay is written.
    """
    work = _run if replay is None else partial(_replayed, replay)
    began = time.monotonic()
    os.ftruncate(2, 0)
    with tempfile.TemporaryFile("w+") as reply:
        outcome = supervised(lambda: _reporting(reply, lambda: work(order, job, prepared, reply)))
        record = _record(order, job, outcome, reply)
    record = replace(record, seconds=round(time.monotonic() - began, 4))
    return replace(record, output=_last_output()) if record.failure else record


def supervised_check(order: Order, job: Job, prepared: Prepared) -> list[Problem]:
    """What keeps a job from being run, without running it. Raises ComponentError when that ends the process."""
    with tempfile.TemporaryFile("w+") as reply:
        outcome = supervised(lambda: _reporting(reply, lambda: _check(order, job, prepared, reply)))
        if outcome.failure:
            raise outcome.failure
        reply.seek(0)
        return [Problem(message, where) for message, where in json.load(reply)]


# -- in the child ------------------------------------------------------------------------------------------------------------


def _reporting(reply: IO[str], work: Callable[[], None]) -> int:
    """Do the work; what it raises becomes the reply."""
    try:
        work()
        return 0
    except CosimError as error:
        _answer(reply, {"failure": str(error)})
        return error.exit_code
    except Exception as error:
        _answer(reply, {"failure": f"internal error: {type(error).__name__}: {error}"})
        return 70


def _answer(reply: IO[str], value: Any) -> None:
    reply.seek(0)
    reply.truncate()
    json.dump(value, reply)
    reply.flush()


def _run(order: Order, job: Job, prepared: Prepared, reply: IO[str]) -> None:
    _set_deadline(order)
    assembly = _assembled(order, job, prepared)
    with unfinished(Path(tempfile.gettempdir()) / "run"), simulation(assembly.system, assembly.settings) as outcome:
        if outcome.failure:
            raise outcome.failure
        kpis = evaluate_kpis(Result(outcome.recording), assembly.kpis())
        _answer(reply, {"kpis": kpis})
        _leave()


def _replayed(replay: Replay, order: Order, job: Job, prepared: Prepared, reply: IO[str]) -> None:
    from ...api import executed
    from ...report.replay import write_replay

    _set_deadline(order)
    with unfinished(Path(tempfile.gettempdir()) / "run"), executed(_assembled(order, job, prepared)) as execution:
        result = execution.result
        write_replay([replace(result, metadata={**result.metadata, "name": replay.title})], Path(replay.page))
        if execution.failure:
            raise execution.failure
        _answer(reply, {"kpis": result.kpis})
        _leave()


def _set_deadline(order: Order) -> None:
    if order.deadline:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_REAL, order.deadline)


def _assembled(order: Order, job: Job, prepared: Prepared) -> Assembly:
    assembly = assemble(order.scenario, job.settings, prepared={path: file.lent() for path, file in prepared.items()})
    if journal := current():
        journal.deadlines = Deadlines(**assembly.spec.deadlines.model_dump())
    return assembly


def _leave() -> None:
    """All results are written: what components do from now on cannot change them."""
    signal.setitimer(signal.ITIMER_REAL, 0)
    if journal := current():
        journal[CODE] = 0
        journal.enter(Phase.LEAVING)


def _check(order: Order, job: Job, prepared: Prepared, reply: IO[str]) -> None:
    problems: list[Problem] = []
    try:
        _assembled(order, job, prepared).free()
    except InputError as error:
        problems = list(error.problems)
    _answer(reply, [(problem.message, _relative(order, problem.where)) for problem in problems])


# -- in the supervisor -------------------------------------------------------------------------------------------------------


def _record(order: Order, job: Job, outcome: Outcome, reply: IO[str]) -> Record:
    if outcome.failure:
        return Record(job.key, failure=_relative(order, _cause(order, outcome.failure)))
    reply.seek(0)
    answer = json.load(reply)
    return Record(job.key, answer.get("kpis", {}), _relative(order, answer.get("failure", "")))


def _cause(order: Order, failure: ComponentError) -> str:
    """How the child ended; that it was late does not depend on where it was then."""
    if order.deadline and f"signal {signal.SIGALRM:d} " in failure.reason:
        return f"the run did not end within {order.deadline:g} s"
    return str(failure)


def _relative(order: Order, text: str) -> str:
    """The same text on every machine."""
    return text.replace(f"{order.root}/", "")


def _last_output() -> str:
    size = os.fstat(2).st_size
    return os.pread(2, _OUTPUT, max(0, size - _OUTPUT)).decode("utf-8", "replace")
