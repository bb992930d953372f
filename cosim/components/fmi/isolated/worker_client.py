"""Importer side of the commands to a worker process.

Sends them, and converts answers to results and errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from ....core import component_log
from ....core.errors import ComponentError
from ....process.journal import CALL_NUMBER, Phase
from ..file import FmuFile
from .answers import INVALID_ANSWER_ERRORS, no_value, raise_reported_error
from .pipes import STEP_DONE, decode_line, encode_line
from .shared_memory import SharedMemoryBlock
from .worker_process import INVALID_ANSWER, WorkerLostError, WorkerProcess

Value = TypeVar("Value")


class WorkerEndedError(ComponentError):
    """Failure of a component whose worker process ended or was stopped."""


class WorkerClient:
    """Client of one worker process, which executes the commands of `Worker`."""

    #: memory shared with the worker process, set before its start
    _shared_memory: SharedMemoryBlock

    def __init__(self, file: FmuFile, name: str, deadline: float):
        """Create a client without a worker process.

        Args:
            file: The FMU.
            name: Name of the component.
            deadline: Deadline (s) of the first calls.
        """
        self.name, self._file = name, file
        self._process: WorkerProcess | None = None
        #: deadline (s) of the calls in the present phase of the life cycle
        self._deadline = deadline
        #: command that the worker process executes now
        self._command = "instantiate"
        #: names of the FMI calls of a prepared step, in their order
        self._call_names: Sequence[str] = [""]

    def _execute(
        self,
        command: str,
        *arguments: Any,
        convert: Callable[[Any], Value] = no_value,  # type: ignore[assignment]
    ) -> Value:
        """Execute a command in the worker process and return its value, converted by a function of `answers`."""
        self._command = command
        return self._parse_answer(self._request(encode_line([command, *arguments])), convert)

    def _request(self, line: bytes) -> bytes:
        process = self._process
        if process is None:
            raise WorkerEndedError(self.name, self._command, "its worker process has already ended")
        try:
            return process.request(line, self._deadline)
        except WorkerLostError as error:
            self._stop_worker()
            raise self._worker_ended_error(str(error)) from None
        except (
            BaseException
        ):  # after an interrupt, the pending answer would be taken for that of the next command
            self._stop_worker()
            raise

    def _parse_answer(self, answer: bytes, convert: Callable[[Any], Value]) -> Value:
        try:
            message = {"value": None} if answer == STEP_DONE else decode_line(answer)
            self._file.has_fatal_error = self._file.has_fatal_error or message.get("fatal") is True
            raise_reported_error(message, self.name)
            return convert(message["value"])
        except INVALID_ANSWER_ERRORS:
            self._stop_worker()
            raise WorkerEndedError(self.name, self._command, INVALID_ANSWER) from None

    def _worker_ended_error(self, reason: str) -> WorkerEndedError:
        """Return the error for an ended worker process.

        Its journal names the FMI function that was being called.
        """
        journal = self._shared_memory.journal
        if journal.is_valid and journal.phase == Phase.CALLING:
            activity = journal.activity()
            time = None if math.isnan(activity.time) else activity.time
            return WorkerEndedError(self.name, activity.function, reason, time)
        if self._command == "step" and 0 <= journal[CALL_NUMBER] < len(self._call_names):
            function = self._call_names[journal[CALL_NUMBER]]
            return WorkerEndedError(
                self.name, function, reason, self._shared_memory.current_time.value
            )
        return WorkerEndedError(self.name, self._command, reason)

    def _execute_or_warn(self, command: str) -> None:
        """Execute a command after the last step.

        An end of the worker process is only a warning, as all results are complete.
        """
        try:
            if self._process:
                self._execute(command)
        except WorkerEndedError as error:
            component_log.log_message(
                self.name, component_log.WARNING, f"{error.function} failed: {error.reason}"
            )

    def _stop_worker(self) -> None:
        assert self._process is not None
        self._process.stop()
        self._process = None
