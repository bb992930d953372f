"""Runs a plan: from fresh components through initialization, macro step by macro step.

There are two executors with bit-identical results: the pure Python one, always available, and the native one.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from ..core.component import GOOD, Call, StepResult
from ..core.errors import PASSING, ComponentError, CosimError, told
from ..process import float_mode
from ..process.journal import calling
from .component_step import Ending, Turn, shown, take
from .initialization import propagate, take_start_values
from .iteration import Round, Rounds
from .parallel import TRIALS, Crew, SideBySide, may_overlap, processors
from .plan import Loop, Phase, Plan, Step
from .recorder import Recorder
from .transfer_plan import Gather
from .transfers import DelayLine, Move, copy

#: places in the marker: number of the present call, macro steps finished, rows recorded
CALL, STEPS, ROWS, MARKER_SIZE = 0, 1, 2, 3

#: status of a Python component's turn in a macro step after which the simulation ends; no FMU can return it
_TERMINATION = 1 << 32

_FLOATS = (np.dtype(np.float64), np.dtype(np.float32))


class Termination(NamedTuple):
    """A component asked to end the simulation; `complete`: at the end of its step, so that the macro step counts."""

    component: str
    time: float
    complete: bool = True


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
        self._delays = {g: DelayLine(g) for phase in plan.all_phases for g in phase.gathers if g.delay}
        self._turns: list[Turn] = []
        #: the turns of each phase
        self._stages: list[list[Turn]] = []
        #: joint turns that may take the place of others in a phase, by the number of the phase
        self._joint: dict[int, Turn] = {}
        self._crew: Crew[Sequence[Turn], list[Ending]] | None = None

    @property
    def finished(self) -> int:
        """Macro steps finished so far."""
        return int(self.marker[STEPS])

    # -- initialization ------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Bind all components to their arrays: FMUs are extracted, loaded and instantiated here."""
        for name, component in self.plan.system.components.items():
            with calling(name, "bind", "load"):
                component.bind(self.plan.inputs.ports[name], self.plan.signals.ports[name])

    def initialize(self) -> None:
        """From instantiated components to the initial outputs at the start time, recorded as row 0.

        In initialization mode outputs go to inputs again and again until nothing changes (see `initialization`).
        """
        plan, grid = self.plan, self.plan.grid
        start, stop = grid.seconds(0), grid.seconds(grid.count)
        self._clock.value = start
        for name, component in plan.system.components.items():
            with calling(name, "set", "initialization"):
                for variable, value in plan.system.start_values.get(name, {}).items():
                    component.set(variable, value)
        for name, component in plan.system.components.items():
            with calling(name, "enter_initialization_mode", "initialization", start):
                component.enter_initialization_mode(start, stop)
                component.get_outputs()
                take_start_values(component, plan.inputs.ports[name])
        propagate(plan, start)
        for name, component in plan.system.components.items():
            with calling(name, "exit_initialization_mode", "initialization", start):
                component.exit_initialization_mode()
                component.get_outputs()
        for line in self._delays.values():
            line.fill()
        self._check_finite("exit_initialization_mode")
        self._number()
        self._prepare()
        self.recorder.record(0)
        self.marker[ROWS] = self.recorder.rows

    # -- turns ---------------------------------------------------------------------------------------------------------

    def _number(self) -> None:
        self._stages = [self._turns_of(phase) for phase in self.plan.phases]
        for place, (phase, turns) in enumerate(zip(self.plan.phases, self._stages, strict=True)):
            overlapping = [turn for turn in turns if may_overlap(turn)]
            together = SideBySide(overlapping, phase.parallel)
            if phase.parallel and len(together.groups()) > 1:
                self._joint[place] = self._join(together)

    def _turns_of(self, phase: Phase) -> list[Turn]:
        turns = [self._turn(self._calls_of(step), step) for step in phase.steps]
        return [*turns, self._repeated(phase.loop)] if phase.loop else turns

    def _repeated(self, loop: Loop) -> Turn:
        """A turn that stands for all rounds of a loop."""
        rounds = Rounds(loop, self.plan.signals, [self._round(phase) for phase in loop.phases], self._take)
        step = Step(loop.name, next(iter(loop.components.values())), 1, 0.0)
        return self._turn([Call(self._iterate, (rounds,), "a step in rounds")], step)

    def _round(self, phase: Phase) -> Round:
        again = [copy(gather) for gather in phase.gathers if not gather.delay]
        return again, [self._delays[gather].move for gather in phase.gathers if gather.delay], self._turns_of(phase)

    def _iterate(self, rounds: Rounds) -> int:
        before = self.termination

        def try_again() -> None:
            self.termination = before

        rounds.step(self._clock.value, try_again)
        return _TERMINATION if self.termination else 0

    def _take(self, turn: Turn, begin: int = 0) -> None:
        """Take a turn from Python, from one of its calls on."""
        for number, call in enumerate(turn.calls[begin:], start=turn.first + begin):
            self.marker[CALL] = number
            if (status := call.function(*call.arguments)) not in GOOD:
                self._bad_status(turn, call, status)
        if float_mode.changed():
            self._float_state_changed(turn, turn.calls[-1])

    def _move(self, gather: Gather) -> Move:
        return self._delays[gather].move if gather.delay else copy(gather)

    def _calls_of(self, step: Step) -> Sequence[Call]:
        return step.component.turn(self._clock, step.step_size) or [Call(self._python_turn, (step,), "do_step")]

    def _turn(self, calls: Sequence[Call], step: Step) -> Turn:
        first = self._turns[-1].first + len(self._turns[-1].calls) if self._turns else 0
        self._turns.append(Turn(step, calls, first))
        return self._turns[-1]

    def _join(self, together: SideBySide) -> Turn:
        """A turn that stands for several, which are taken at the same time."""
        names = [turn.step.name for turn in together.turns]
        step = Step(f"one of {shown(names)}", together.turns[0].step.component, 1, 0.0)
        return self._turn([Call(self._side_by_side, (together,), "a step side by side")], step)

    def _python_turn(self, step: Step) -> int:
        component = step.component
        try:  # as `blamed`, which costs as much as some components take for a step
            component.set_inputs()
            result = component.do_step(self._clock.value, step.step_size)
            if result is not None:
                self._ended_early(step, result)
            component.get_outputs()
        except (CosimError, *PASSING):
            raise
        except BaseException as error:
            raise ComponentError(step.name, "do_step", told(error), self._clock.value) from error
        return _TERMINATION if self.termination else 0

    @property
    def calls(self) -> list[tuple[str, str]]:
        """(component, function) of every call, by the number that stands in the marker."""
        return [(turn.step.name, call.name) for turn in self._turns for call in turn.calls]

    def _side_by_side(self, together: SideBySide) -> int:
        assert self._crew is not None
        endings = [ending for lane in self._crew.run(together.lanes) for ending in lane]
        for ending in sorted(endings, key=lambda ending: ending.turn.first):
            if ending.status is None:
                self._float_state_changed(ending.turn, ending.call)
            self._bad_status(ending.turn, ending.call, ending.status)
            self._take(ending.turn, ending.place + 1)
        return _TERMINATION if self.termination else 0

    def _turn_of(self, number: int) -> tuple[Turn, Call]:
        turn = next(turn for turn in reversed(self._turns) if turn.first <= number)
        return turn, turn.calls[number - turn.first]

    # -- what may happen in a step -------------------------------------------------------------------------------------

    def _bad_status(self, turn: Turn, call: Call, status: int) -> None:
        if status != _TERMINATION:
            self._ended_early(turn.step, turn.step.component.failed(call.name, status))

    def _ended_early(self, step: Step, result: StepResult) -> None:
        time = self._clock.value
        if not isinstance(result, StepResult):
            raise ComponentError(step.name, "do_step", f"returned {result!r}, expected None or a StepResult", time)
        complete = result.time_reached >= time + step.step_size
        if result.terminate_requested:
            if not self.termination or (self.termination.complete and not complete):
                self.termination = Termination(step.name, result.time_reached, complete)
        elif not complete:
            reached = f"reached only t = {result.time_reached!r} s of {time + step.step_size!r} s"
            raise ComponentError(step.name, "do_step", f"{reached}; staged stepping needs whole steps", time)

    def _float_state_changed(self, turn: Turn, call: Call) -> NoReturn:
        raise ComponentError(turn.step.name, call.name, float_mode.REASON, self._clock.value)

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
            if self._joint and self.finished < TRIALS:
                self._run(min(end, TRIALS))
                if self.finished == TRIALS:
                    self._decide()
            if not self.termination:
                self._run(end)
        except ComponentError:
            self._check_finite()  # more likely the cause than what failed upon it
            raise

    def _run(self, end: int) -> None:
        while self.finished < end and not self.termination:
            try:
                self._steps(self.finished, min(end, self.recorder.full_after(self.finished)))
            finally:
                self.recorder.advance(int(self.marker[ROWS]))

    @abstractmethod
    def _steps(self, first: int, end: int) -> None:
        """Macro steps from `first` on, until `end` at most, for whose rows there is room."""

    @abstractmethod
    def _measured(self) -> dict[int, float]:
        """The shortest doStep of every turn so far (s), by the number of the turn's first call."""

    def _decide(self) -> None:
        """After the first steps: put joint turns in the place of those that are worth it."""
        widest, seconds = 1, self._measured()
        for place, joint in self._joint.items():
            (together,) = joint.calls[0].arguments
            together.decide(seconds, processors())
            if together.lanes:
                self._stages[place] = [joint, *(turn for turn in self._stages[place] if not may_overlap(turn))]
            widest = max(widest, len(together.lanes))
        if widest > 1:
            self._crew = Crew(widest - 1, lambda turns: take(turns, self.finished))
        self._prepare()

    def close(self) -> None:
        """Let threads end; nothing is run any more."""
        if self._crew:
            self._crew.close()
