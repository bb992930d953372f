"""FMUs in worker processes.

A crash, exit or hang of an FMU does not affect the importer and the other components.

Importer process: `IsolatedFmu` is the component, which sends commands; `WorkerProcess`
(worker_process.py) starts the worker process, waits for its answers and ends it.

Worker process: `Worker` (worker.py) executes the commands on the component of the FMU.

Both processes exchange
    - commands and answers, each one line of JSON, through pipes (messages.py);
    - numeric values, the current time and the worker's journal through shared memory
      (shared_memory.py).

A worker process is forked from the importer, which takes some milliseconds. A step costs one empty
line in each direction. Every wait for an answer has a deadline.
"""

import ctypes
import math
import os
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from ....core import component_log
from ....core.component import Ports, PreparedCall, StepResult
from ....core.errors import ComponentError, InputError
from ....process.journal import CALL_NUMBER, Phase
from ....process.temporary_folders import WORKER_PREFIX, LockedFolder
from ..api import DISCARD, OK
from ..driver import FmuComponent, FmuDriver
from ..file import FmuFile
from ..settings import InstanceSettings, Isolation
from .pipe_messages import (
    INVALID_ANSWER_ERRORS,
    STEP_COMMAND,
    STEP_DONE,
    call_names,
    decode_line,
    derivative_values,
    encode_line,
    no_value,
    raise_reported_error,
    state_number,
    step_result,
    string_values,
    variable_value,
)
from .shared_memory import SharedMemoryBlock, matching_buffers, string_array
from .worker import Worker
from .worker_process import INVALID_ANSWER, WorkerLostError, WorkerProcess

Value = TypeVar("Value")


class WorkerEndedError(ComponentError):
    """Failure of a component whose worker process ended or was stopped."""


class IsolatedFmu(FmuComponent):
    """Component whose FMU instance runs in a worker process.

    Results are identical to those of `FmuDriver`. A crash, exit or hang of the FMU raises a
    ComponentError.
    """

    runs_foreign_code = False

    def __init__(
        self,
        driver: type[FmuDriver],
        file: FmuFile,
        instance_name: str,
        settings: InstanceSettings,
        isolation: Isolation,
    ):
        """Create the component; see `create_component`.

        The worker process is started by `instantiate`.

        Args:
            driver: Class of the component in the worker process.
            file: The FMU.
            instance_name: Name of the FMU instance.
            settings: Tolerance and integration method.
            isolation: Deadlines and sandbox of the worker process.

        Raises:
            InputError: The operating system has no fork, or the FMU has no usable binary for this
                platform.
        """
        if not hasattr(os, "fork"):
            raise InputError("isolated FMUs need an operating system with fork (Linux, macOS)")
        super().__init__(file, instance_name, settings)
        self._driver, self.isolation = driver, isolation
        self._temporary_folder: LockedFolder | None = None
        self._result: StepResult | None = None
        self._process: WorkerProcess | None = None
        #: deadline (s) of the calls in the present phase of the life cycle
        self._deadline = isolation.deadlines.load
        #: command that the worker process executes now
        self._command = "instantiate"
        #: names of the FMI calls of a prepared step, in their order
        self._call_names: Sequence[str] = [""]

    # -- life cycle

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Allocate the shared memory that mirrors the bound arrays."""
        self._shared_memory = SharedMemoryBlock(inputs, outputs)
        self._current_time = self._shared_memory.current_time
        self._input_buffers = matching_buffers(self._shared_memory.inputs, inputs)
        self._output_buffers = matching_buffers(outputs, self._shared_memory.outputs)
        self._input_strings, self._output_strings = string_array(inputs), string_array(outputs)
        self._has_strings = len(self._input_strings) + len(self._output_strings) > 0

    def instantiate(self) -> None:
        """Start the worker process and instantiate the FMU in it.

        Raises:
            InputError: The FMU cannot be extracted or loaded, or the sandbox is not supported.
            ComponentError: The FMU returned no instance, or the worker process ended.
        """
        folder = self._file.acquire()
        self._temporary_folder = LockedFolder(WORKER_PREFIX)
        self._start_worker(folder, Path(self._temporary_folder.name))
        self._execute("instantiate")
        self._deadline = self.isolation.deadlines.initialization

    def _start_worker(self, folder: Path, temporary: Path) -> None:
        import_module(
            f"fmpy.fmi{self.description.major}"
        )  # imported before the fork, so that workers need not
        setup = self.isolation.worker_setup(folder, temporary, os.getpid())

        def serve(commands: int, answers: int) -> None:
            instance = self._driver(self._file.share(), self.name, self._settings)
            Worker(instance, self._shared_memory, setup).serve(commands, answers, temporary)

        self._process = WorkerProcess(self.name, self._shared_memory.journal, serve)

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Call `FmuDriver.enter_initialization_mode` in the worker process."""
        self._execute("enter_initialization_mode", start_time, stop_time)

    def exit_initialization_mode(self) -> None:
        """Call `FmuDriver.exit_initialization_mode` in the worker process."""
        self._execute("exit_initialization_mode")
        self._deadline = self.isolation.deadlines.step

    def terminate(self) -> None:
        """Call `FmuDriver.terminate` in the worker process, unless the FMU has returned fatal."""
        self._deadline = self.isolation.deadlines.end
        if not self._file.has_fatal_error:
            self._execute_or_warn("terminate")

    def free(self) -> None:
        """Call `FmuDriver.free` in the worker process, stop it and remove its temporary folder."""
        self._deadline = self.isolation.deadlines.end
        if self._process and not self._file.has_fatal_error:
            self._execute_or_warn("free")
        if self._process:
            self._stop_worker()
        if self._temporary_folder:
            self._temporary_folder.cleanup()
            self._temporary_folder = None
            self._file.release()

    # -- access outside the stepping loop

    def set(self, name: str, value: Any) -> None:
        """Set a variable of the FMU in the worker process."""
        self._execute("set", name, value)

    def get(self, name: str) -> Any:
        """Return the value of a variable of the FMU in the worker process."""
        return self._execute(
            "get", name, convert=partial(variable_value, variable=self._variables_by_name[name])
        )

    def get_directional_derivative(
        self, outputs: Sequence[str], input_name: str
    ) -> Sequence[float] | None:
        """Return the directional derivatives of the FMU in the worker process."""
        if not self.description.directional_derivatives:
            return None
        convert = partial(derivative_values, count=len(outputs))
        found: Sequence[float] | None = self._execute(
            "get_directional_derivative", list(outputs), input_name, convert=convert
        )
        return found

    def get_state(self) -> Any:
        """Save the FMU state in the worker process and return its number."""
        return self._execute("get_state", convert=state_number)

    def set_state(self, state: Any) -> None:
        """Restore the FMU state with a number."""
        self._execute("set_state", state)

    def free_state(self, state: Any) -> None:
        """Free the FMU state with a number."""
        self._execute("free_state", state)

    # -- steps

    def set_inputs(self) -> None:
        """Copy the bound inputs to the worker process and set them in the FMU."""
        self._copy_inputs()
        self._execute("set_inputs", self._input_strings.tolist())

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Call `FmuDriver.do_step` in the worker process."""
        return self._execute("do_step", time, step_size, convert=step_result)

    def get_outputs(self) -> None:
        """Get the outputs of the FMU in the worker process and copy them to the bound arrays."""
        strings = self._execute("get_outputs", convert=self._convert_strings)
        self._copy_outputs()
        self._output_strings[:] = strings

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Prepare one call that makes a whole step in the worker process.

        The step sets the inputs, calls doStep and gets the outputs.
        """
        self._call_names = self._execute("prepare_step", step_size, convert=call_names)
        step = self._step_with_strings if self._has_strings else self._step
        return [PreparedCall(step, (current_time,), "step in the worker process")]

    def _step(self, current_time: ctypes.c_double) -> int:
        self._current_time.value = current_time.value
        for target, source in self._input_buffers:
            target[:] = source
        self._command = "step"
        answer = self._request(STEP_COMMAND)
        result = None if answer == STEP_DONE else self._parse_answer(answer, step_result)
        for target, source in self._output_buffers:
            target[:] = source
        return OK if result is None else self._store_early_return(result)

    def _step_with_strings(self, current_time: ctypes.c_double) -> int:
        self._current_time.value = current_time.value
        self._copy_inputs()
        result, strings = self._execute(
            "step", self._input_strings.tolist(), convert=self._convert_step_with_strings
        )
        self._copy_outputs()
        self._output_strings[:] = strings
        return self._store_early_return(result) if result else OK

    def _convert_strings(self, value: Any) -> list[Any]:
        return string_values(value, len(self._output_strings))

    def _convert_step_with_strings(self, value: Any) -> tuple[StepResult | None, list[Any]]:
        result, strings = value
        return step_result(result), self._convert_strings(strings)

    def _store_early_return(self, result: StepResult) -> int:
        """Store the result for `interpret_status`, which the executor calls after discard."""
        self._result = result
        return DISCARD

    def interpret_status(self, _function: str, _status: int) -> StepResult:
        """Return the result of the step that returned discard."""
        assert self._result is not None
        return self._result

    def _copy_inputs(self) -> None:
        for target, source in self._input_buffers:
            target[:] = source

    def _copy_outputs(self) -> None:
        for target, source in self._output_buffers:
            target[:] = source

    # -- commands to the worker process

    def _execute(
        self,
        command: str,
        *arguments: Any,
        convert: Callable[[Any], Value] = no_value,  # type: ignore[assignment]
    ) -> Value:
        """Execute a command in the worker process.

        Return its value, converted by a function of `messages`.
        """
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
