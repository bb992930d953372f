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
from ....core.component import Call, Component, Ports, StepResult
from ....core.errors import ComponentError, InputError
from ....process.journal import CALL, Phase
from ....process.temporary_folders import WORKER, LockedFolder
from ..file import FmuFile
from ..instance import DISCARD, OK, FmuInstance
from .isolation import Isolation
from .pipes import DONE, TURN, decode, encode
from .process import Lost, Process
from .shared_memory import Block, pairs, texts
from .worker import Worker


class Ended(ComponentError):
    """The worker ended or had to be ended."""


class RemoteFmu(Component):
    """An FMU as `FmuInstance` is one, with the same results; a crash, exit or hang of it is a ComponentError."""

    binds_everything = False

    def __init__(self, kind: type[FmuInstance], file: FmuFile, instance_name: str, logging_on: bool, isolation: Isolation):
        if not hasattr(os, "fork"):
            raise InputError("FMUs in processes of their own need an operating system with fork (Linux, macOS)")
        file.check_platform()
        self.name, self._file, self._kind, self.isolation = instance_name, file, kind, isolation
        self.description = file.description
        self.variables, self.has_state = self.description.variables, self.description.has_state
        self._logging_on = logging_on
        self._process: Process | None = None
        self._temporary: LockedFolder | None = None
        #: the deadline that holds now
        self._deadline = isolation.deadlines.load
        #: the command that is being carried out, and the names of the calls of a turn
        self._command, self._calls = "bind", [""]
        self._result: StepResult | None = None

    # -- life cycle ----------------------------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        folder = self._file.acquire()
        self._temporary = LockedFolder(WORKER)
        self._block = Block(inputs, outputs)
        self._clock = self._block.clock
        self._in, self._out = pairs(self._block.inputs, inputs), pairs(outputs, self._block.outputs)
        self._texts_in, self._texts_out = texts(inputs), texts(outputs)
        self._has_texts = len(self._texts_in) + len(self._texts_out) > 0
        self._start(folder, Path(self._temporary.name))
        self._ask("bind")
        self._deadline = self.isolation.deadlines.initialization

    def _start(self, folder: Path, temporary: Path) -> None:
        import_module(f"fmpy.fmi{self.description.major}")  # once here and not once in every worker
        enter = self.isolation.entrance(folder, temporary, os.getpid())

        def serve(commands: int, answers: int) -> None:
            instance = self._kind(self._file.lent(), self.name, self._logging_on)
            Worker(instance, self._block, enter).serve(commands, answers, temporary)

        self._process = Process(self.name, self._block.journal, serve)

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._ask("enter_initialization_mode", start_time, stop_time)

    def exit_initialization_mode(self) -> None:
        self._ask("exit_initialization_mode")
        self._deadline = self.isolation.deadlines.step

    def terminate(self) -> None:
        self._deadline = self.isolation.deadlines.end
        if not self._file.corrupt:
            self._at_the_end("terminate")

    def free(self) -> None:
        self._deadline = self.isolation.deadlines.end
        if self._process and not self._file.corrupt:
            self._at_the_end("free")
        if self._process:
            self._end()
        if self._temporary:
            self._temporary.cleanup()
            self._temporary = None
            self._file.release()

    def _at_the_end(self, command: str) -> None:
        """Whatever becomes of the worker now, the results are complete."""
        try:
            if self._process:
                self._ask(command)
        except Ended as ended:
            component_log.message(self.name, component_log.WARNING, f"{ended.function} failed: {ended.reason}")

    def _end(self) -> None:
        assert self._process is not None
        self._process.end()
        self._process = None

    # -- access off the hot path ---------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        self._ask("set", name, value)

    def get(self, name: str) -> Any:
        return self._ask("get", name)

    def get_state(self) -> Any:
        return self._ask("get_state")

    def set_state(self, state: Any) -> None:
        self._ask("set_state", state)

    def free_state(self, state: Any) -> None:
        self._ask("free_state", state)

    # -- steps ---------------------------------------------------------------------------------------------------------

    def set_inputs(self) -> None:
        self._copy_inputs()
        self._ask("set_inputs", self._texts_in.tolist())

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        result = self._ask("do_step", time, step_size)
        return result and StepResult(*result)

    def get_outputs(self) -> None:
        found = self._ask("get_outputs")
        self._copy_outputs()
        if found:
            self._texts_out[:] = found

    def turn(self, clock: ctypes.c_double, step_size: float) -> Sequence[Call]:
        self._calls = self._ask("prepare", step_size)
        turn = self._turn_with_texts if self._has_texts else self._turn
        return [Call(turn, (clock,), "a step in its own process")]

    def _turn(self, clock: ctypes.c_double) -> int:
        self._clock.value = clock.value
        for target, source in self._in:
            target[:] = source
        self._command = "turn"
        answer = self._request(TURN)
        result = None if answer == DONE else self._value(answer)
        for target, source in self._out:
            target[:] = source
        return OK if result is None else self._ended_early(result)

    def _turn_with_texts(self, clock: ctypes.c_double) -> int:
        self._clock.value = clock.value
        self._copy_inputs()
        result, found = self._ask("turn", self._texts_in.tolist())
        self._copy_outputs()
        self._texts_out[:] = found
        return self._ended_early(result) if result else OK

    def _ended_early(self, result: Sequence[Any]) -> int:
        self._result = StepResult(*result)
        return DISCARD

    def failed(self, name: str, status: int) -> StepResult:
        assert self._result is not None
        return self._result

    def _copy_inputs(self) -> None:
        for target, source in self._in:
            target[:] = source

    def _copy_outputs(self) -> None:
        for target, source in self._out:
            target[:] = source

    # -- commands and answers ------------------------------------------------------------------------------------------

    def _ask(self, command: str, *arguments: Any) -> Any:
        self._command = command
        return self._value(self._request(encode([command, *arguments])))

    def _request(self, line: bytes) -> bytes:
        process = self._process
        if process is None:
            raise Ended(self.name, self._command, "its process has ended before")
        try:
            return process.request(line, self._deadline)
        except Lost as lost:
            self._end()
            self._blame(str(lost))
        except BaseException:  # interrupted: the answer would come to a question that nobody asks any more
            self._end()
            raise

    def _value(self, answer: bytes) -> Any:
        if answer == DONE:
            return None
        message = self._decoded(answer)
        self._file.corrupt = self._file.corrupt or bool(message.get("corrupt"))
        if "failed" in message:
            raise ComponentError(*message["failed"])
        if "refused" in message:
            raise InputError(message["refused"])
        return message["value"]

    def _decoded(self, answer: bytes) -> dict[str, Any]:
        try:
            message = decode(answer)
        except ValueError:
            message = None
        if not isinstance(message, dict) or not {"value", "failed", "refused"} & message.keys():
            self._end()
            raise Ended(self.name, self._command, "its process answered with something that is no answer")
        return message

    def _blame(self, reason: str) -> NoReturn:
        """Raise the error for what the worker was doing when it ended, as its journal says."""
        journal = self._block.journal
        if journal.phase == Phase.CALLING:
            activity = journal.activity()
            time = None if math.isnan(activity.time) else activity.time
            raise Ended(self.name, activity.function, reason, time)
        if self._command == "turn" and 0 <= journal[CALL] < len(self._calls):
            raise Ended(self.name, self._calls[journal[CALL]], reason, self._clock.value)
        raise Ended(self.name, self._command, reason)
