"""What a worker process does: it serves one instance of an FMU until that is freed or the importer is gone."""

from __future__ import annotations

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
from ....process.journal import CALL_NUMBER, Phase
from ..instance import FmuInstance
from .pipes import STEP_COMMAND, STEP_DONE, SpinningPoller, decode_line, encode_line, read_line, write_line
from .shared_memory import SharedMemoryBlock, string_array

_MAX_MESSAGE_LENGTH = 1 << 20


class Worker:
    """Answers each command of the importer with one line; messages of the FMU go before it."""

    def __init__(self, instance: FmuInstance, block: SharedMemoryBlock, enter: Callable[[], None]):
        self._instance, self._block, self._setup = instance, block, enter
        self._input_strings, self._output_strings = string_array(block.inputs), string_array(block.outputs)
        self._calls: Sequence[tuple[int, Callable[..., int], tuple[Any, ...], bool, PreparedCall]] = ()
        self._states: dict[int, Any] = {}
        self._state_numbers = count()
        self._commands: dict[str, Callable[..., Any]] = {
            "instantiate": self._instantiate,
            "set": instance.set,
            "get": instance.get,
            "enter_initialization_mode": instance.enter_initialization_mode,
            "exit_initialization_mode": instance.exit_initialization_mode,
            "set_inputs": self._set_inputs,
            "do_step": instance.do_step,
            "get_outputs": self._get_outputs,
            "prepare": self._prepare_step,
            "turn": self._step_with_strings,
            "get_state": self._get_state,
            "set_state": lambda number: instance.set_state(self._states[number]),
            "free_state": lambda number: instance.free_state(self._states.pop(number)),
            "terminate": instance.terminate,
            "free": instance.free,
        }

    def serve(self, commands: int, answers: int, temporary: Path) -> None:
        """Until there is nobody any more who commands; `temporary` is where the FMU may put temporary files."""
        gc.freeze()
        self._block.unshare_other_memory()
        journals.set_current_journal(self._block.journal)
        tempfile.tempdir = os.environ["TMPDIR"] = str(temporary)
        component_log.MAX_MESSAGES_PER_SECOND, component_log.MAX_MESSAGE_LENGTH = (
            sys.maxsize,
            _MAX_MESSAGE_LENGTH,
        )  # the importer cuts and counts
        voice = _LogForwarder(answers)
        speaker = logging.getLogger("cosim.component")
        speaker.handlers, speaker.propagate, speaker.level = [voice], False, logging.INFO
        vigil = SpinningPoller([commands])
        while line := read_line(commands, vigil):
            voice.send(self._execute(line))

    def _execute(self, line: bytes) -> bytes:
        try:
            if line == STEP_COMMAND:
                result = self._step()
            else:
                command, *arguments = decode_line(line)
                result = self._commands[command](*arguments)
            return STEP_DONE if result is None else encode_line({"value": result})
        except ComponentError as error:
            failed = error.component, error.function, error.reason, error.time
            return encode_line({"failed": failed, "corrupt": self._instance.has_fatal_error})
        except InputError as error:
            return encode_line({"refused": [str(problem) for problem in error.problems]})
        except Exception as error:
            return encode_line({"failed": (self._instance.name, "its own process", f"{type(error).__name__}: {error}", None)})

    def _instantiate(self) -> None:
        self._setup()
        self._instance.bind(self._block.inputs, self._block.outputs)
        self._instance.instantiate()

    # -- texts do not lie in shared memory -----------------------------------------------------------------------------

    def _set_inputs(self, given: list[Any]) -> None:
        self._input_strings[:] = given
        self._instance.set_inputs()

    def _get_outputs(self) -> list[Any] | None:
        self._instance.get_outputs()
        return self._output_strings.tolist() or None

    def _step_with_strings(self, given: list[Any]) -> tuple[StepResult | None, list[Any]]:
        self._input_strings[:] = given
        return self._step(), self._output_strings.tolist()

    # -- the hot path --------------------------------------------------------------------------------------------------

    def _prepare_step(self, step_size: float) -> list[str]:
        """Names of the calls of a turn, by the number that stands in the journal."""
        calls = self._instance.prepare_step_calls(self._block.clock, step_size)
        self._calls = [
            (n, call.function, call.arguments, isinstance(call.native, NativeDoStep), call) for n, call in enumerate(calls)
        ]
        self._block.journal.enter_phase(Phase.STEPPING)
        return [call.name for call in calls]

    def _step(self) -> StepResult | None:
        marker, traps = self._block.marker, float_mode.enabled_traps
        one, little, least = float_mode.PROBE_VALUES
        result = None
        for number, function, arguments, steps, call in self._calls:
            marker[CALL_NUMBER] = number
            status = function(*arguments)
            if status and status not in SUCCESS_STATUSES:
                result = self._instance.interpret_status(call.name, status)
            if one + little != one - little or not least + least or (steps and traps()):
                raise ComponentError(self._instance.name, call.name, float_mode.CHANGE_REASON, self._block.clock.value)
        return result

    # -- states stay here ----------------------------------------------------------------------------------------------

    def _get_state(self) -> int:
        number = next(self._state_numbers)
        self._states[number] = self._instance.get_state()
        return number


class _LogForwarder(logging.Handler):
    """Messages of the FMU, from whatever thread, as lines to the importer."""

    def __init__(self, writer: int):
        super().__init__()
        self._writer, self._lock = writer, Lock()

    def emit(self, record: logging.LogRecord) -> None:
        arguments = record.args if isinstance(record.args, tuple) else ()
        text = arguments[1] if len(arguments) == 2 else record.getMessage()
        self.send(encode_line({"log": (record.levelno, text)}))

    def send(self, line: bytes) -> None:
        with self._lock:
            write_line(self._writer, line)
