"""Runs a plan: from fresh components through initialization, macro step by macro step.

There are two executors with bit-identical results: the pure Python one, always available, and the native one.
"""

from __future__ import annotations

import ctypes
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from ..core.component import SUCCESS_STATUSES, PreparedCall, StepResult
from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, CosimError, describe_exception
from ..core.processors import available_processors
from ..process import float_mode
from ..process.journal import calling_component
from .component_step import ScheduledStep, StepFailure, abbreviate_names, run_due
from .initialization import copy_start_values, propagate_initial_values
from .iteration import FixedPointIteration, IterationPhase
from .parallel import MEASURED_STEPS, ParallelGroup, ThreadPool, releases_gil
from .plan import Loop, Phase, Plan, Step
from .recorder import Recorder
from .transfer_calls import DelayLine, TransferCall, compile_transfer
from .transfer_plan import Transfer

#: places in the marker: number of the present call, macro steps finished, rows recorded
MARKER_CALL, MARKER_STEPS, MARKER_ROWS, MARKER_SIZE = 0, 1, 2, 3

#: status of a Python component's turn in a macro step after which the simulation ends; no FMU can return it
_STATUS_TERMINATION = 1 << 32

_FLOAT_DTYPES = (np.dtype(np.float64), np.dtype(np.float32))


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

    def __init__(self, plan: Plan, recorder: Recorder, marker: np.ndarray | None = None, require_finite: bool = True):
        self.plan, self.recorder = plan, recorder
        self.termination: Termination | None = None
        self.marker = np.zeros(MARKER_SIZE, np.int64) if marker is None else marker
        self._require_finite = require_finite
        self._current_time = ctypes.c_double()
        self._delay_lines = {g: DelayLine(g) for phase in plan.all_phases for g in phase.transfers if g.delay}
        self._scheduled_steps: list[ScheduledStep] = []
        #: the turns of each phase
        self._phase_steps: list[list[ScheduledStep]] = []
        #: joint turns that may take the place of others in a phase, by the number of the phase
        self._parallel_steps: dict[int, ScheduledStep] = {}
        self._thread_pool: ThreadPool[Sequence[ScheduledStep], list[StepFailure]] | None = None

    @property
    def completed_steps(self) -> int:
        """Macro steps finished so far."""
        return int(self.marker[MARKER_STEPS])

    # -- initialization ------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Bind all components to their arrays and instantiate them: FMUs are extracted and loaded here."""
        for name, component in self.plan.system.components.items():
            with calling_component(name, "bind", "load"):
                component.bind(self.plan.inputs.ports[name], self.plan.outputs.ports[name])
            with calling_component(name, "instantiate", "load"):
                component.instantiate()

    def initialize(self) -> None:
        """From instantiated components to the initial outputs at the start time, recorded as row 0.

        In initialization mode outputs go to inputs again and again until nothing changes (see `initialization`).
        """
        plan, grid = self.plan, self.plan.grid
        start, stop = grid.time_at(0), grid.time_at(grid.count)
        self._current_time.value = start
        for name, component in plan.system.components.items():
            with calling_component(name, "set", "initialization"):
                for variable, value in plan.system.start_values.get(name, {}).items():
                    component.set(variable, value)
        for name, component in plan.system.components.items():
            with calling_component(name, "enter_initialization_mode", "initialization", start):
                component.enter_initialization_mode(start, stop)
                component.get_outputs()
                copy_start_values(component, plan.inputs.ports[name])
        propagate_initial_values(plan, start)
        for name, component in plan.system.components.items():
            with calling_component(name, "exit_initialization_mode", "initialization", start):
                component.exit_initialization_mode()
                component.get_outputs()
        for line in self._delay_lines.values():
            line.fill()
        self._check_finite("exit_initialization_mode")
        self._schedule()
        self._prepare()
        self.recorder.record(0)
        self.marker[MARKER_ROWS] = self.recorder.row_count

    # -- turns ---------------------------------------------------------------------------------------------------------

    def _schedule(self) -> None:
        self._phase_steps = [self._schedule_phase(phase) for phase in self.plan.phases]
        for place, (phase, turns) in enumerate(zip(self.plan.phases, self._phase_steps, strict=True)):
            overlapping = [turn for turn in turns if releases_gil(turn)]
            together = ParallelGroup(overlapping, phase.parallel)
            if phase.parallel and len(together.exclusive_groups()) > 1:
                self._parallel_steps[place] = self._schedule_parallel(together)

    def _schedule_phase(self, phase: Phase) -> list[ScheduledStep]:
        turns = [self._add_scheduled_step(self._step_calls(step), step) for step in phase.steps]
        return [*turns, self._schedule_loop(phase.loop)] if phase.loop else turns

    def _schedule_loop(self, loop: Loop) -> ScheduledStep:
        """A turn that stands for all rounds of a loop."""
        rounds = FixedPointIteration(
            loop, self.plan.outputs, [self._iteration_phase(phase) for phase in loop.phases], self._run_step
        )
        step = Step(loop.name, next(iter(loop.components.values())), 1, 0.0)
        return self._add_scheduled_step([PreparedCall(self._run_iteration, (rounds,), "a step in rounds")], step)

    def _iteration_phase(self, phase: Phase) -> IterationPhase:
        again = [compile_transfer(gather) for gather in phase.transfers if not gather.delay]
        return again, [self._delay_lines[gather].apply for gather in phase.transfers if gather.delay], self._schedule_phase(phase)

    def _run_iteration(self, rounds: FixedPointIteration) -> int:
        before = self.termination

        def try_again() -> None:
            self.termination = before

        rounds.step(self._current_time.value, try_again)
        return _STATUS_TERMINATION if self.termination else 0

    def _run_step(self, turn: ScheduledStep, begin: int = 0) -> None:
        """Take a turn from Python, from one of its calls on."""
        for number, call in enumerate(turn.calls[begin:], start=turn.first_call + begin):
            self.marker[MARKER_CALL] = number
            if (status := call.function(*call.arguments)) not in SUCCESS_STATUSES:
                self._handle_status(turn, call, status)
        if float_mode.is_changed():
            self._raise_float_mode_changed(turn, turn.calls[-1])

    def _transfer_call(self, gather: Transfer) -> TransferCall:
        return self._delay_lines[gather].apply if gather.delay else compile_transfer(gather)

    def _step_calls(self, step: Step) -> Sequence[PreparedCall]:
        return step.component.prepare_step_calls(self._current_time, step.step_size) or [
            PreparedCall(self._run_python_component, (step,), "do_step")
        ]

    def _add_scheduled_step(self, calls: Sequence[PreparedCall], step: Step) -> ScheduledStep:
        first = self._scheduled_steps[-1].first_call + len(self._scheduled_steps[-1].calls) if self._scheduled_steps else 0
        self._scheduled_steps.append(ScheduledStep(step, calls, first))
        return self._scheduled_steps[-1]

    def _schedule_parallel(self, together: ParallelGroup) -> ScheduledStep:
        """A turn that stands for several, which are taken at the same time."""
        names = [turn.step.name for turn in together.steps]
        step = Step(f"one of {abbreviate_names(names)}", together.steps[0].step.component, 1, 0.0)
        return self._add_scheduled_step([PreparedCall(self._run_parallel, (together,), "a step side by side")], step)

    def _run_python_component(self, step: Step) -> int:
        component = step.component
        try:  # as `blamed`, which costs as much as some components take for a step
            component.set_inputs()
            result = component.do_step(self._current_time.value, step.step_size)
            if result is not None:
                self._handle_step_result(step, result)
            component.get_outputs()
        except (CosimError, *PASS_THROUGH_EXCEPTIONS):
            raise
        except BaseException as error:
            raise ComponentError(step.name, "do_step", describe_exception(error), self._current_time.value) from error
        return _STATUS_TERMINATION if self.termination else 0

    @property
    def call_names(self) -> list[tuple[str, str]]:
        """(component, function) of every call, by the number that stands in the marker."""
        return [(turn.step.name, call.name) for turn in self._scheduled_steps for call in turn.calls]

    def _run_parallel(self, together: ParallelGroup) -> int:
        assert self._thread_pool is not None
        endings = [ending for lane in self._thread_pool.map(together.partitions) for ending in lane]
        for ending in sorted(endings, key=lambda ending: ending.step.first_call):
            if ending.status is None:
                self._raise_float_mode_changed(ending.step, ending.call)
            self._handle_status(ending.step, ending.call, ending.status)
            self._run_step(ending.step, ending.call_index + 1)
        return _STATUS_TERMINATION if self.termination else 0

    def _find_call(self, number: int) -> tuple[ScheduledStep, PreparedCall]:
        turn = next(turn for turn in reversed(self._scheduled_steps) if turn.first_call <= number)
        return turn, turn.calls[number - turn.first_call]

    # -- what may happen in a step -------------------------------------------------------------------------------------

    def _handle_status(self, turn: ScheduledStep, call: PreparedCall, status: int) -> None:
        if status != _STATUS_TERMINATION:
            self._handle_step_result(turn.step, turn.step.component.interpret_status(call.name, status))

    def _handle_step_result(self, step: Step, result: StepResult) -> None:
        time = self._current_time.value
        if not isinstance(result, StepResult):
            raise ComponentError(step.name, "do_step", f"returned {result!r}, expected None or a StepResult", time)
        complete = result.time_reached >= time + step.step_size
        if result.terminate_requested:
            if not self.termination or (self.termination.complete and not complete):
                self.termination = Termination(step.name, result.time_reached, complete)
        elif not complete:
            reached = f"reached only t = {result.time_reached!r} s of {time + step.step_size!r} s"
            raise ComponentError(step.name, "do_step", f"{reached}; staged stepping needs whole steps", time)

    def _raise_float_mode_changed(self, turn: ScheduledStep, call: PreparedCall) -> NoReturn:
        raise ComponentError(turn.step.name, call.name, float_mode.CHANGE_REASON, self._current_time.value)

    def _check_finite(self, function: str = "do_step") -> None:
        """Raises ComponentError when an output that feeds something is not finite."""
        if not self._require_finite:
            return
        for connection in self.plan.system.connections:
            slot = self.plan.outputs.positions[connection.source]
            if slot.dtype in _FLOAT_DTYPES and not np.isfinite(value := self.plan.outputs.arrays[slot.dtype][slot.offset]):
                output = f'the output "{connection.source.scalar}" is {value}, and {connection.target} reads it'
                raise ComponentError(connection.source.component, function, output, self._current_time.value)

    @property
    def monitored_floats(self) -> list[np.ndarray]:
        """Arrays to look at after each macro step: when a value in them is not finite, `_check_finite` decides."""
        arrays = self.plan.outputs.arrays
        return [arrays[dtype] for dtype in _FLOAT_DTYPES if dtype in arrays and self._require_finite]

    # -- macro steps ---------------------------------------------------------------------------------------------------

    @abstractmethod
    def _prepare(self) -> None:
        """Make everything ready for `run`, after initialization."""

    def run(self, end: int) -> None:
        """Macro steps until communication point `end` is reached, or a component asks to terminate."""
        try:
            if self._parallel_steps and self.completed_steps < MEASURED_STEPS:
                self._run_until(min(end, MEASURED_STEPS))
                if self.completed_steps == MEASURED_STEPS:
                    self._parallelize()
            if not self.termination:
                self._run_until(end)
        except ComponentError:
            self._check_finite()  # more likely the cause than what failed upon it
            raise

    def _run_until(self, end: int) -> None:
        while self.completed_steps < end and not self.termination:
            try:
                self._run_macro_steps(self.completed_steps, min(end, self.recorder.last_point_in_chunk(self.completed_steps)))
            finally:
                self.recorder.set_row_count(int(self.marker[MARKER_ROWS]))

    @abstractmethod
    def _run_macro_steps(self, first: int, end: int) -> None:
        """Macro steps from `first` on, until `end` at most, for whose rows there is room."""

    @abstractmethod
    def _step_durations(self) -> dict[int, float]:
        """The shortest doStep of every turn so far (s), by the number of the turn's first call."""

    def _parallelize(self) -> None:
        """After the first steps: put joint turns in the place of those that are worth it."""
        widest, seconds = 1, self._step_durations()
        for place, joint in self._parallel_steps.items():
            (together,) = joint.calls[0].arguments
            together.partition(seconds, available_processors())
            if together.partitions:
                self._phase_steps[place] = [joint, *(turn for turn in self._phase_steps[place] if not releases_gil(turn))]
            widest = max(widest, len(together.partitions))
        if widest > 1:
            self._thread_pool = ThreadPool(widest - 1, lambda turns: run_due(turns, self.completed_steps))
        self._prepare()

    def close(self) -> None:
        """Let threads end; nothing is run any more."""
        if self._thread_pool:
            self._thread_pool.close()
