"""Worker side of an isolated FMU: executes the importer's commands on one FMU instance."""

import gc
import logging
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path
from threading import Lock
from typing import Any

from ....core import component_log
from ....core.component import SUCCESS_STATUSES, NativeDoStep, PreparedCall, StepResult
from ....core.errors import ComponentError, InputError
from ....process import float_mode
from ....process import journal as journals
from ....process.journal import (
    CALL_NUMBER,
    OVERWRITTEN,
    Phase,
    attributing_forks,
    report_forks,
    watch_forks,
)
from ..driver import FmuDriver
from .pipe_messages import (
    STEP_COMMAND,
    STEP_DONE,
    SpinningPoller,
    decode_line,
    encode_line,
    read_line,
    write_line,
)
from .shared_memory import SharedMemoryBlock, string_array

#: commands that are methods of the component
_FORWARDED = (
    "set",
    "get",
    "get_directional_derivative",
    "enter_initialization_mode",
    "exit_initialization_mode",
    "do_step",
    "terminate",
    "free",
)
#: characters of a log message; the importer shortens messages to its own limit
_MAX_MESSAGE_LENGTH = 1 << 20


class Worker:
    """Command server in the worker process.

    It answers each command with one line. Log messages of the FMU are lines that precede the
    answer.
    """

    def __init__(self, instance: FmuDriver, block: SharedMemoryBlock, setup: Callable[[], None]):
        """Create the server.

        Args:
            instance: The FMU instance, not yet bound and instantiated.
            block: Memory shared with the importer process.
            setup: Function that enters the sandbox, called before foreign code is loaded.
        """
        self._instance, self._block, self._setup = instance, block, setup
        self._input_strings = string_array(block.inputs)
        self._output_strings = string_array(block.outputs)
        self._calls: Sequence[
            tuple[int, Callable[..., int], tuple[Any, ...], bool, PreparedCall]
        ] = ()
        self._states: dict[int, Any] = {}
        self._state_numbers = count()
        self._commands: dict[str, Callable[..., Any]] = {
            "instantiate": self._instantiate,
            **{name: getattr(instance, name) for name in _FORWARDED},
            "set_inputs": self._set_inputs,
            "get_outputs": self._get_outputs,
            "prepare_step": self._prepare_step,
            "step": self._step_with_strings,
            "get_state": self._get_state,
            "set_state": lambda number: instance.set_state(self._states[number]),
            "free_state": lambda number: instance.free_state(self._states.pop(number)),
        }

    def serve(self, commands: int, answers: int, temporary: Path) -> None:
        """Execute commands until the importer closes the pipe.

        Args:
            commands: Descriptor of the pipe with commands.
            answers: Descriptor of the pipe for answers.
            temporary: Folder for temporary files of the FMU.
        """
        gc.freeze()
        self._block.unshare_other_memory()
        self._block.journal.exclude_from_forks()
        watch_forks()
        journals.set_current_journal(self._block.journal)
        tempfile.tempdir = os.environ["TMPDIR"] = str(temporary)
        # the importer limits number and length of the messages
        component_log.MAX_MESSAGES_PER_SECOND = sys.maxsize
        component_log.MAX_MESSAGE_LENGTH = _MAX_MESSAGE_LENGTH
        sender = _LineSender(answers)
        logger = logging.getLogger("cosim.component")
        logger.handlers, logger.propagate, logger.level = [sender], False, logging.INFO
        poller = SpinningPoller([commands])
        process = os.getpid()
        with attributing_forks(self._describe_step_call):
            while line := read_line(commands, poller):
                answer = self._execute(line)
                if os.getpid() != process:
                    return
                report_forks()
                sender.send(answer)

    def _describe_step_call(self) -> tuple[str, str]:
        return self._instance.name, self._calls[self._block.marker[CALL_NUMBER]][-1].name

    def _execute(self, line: bytes) -> bytes:
        try:
            if line == STEP_COMMAND:
                result = self._step()
            else:
                command, *arguments = decode_line(line)
                result = self._commands[command](*arguments)
            return STEP_DONE if result is None else encode_line({"value": result})
        except ComponentError as error:
            fields = error.component, error.function, error.reason, error.time
            return encode_line(
                {"component_error": fields, "fatal": self._instance.api.has_fatal_error}
            )
        except InputError as error:
            return encode_line({"input_error": [str(problem) for problem in error.problems]})
        except Exception as error:
            reason = (
                f"{type(error).__name__}: {error}" if self._block.journal.is_valid else OVERWRITTEN
            )
            fields = self._instance.name, "the worker process", reason, None
            return encode_line({"component_error": fields, "fatal": True})

    def _instantiate(self) -> None:
        """Enter the sandbox, bind the instance to the shared memory and instantiate the FMU."""
        self._setup()
        self._instance.bind(self._block.inputs, self._block.outputs)
        self._instance.instantiate()

    # -- commands that carry strings, which are not in shared memory

    def _set_inputs(self, strings: list[Any]) -> None:
        self._input_strings[:] = strings
        self._instance.set_inputs()

    def _get_outputs(self) -> list[Any] | None:
        self._instance.get_outputs()
        return self._output_strings.tolist() or None

    def _step_with_strings(self, strings: list[Any]) -> tuple[StepResult | None, list[Any]]:
        self._input_strings[:] = strings
        return self._step(), self._output_strings.tolist()

    # -- the stepping loop

    def _prepare_step(self, step_size: float) -> list[str]:
        """Prepare the calls of a step and return their names.

        The journal records the index of the present call.
        """
        calls = self._instance.prepare_step_calls(self._block.current_time, step_size) or ()
        self._calls = [
            (index, call.function, call.arguments, isinstance(call.native, NativeDoStep), call)
            for index, call in enumerate(calls)
        ]
        self._block.journal.enter_phase(Phase.STEPPING)
        return [call.name for call in calls]

    def _step(self) -> StepResult | None:
        marker, traps = self._block.marker, float_mode.enabled_traps
        one, tiny, subnormal = float_mode.PROBE_VALUES
        result = None
        for index, function, arguments, is_do_step, call in self._calls:
            marker[CALL_NUMBER] = index
            status = function(*arguments)
            if status and status not in SUCCESS_STATUSES:
                result = self._instance.interpret_status(call.name, status)
            if one + tiny != one - tiny or not subnormal + subnormal or (is_do_step and traps()):
                self._instance.api.restore_float_mode(call.name)
        return result

    # -- FMU states, which stay in the worker process

    def _get_state(self) -> int:
        number = next(self._state_numbers)
        self._states[number] = self._instance.get_state()
        return number


class _LineSender(logging.Handler):
    """Sender of answers and log messages to the importer, callable from any thread."""

    def __init__(self, writer: int):
        super().__init__()
        self._writer, self._lock = writer, Lock()

    def emit(self, record: logging.LogRecord) -> None:
        """Send a log message of the FMU; the importer adds the name of the component."""
        arguments = record.args if isinstance(record.args, tuple) else ()
        text = arguments[1] if len(arguments) == 2 else record.getMessage()
        self.send(encode_line({"log": (record.levelno, text)}))

    def send(self, line: bytes) -> None:
        """Send a line."""
        with self._lock:
            write_line(self._writer, line)
