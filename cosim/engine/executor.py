"""Runs a plan: from fresh components through initialization, macro step by macro step.

There are two executors with bit-identical results: this module's `PythonExecutor`, always available, and the native one.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np

from ..component import Call, Component, Ports, StepResult
from ..errors import ComponentError
from .moves import DelayLine, Move, copy
from .plan import Gather, Plan, Step
from .recorder import Recorder

#: the highest FMI status that lets a simulation go on
WARNING = 1

#: places in the marker: number of the present call, macro steps finished, rows recorded
CALL, STEPS, ROWS, MARKER_SIZE = 0, 1, 2, 3

#: status of a Python component's turn in a macro step after which the simulation ends
_TERMINATION = 100

_FLOATS = (np.dtype(np.float64), np.dtype(np.float32))


class Termination(NamedTuple):
    """A component asked to end the simulation."""

    component: str
    time: float


class Turn(NamedTuple):
    """One component's turn as calls that return an FMI status; `first` is the number of the first call."""

    step: Step
    calls: Sequence[Call]
    first: int


class Executor(ABC):
    """Initializes the components of a plan and runs macro steps.

    `marker` (int64) says at any moment, also to another process that shares its memory, which call is being made: see CALL,
    STEPS and ROWS. With `finite`, a value that is connected somewhere and not finite ends the run.
    """

    def __init__(self, plan: Plan, recorder: Recorder, marker: np.ndarray | None = None, finite: bool = True):
        self.plan, self.recorder = plan, recorder
        self.termination: Termination | None = None
        self.marker = np.zeros(MARKER_SIZE, np.int64) if marker is None else marker
        self._finite = finite
        self._clock = ctypes.c_double()
        self._delays = {g: DelayLine(g) for phase in plan.phases for g in phase.gathers if g.delay}
        self._turns: list[Turn] = []

    @property
    def finished(self) -> int:
        """Macro steps finished so far."""
        return int(self.marker[STEPS])

    # -- initialization ------------------------------------------------------------------------------------------------

    def initialize(self) -> None:
        """From fresh components to the initial outputs at the start time, recorded as row 0.

        In initialization mode outputs go to inputs again and again until nothing changes, at most once per component.
        """
        plan, grid = self.plan, self.plan.grid
        start, stop = grid.seconds(0), grid.seconds(grid.count)
        self._clock.value = start
        for name, component in plan.system.components.items():
            component.bind(plan.inputs.ports[name], plan.signals.ports[name])
            for variable, value in plan.system.start_values.get(name, {}).items():
                component.set(variable, value)
        for name, component in plan.system.components.items():
            component.enter_initialization_mode(start, stop)
            component.get_outputs()
            _take_start_values(component, plan.inputs.ports[name])
        self._propagate(start)
        for component in plan.system.components.values():
            component.exit_initialization_mode()
            component.get_outputs()
        for line in self._delays.values():
            line.fill()
        self._check_finite("exit_initialization_mode")
        self._turns = list(self._number(step for phase in plan.phases for step in phase.steps))
        self._prepare()
        self.recorder.record(0)
        self.marker[ROWS] = self.recorder.rows

    def _propagate(self, time: float) -> None:
        moves = [copy(gather) for phase in self.plan.phases for gather in phase.gathers]
        components = self.plan.system.components
        before = self._snapshot()
        for _ in range(len(components) + 1):
            for move in moves:
                move()
            for component in components.values():
                component.set_inputs()
                component.get_outputs()
            after = self._snapshot()
            if after == before:
                return
            changed, before = [name for name in components if after[name] != before[name]], after
        reason = f"the outputs still change after {len(components)} rounds: an algebraic loop"
        raise ComponentError(" -> ".join(changed), "initialization", reason, time)

    def _snapshot(self) -> dict[str, list[object]]:
        return {
            name: [array.tolist() if array.dtype.hasobject else array.tobytes() for array in ports.arrays.values()]
            for name, ports in self.plan.signals.ports.items()
        }

    # -- turns ---------------------------------------------------------------------------------------------------------

    def _number(self, steps: Iterator[Step]) -> Iterator[Turn]:
        first = 0
        for step in steps:
            calls = step.component.turn(self._clock, step.step_size)
            calls = calls or [Call(self._python_turn, (step,), "do_step")]
            yield Turn(step, calls, first)
            first += len(calls)

    def _python_turn(self, step: Step) -> int:
        component = step.component
        component.set_inputs()
        result = component.do_step(self._clock.value, step.step_size)
        if result is not None:
            self._ended_early(step, result)
        component.get_outputs()
        return _TERMINATION if self.termination else 0

    @property
    def calls(self) -> list[tuple[str, str]]:
        """(component, function) of every call, by the number that stands in the marker."""
        return [(turn.step.name, call.name) for turn in self._turns for call in turn.calls]

    def _turn_of(self, number: int) -> tuple[Turn, Call]:
        turn = next(turn for turn in reversed(self._turns) if turn.first <= number)
        return turn, turn.calls[number - turn.first]

    # -- what may happen in a step -------------------------------------------------------------------------------------

    def _bad_status(self, turn: Turn, call: Call, status: int) -> None:
        if status != _TERMINATION:
            self._ended_early(turn.step, turn.step.component.failed(call.name, status))

    def _ended_early(self, step: Step, result: StepResult) -> None:
        time = self._clock.value
        if result.terminate_requested:
            self.termination = self.termination or Termination(step.name, result.time_reached)
        elif result.time_reached < time + step.step_size:
            reached = f"reached only t = {result.time_reached!r} s of {time + step.step_size!r} s"
            raise ComponentError(step.name, "do_step", f"{reached}; staged stepping needs whole steps", time)

    def _float_state_changed(self, turn: Turn, call: Call) -> NoReturn:
        reason = "changed the floating-point mode (rounding, flush to zero or traps) and did not restore it"
        raise ComponentError(turn.step.name, call.name, reason, self._clock.value)

    def _check_finite(self, function: str = "do_step") -> None:
        """Raises ComponentError when an output that feeds something is not finite."""
        if not self._finite:
            return
        for connection in self.plan.system.connections:
            slot = self.plan.signals.places[connection.source]
            if slot.dtype in _FLOATS and not np.isfinite(value := self.plan.signals.arrays[slot.dtype][slot.offset]):
                output = f'the output "{connection.source.slot}" is {value}, and {connection.target} reads it'
                raise ComponentError(connection.source.component, function, output, self._clock.value)

    @property
    def watched(self) -> list[np.ndarray]:
        """Arrays to look at after each macro step: when a value in them is not finite, `_check_finite` decides."""
        arrays = self.plan.signals.arrays
        return [arrays[dtype] for dtype in _FLOATS if dtype in arrays and self._finite]

    # -- macro steps ---------------------------------------------------------------------------------------------------

    @abstractmethod
    def _prepare(self) -> None:
        """Make everything ready for `run`, after initialization."""

    def run(self, end: int) -> None:
        """Macro steps until communication point `end` is reached, or a component asks to terminate."""
        try:
            self._run(end)
        except ComponentError:
            self._check_finite()  # more likely the cause than what failed upon it
            raise

    @abstractmethod
    def _run(self, end: int) -> None: ...


class PythonExecutor(Executor):
    """The executor that needs no compiler: C functions are called through ctypes."""

    def _prepare(self) -> None:
        turns = iter(self._turns)
        self._phases = [
            ([self._move(gather) for gather in phase.gathers], [self._numbered(next(turns)) for _ in phase.steps])
            for phase in self.plan.phases
        ]
        self._watched = [(floats, np.zeros_like(floats)) for floats in self.watched]

    def _move(self, gather: Gather) -> Move:
        return self._delays[gather].move if gather.delay else copy(gather)

    @staticmethod
    def _numbered(turn: Turn) -> tuple[int, list[tuple[Any, Any, int]], Turn]:
        return (turn.step.divisor, [(c.function, c.arguments, turn.first + i) for i, c in enumerate(turn.calls)], turn)

    def _run(self, end: int) -> None:
        seconds, phases, record, clock = self.plan.grid.seconds, self._phases, self.recorder.record, self._clock
        marker, recorder, warning = self.marker.data, self.recorder, WARNING
        watched = self._watched
        # equal in the default rounding mode only, and the least denormal is no zero only if it is not flushed
        one, little, least = 1.0, 2.0**-54, 5e-324
        for n in range(self.finished, end):
            clock.value = seconds(n)
            for moves, turns in phases:
                for move in moves:
                    move()
                for divisor, calls, turn in turns:
                    if divisor != 1 and n % divisor:
                        continue
                    for function, arguments, number in calls:
                        marker[CALL] = number
                        status = function(*arguments)
                        if status > warning:
                            self._bad_status(turn, turn.calls[number - turn.first], status)
                            break
                    if one + little != one - little or not least + least:
                        self._float_state_changed(turn, turn.calls[-1])
            for floats, zeros in watched:
                if floats.dot(zeros):  # NaN unless all are finite
                    self._check_finite()
            record(n + 1)
            marker[ROWS], marker[STEPS] = recorder.rows, n + 1
            if self.termination:
                return


def _take_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's own values, which those keep that no connection feeds."""
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.slots)
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)
