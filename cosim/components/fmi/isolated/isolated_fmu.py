"""A component whose FMU lives in a process of its own."""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from ....core import component_log
from ....core.component import Component, Ports, PreparedCall, StepResult
from ....core.errors import ComponentError, InputError
from ....process.journal import CALL_NUMBER, Phase
from ....process.temporary_folders import WORKER_PREFIX, LockedFolder
from ..file import FmuFile
from ..instance import DISCARD, OK, FmuInstance
from .isolation import Isolation
from .pipes import STEP_COMMAND, STEP_DONE, decode_line, encode_line
from .shared_memory import SharedMemoryBlock, matching_buffers, string_array
from .worker import Worker
from .worker_process import WorkerLost, WorkerProcess


class WorkerEnded(ComponentError):
    """The worker ended or had to be ended."""


class IsolatedFmu(Component):
    """An FMU as `FmuInstance` is one, with the same results; a crash, exit or hang of it is a ComponentError."""

    binds_everything = False

    def __init__(
        self, instance_class: type[FmuInstance], file: FmuFile, instance_name: str, logging_on: bool, isolation: Isolation
    ):
        if not hasattr(os, "fork"):
            raise InputError("FMUs in processes of their own need an operating system with fork (Linux, macOS)")
        file.check_binary()
        self.name, self._file, self._instance_class, self.isolation = instance_name, file, instance_class, isolation
        self.description = file.description
        self.variables, self.has_state = self.description.variables, self.description.has_state
        self._logging_on = logging_on
        self._process: WorkerProcess | None = None
        self._temporary_folder: LockedFolder | None = None
        #: the deadline that holds now
        self._deadline = isolation.deadlines.load
        #: the command that is being carried out, and the names of the calls of a turn
        self._command, self._call_names = "instantiate", [""]
        self._result: StepResult | None = None

    # -- life cycle ----------------------------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._shared_memory = SharedMemoryBlock(inputs, outputs)
        self._clock = self._shared_memory.clock
        self._input_buffers, self._output_buffers = (
            matching_buffers(self._shared_memory.inputs, inputs),
            matching_buffers(outputs, self._shared_memory.outputs),
        )
        self._input_strings, self._output_strings = string_array(inputs), string_array(outputs)
        self._has_strings = len(self._input_strings) + len(self._output_strings) > 0

    def instantiate(self) -> None:
        """Start the worker process and instantiate the FMU in it."""
        folder = self._file.acquire()
        self._temporary_folder = LockedFolder(WORKER_PREFIX)
        self._start_worker(folder, Path(self._temporary_folder.name))
        self._execute("instantiate")
        self._deadline = self.isolation.deadlines.initialization

    def _start_worker(self, folder: Path, temporary: Path) -> None:
        import_module(f"fmpy.fmi{self.description.major}")  # once here and not once in every worker
        enter = self.isolation.worker_setup(folder, temporary, os.getpid())

        def serve(commands: int, answers: int) -> None:
            instance = self._instance_class(self._file.share(), self.name, self._logging_on)
            Worker(instance, self._shared_memory, enter).serve(commands, answers, temporary)

        self._process = WorkerProcess(self.name, self._shared_memory.journal, serve)

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._execute("enter_initialization_mode", start_time, stop_time)

    def exit_initialization_mode(self) -> None:
        self._execute("exit_initialization_mode")
        self._deadline = self.isolation.deadlines.step

    def terminate(self) -> None:
        self._deadline = self.isolation.deadlines.end
        if not self._file.has_fatal_error:
            self._request_final("terminate")

    def free(self) -> None:
        self._deadline = self.isolation.deadlines.end
        if self._process and not self._file.has_fatal_error:
            self._request_final("free")
        if self._process:
            self._stop_worker()
        if self._temporary_folder:
            self._temporary_folder.cleanup()
            self._temporary_folder = None
            self._file.release()

    def _request_final(self, command: str) -> None:
        """Whatever becomes of the worker now, the results are complete."""
        try:
            if self._process:
                self._execute(command)
        except WorkerEnded as ended:
            component_log.log_message(self.name, component_log.WARNING, f"{ended.function} failed: {ended.reason}")

    def _stop_worker(self) -> None:
        assert self._process is not None
        self._process.stop()
        self._process = None

    # -- access off the hot path ---------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        self._execute("set", name, value)

    def get(self, name: str) -> Any:
        return self._execute("get", name)

    def get_state(self) -> Any:
        return self._execute("get_state")

    def set_state(self, state: Any) -> None:
        self._execute("set_state", state)

    def free_state(self, state: Any) -> None:
        self._execute("free_state", state)

    # -- steps ---------------------------------------------------------------------------------------------------------

    def set_inputs(self) -> None:
        self._copy_inputs()
        self._execute("set_inputs", self._input_strings.tolist())

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        result = self._execute("do_step", time, step_size)
        return result and StepResult(*result)

    def get_outputs(self) -> None:
        found = self._execute("get_outputs")
        self._copy_outputs()
        if found:
            self._output_strings[:] = found

    def prepare_step_calls(self, clock: ctypes.c_double, step_size: float) -> Sequence[PreparedCall]:
        self._call_names = self._execute("prepare", step_size)
        turn = self._step_with_strings if self._has_strings else self._step
        return [PreparedCall(turn, (clock,), "a step in its own process")]

    def _step(self, clock: ctypes.c_double) -> int:
        self._clock.value = clock.value
        for target, source in self._input_buffers:
            target[:] = source
        self._command = "turn"
        answer = self._request(STEP_COMMAND)
        result = None if answer == STEP_DONE else self._parse_answer(answer)
        for target, source in self._output_buffers:
            target[:] = source
        return OK if result is None else self._store_early_return(result)

    def _step_with_strings(self, clock: ctypes.c_double) -> int:
        self._clock.value = clock.value
        self._copy_inputs()
        result, found = self._execute("turn", self._input_strings.tolist())
        self._copy_outputs()
        self._output_strings[:] = found
        return self._store_early_return(result) if result else OK

    def _store_early_return(self, result: Sequence[Any]) -> int:
        self._result = StepResult(*result)
        return DISCARD

    def interpret_status(self, name: str, status: int) -> StepResult:
        assert self._result is not None
        return self._result

    def _copy_inputs(self) -> None:
        for target, source in self._input_buffers:
            target[:] = source

    def _copy_outputs(self) -> None:
        for target, source in self._output_buffers:
            target[:] = source

    # -- commands and answers ------------------------------------------------------------------------------------------

    def _execute(self, command: str, *arguments: Any) -> Any:
        self._command = command
        return self._parse_answer(self._request(encode_line([command, *arguments])))

    def _request(self, line: bytes) -> bytes:
        process = self._process
        if process is None:
            raise WorkerEnded(self.name, self._command, "its process has ended before")
        try:
            return process.request(line, self._deadline)
        except WorkerLost as lost:
            self._stop_worker()
            self._raise_worker_ended(str(lost))
        except BaseException:  # interrupted: the answer would come to a question that nobody asks any more
            self._stop_worker()
            raise

    def _parse_answer(self, answer: bytes) -> Any:
        if answer == STEP_DONE:
            return None
        message = self._decode_answer(answer)
        self._file.has_fatal_error = self._file.has_fatal_error or bool(message.get("corrupt"))
        if "failed" in message:
            raise ComponentError(*message["failed"])
        if "refused" in message:
            raise InputError(message["refused"])
        return message["value"]

    def _decode_answer(self, answer: bytes) -> dict[str, Any]:
        try:
            message = decode_line(answer)
        except ValueError:
            message = None
        if not isinstance(message, dict) or not {"value", "failed", "refused"} & message.keys():
            self._stop_worker()
            raise WorkerEnded(self.name, self._command, "its process answered with something that is no answer")
        return message

    def _raise_worker_ended(self, reason: str) -> NoReturn:
        """Raise the error for what the worker was doing when it ended, as its journal says."""
        journal = self._shared_memory.journal
        if journal.phase == Phase.CALLING:
            activity = journal.activity()
            time = None if math.isnan(activity.time) else activity.time
            raise WorkerEnded(self.name, activity.function, reason, time)
        if self._command == "turn" and 0 <= journal[CALL_NUMBER] < len(self._call_names):
            raise WorkerEnded(self.name, self._call_names[journal[CALL_NUMBER]], reason, self._clock.value)
        raise WorkerEnded(self.name, self._command, reason)
