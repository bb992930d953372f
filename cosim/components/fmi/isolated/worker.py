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
from ....core.component import GOOD, Call, DoStep, StepResult
from ....core.errors import ComponentError, InputError
from ....process import float_mode
from ....process import journal as journals
from ....process.journal import CALL, Phase
from ..instance import FmuInstance
from .pipes import DONE, TURN, Vigil, decode, encode, read_line, write
from .shared_memory import Block, texts

_LONGEST_MESSAGE = 1 << 20


class Worker:
    """Answers each command of the importer with one line; messages of the FMU go before it."""

    def __init__(self, instance: FmuInstance, block: Block, enter: Callable[[], None]):
        self._instance, self._block, self._enter = instance, block, enter
        self._in, self._out = texts(block.inputs), texts(block.outputs)
        self._calls: Sequence[tuple[int, Callable[..., int], tuple[Any, ...], bool, Call]] = ()
        self._states: dict[int, Any] = {}
        self._numbers = count()
        self._commands: dict[str, Callable[..., Any]] = {
            "bind": self._bind,
            "set": instance.set,
            "get": instance.get,
            "enter_initialization_mode": instance.enter_initialization_mode,
            "exit_initialization_mode": instance.exit_initialization_mode,
            "set_inputs": self._set_inputs,
            "do_step": instance.do_step,
            "get_outputs": self._get_outputs,
            "prepare": self._prepare,
            "turn": self._turn_with_texts,
            "get_state": self._get_state,
            "set_state": lambda number: instance.set_state(self._states[number]),
            "free_state": lambda number: instance.free_state(self._states.pop(number)),
            "terminate": instance.terminate,
            "free": instance.free,
        }

    def serve(self, commands: int, answers: int, temporary: Path) -> None:
        """Until there is nobody any more who commands; `temporary` is where the FMU may put temporary files."""
        gc.freeze()
        self._block.keep_others_out()
        journals.keep(self._block.journal)
        tempfile.tempdir = os.environ["TMPDIR"] = str(temporary)
        component_log.PER_SECOND, component_log.LONGEST = sys.maxsize, _LONGEST_MESSAGE  # the importer cuts and counts
        voice = _Voice(answers)
        speaker = logging.getLogger("cosim.component")
        speaker.handlers, speaker.propagate, speaker.level = [voice], False, logging.INFO
        vigil = Vigil([commands])
        while line := read_line(commands, vigil):
            voice.say(self._answer(line))

    def _answer(self, line: bytes) -> bytes:
        try:
            if line == TURN:
                result = self._turn()
            else:
                command, *arguments = decode(line)
                result = self._commands[command](*arguments)
            return DONE if result is None else encode({"value": result})
        except ComponentError as error:
            failed = error.component, error.function, error.reason, error.time
            return encode({"failed": failed, "corrupt": self._instance.corrupt})
        except InputError as error:
            return encode({"refused": [str(problem) for problem in error.problems]})
        except Exception as error:
            return encode({"failed": (self._instance.name, "its own process", f"{type(error).__name__}: {error}", None)})

    def _bind(self) -> None:
        self._enter()
        self._instance.bind(self._block.inputs, self._block.outputs)

    # -- texts do not lie in shared memory -----------------------------------------------------------------------------

    def _set_inputs(self, given: list[Any]) -> None:
        self._in[:] = given
        self._instance.set_inputs()

    def _get_outputs(self) -> list[Any] | None:
        self._instance.get_outputs()
        return self._out.tolist() or None

    def _turn_with_texts(self, given: list[Any]) -> tuple[StepResult | None, list[Any]]:
        self._in[:] = given
        return self._turn(), self._out.tolist()

    # -- the hot path --------------------------------------------------------------------------------------------------

    def _prepare(self, step_size: float) -> list[str]:
        """Names of the calls of a turn, by the number that stands in the journal."""
        calls = self._instance.turn(self._block.clock, step_size)
        self._calls = [(n, call.function, call.arguments, isinstance(call.native, DoStep), call) for n, call in enumerate(calls)]
        self._block.journal.enter(Phase.STEPPING)
        return [call.name for call in calls]

    def _turn(self) -> StepResult | None:
        marker, traps = self._block.marker, float_mode.traps
        one, little, least = float_mode.PROBE
        result = None
        for number, function, arguments, steps, call in self._calls:
            marker[CALL] = number
            status = function(*arguments)
            if status and status not in GOOD:
                result = self._instance.failed(call.name, status)
            if one + little != one - little or not least + least or (steps and traps()):
                raise ComponentError(self._instance.name, call.name, float_mode.REASON, self._block.clock.value)
        return result

    # -- states stay here ----------------------------------------------------------------------------------------------

    def _get_state(self) -> int:
        number = next(self._numbers)
        self._states[number] = self._instance.get_state()
        return number


class _Voice(logging.Handler):
    """Messages of the FMU, from whatever thread, as lines to the importer."""

    def __init__(self, writer: int):
        super().__init__()
        self._writer, self._lock = writer, Lock()

    def emit(self, record: logging.LogRecord) -> None:
        arguments = record.args if isinstance(record.args, tuple) else ()
        text = arguments[1] if len(arguments) == 2 else record.getMessage()
        self.say(encode({"log": (record.levelno, text)}))

    def say(self, line: bytes) -> None:
        with self._lock:
            write(self._writer, line)
