"""Common base of the pure Python and the native executor, whose results are bit-identical."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from ..core.errors import ComponentError
from ..process.float_mode import enabled_traps
from ..process.journal import CALL_NUMBER, MARKER_SIZE, ROW_COUNT, STEP_COUNT
from .initialization import initialize_components
from .parallel import MEASURED_STEPS, ParallelSteps
from .plan import Plan, all_transfers
from .recorder import Recorder
from .schedule import Schedule
from .step_runner import FiniteCheck, StepRunner, Termination
from .stop_conditions import StopConditions
from .transfer_plan import DelayLine, Transfer, TransferCall, compile_transfer


class ExecutorState(NamedTuple):
    """State of an executor at a communication point."""

    completed_steps: int
    row_count: int
    termination: Termination | None
    inputs: Sequence[np.ndarray]
    outputs: Sequence[np.ndarray]
    #: values in the delays, the oldest ones first
    rings: Sequence[np.ndarray]
    #: since when each stop condition has been met
    condition_begins: Sequence[int | None]


class Executor(ABC):
    """Initializes the components of a plan and runs macro steps.

    Args:
        plan: the compiled system.
        recorder: stores the recorded outputs.
        marker: int64 array, shape (MARKER_SIZE,), updated before every call, so that a process
            which shares its memory can see the current call; see CALL_NUMBER, STEP_COUNT and
            ROW_COUNT in `process.journal`.
    """

    def __init__(self, plan: Plan, recorder: Recorder, marker: np.ndarray | None = None):
        self.plan, self.recorder = plan, recorder
        self.marker = np.zeros(MARKER_SIZE, np.int64) if marker is None else marker
        self._runner = StepRunner(self.marker)
        self._finite_check = FiniteCheck(plan, self._runner)
        self._delay_lines = {t: DelayLine(t) for t in all_transfers(plan.all_phases) if t.delay}
        self._schedule = Schedule(plan, self._runner, self._delay_lines)
        self._parallel_steps = ParallelSteps(self._runner)
        #: conditions that end the simulation, and their state
        self.stop_conditions = StopConditions(plan)

    @property
    def completed_steps(self) -> int:
        """Number of macro steps completed so far."""
        return self._runner.completed_steps

    @property
    def time(self) -> float:
        """Time of the present communication point (s)."""
        return self.plan.grid.time_at(self.completed_steps)

    @property
    def termination(self) -> Termination | None:
        """End before the stop time that a component or a condition requested, if there was one."""
        return self._runner.termination

    @property
    def is_finished(self) -> bool:
        """True at the last communication point, and after a component has requested termination."""
        return (
            self._runner.completed_steps >= self.plan.grid.count
            or self._runner.termination is not None
        )

    def describe_call(self) -> tuple[str, str]:
        """Return component and function of the present call of the stepping loop."""
        number, names = int(self.marker[CALL_NUMBER]), self._schedule.call_names
        return names[number] if 0 <= number < len(names) else ("the run", "moving values")

    def initialize(self) -> None:
        """Bring the components from instantiated to step mode, and record the initial outputs.

        Raises:
            ComponentError: a component failed, an algebraic loop did not converge, or a checked
                output is not finite.
        """
        self._runner.current_time.value = self.plan.grid.time_at(0)
        initialize_components(self.plan)
        for line in self._delay_lines.values():
            line.fill()
        self._finite_check.run("exit_initialization_mode")
        self._schedule.prepare()
        self._parallel_steps.find_candidates(self.plan.phases, self._schedule)
        self._prepare()
        self.recorder.record(self.time)
        self.recorder.write_header(self._schedule.call_names)
        self.marker[ROW_COUNT] = self.recorder.row_count
        self._check_stop_conditions(0)

    def _check_stop_conditions(self, n: int) -> None:
        """End the simulation at communication point `n` if a condition requires it.

        The point is recorded. A request of a component has priority.
        """
        met = self.stop_conditions.check(n)
        if met and not self._runner.termination:
            self._runner.termination = Termination("", met.time, condition=met)

    def record_between(self, time: Fraction | float) -> None:
        """Record the present outputs as a row at a time that is not a communication point.

        Several rows may have the same time, such as the limits of a signal before and after an
        event. Components may call it in a macro step, and others between two macro steps. Stop
        conditions are evaluated at communication points only.

        Args:
            time: exact time (s); float64 rounds it once.

        Raises:
            ValueError: the time lies before the last row, or after the next communication point.
        """
        recorder, runner = self.recorder, self._runner
        recorder.row_count = runner.recorded_rows
        earliest = recorder.last_time
        latest = self.plan.grid.time_at(min(self.completed_steps + 1, self.plan.grid.count))
        if not earliest <= float(time) <= latest:
            raise ValueError(
                f"cannot record a row at t = {float(time)!r} s: expected a time from the last row, "
                f"{earliest!r} s, to the next communication point, {latest!r} s"
            )
        recorder.record(float(time))
        recorder.provide_rows()
        self.marker[ROW_COUNT] = recorder.row_count

    def run(self, end: int) -> None:
        """Run macro steps until communication point `end`, or until the simulation ends before.

        Raises:
            ComponentError: a component failed, or a checked output is not finite.
        """
        try:
            if self._parallel_steps.has_candidates and self.completed_steps < MEASURED_STEPS:
                self._run_until(min(end, MEASURED_STEPS))
                if self.completed_steps == MEASURED_STEPS:
                    self._parallel_steps.decide(self._schedule, self._step_durations())
                    self._rebuild()
            if not self.termination:
                self._run_until(end)
        except ComponentError:
            self._finite_check.run()  # a value that is not finite is the more likely cause
            raise

    def _run_until(self, end: int) -> None:
        runner = self._runner
        changes = sorted(self.plan.shorter_steps)
        while (n := runner.completed_steps) < end and not runner.termination:
            if changes:
                self._choose_step_sizes(n)
            try:
                next_change = next((point for point in changes if point > n), end)
                self.recorder.provide_rows()
                self._run_macro_steps(n, min(end, next_change))
                if enabled_traps():
                    self._restore_float_traps(self.completed_steps)
            finally:
                self.recorder.row_count = runner.recorded_rows

    def _choose_step_sizes(self, n: int) -> None:
        """Prepare the steps with their sizes in macro step `n`, if these have changed.

        They run on one thread from now on.
        """
        sizes: dict[str, float] = {}
        for begin, some in self.plan.shorter_steps.items():
            if begin <= n:
                sizes |= some
        if sizes == self._schedule.shorter_steps:
            return
        self._parallel_steps.withdraw_candidates()
        self._schedule.prepare(sizes)
        last = (
            self.plan.grid.end
            - self.plan.grid.start
            - self.plan.grid.whole_steps * self.plan.grid.step
        )
        for line in self._delay_lines.values():
            line.shorten_step(float(last) if n + 1 == self.plan.grid.count else None)
        self._rebuild()

    def save(self) -> ExecutorState:
        """Return the state: numbers of steps and rows, and the values of ports and delays."""
        self._rebuild()
        rings = [line.ring.copy() for line in self._delay_lines.values()]
        inputs, outputs = self.plan.inputs.copy_values(), self.plan.outputs.copy_values()
        begins = list(self.stop_conditions.begins)
        return ExecutorState(
            self.completed_steps,
            self.recorder.row_count,
            self.termination,
            inputs,
            outputs,
            rings,
            begins,
        )

    def restore(self, state: ExecutorState) -> None:
        """Restore a state that `save` returned; the components are restored separately."""
        for line, ring in zip(self._delay_lines.values(), state.rings, strict=True):
            line.restore(ring)
        self.plan.inputs.restore_values(state.inputs)
        self.plan.outputs.restore_values(state.outputs)
        self.recorder.rewind(state.row_count)
        self._runner.termination = state.termination
        self.stop_conditions.restore(state.condition_begins)
        self._runner.current_time.value = self.plan.grid.time_at(state.completed_steps)
        self.marker[STEP_COUNT], self.marker[ROW_COUNT] = state.completed_steps, state.row_count
        self._prepare()

    def _rebuild(self) -> None:
        """Prepare the macro steps again, with the oldest values of every delay first."""
        for transfer, line in self._delay_lines.items():
            line.align_ring(self._native_transfers(transfer))
        self._prepare()

    def _native_transfers(self, _transfer: Transfer) -> int:
        """Return how often C code has made a delayed transfer since `_prepare`."""
        return 0

    def close(self) -> None:
        """End the threads; no step may be run afterwards."""
        self._parallel_steps.close()

    def _restore_float_mode(self, call_number: int) -> None:
        """Restore the default floating-point mode, which the step of this call has changed."""
        step, _ = self._schedule.find_call(call_number)
        self._runner.restore_float_mode(step.step.name)

    def _restore_float_traps(self, n: int) -> None:
        """Disable floating-point traps that a step before communication point `n` has enabled."""
        self._runner.restore_float_traps(self.plan.system.components, self.plan.grid.time_at(n))

    def _transfer_call(self, transfer: Transfer) -> TransferCall:
        return self._delay_lines[transfer].apply if transfer.delay else compile_transfer(transfer)

    @abstractmethod
    def _prepare(self) -> None:
        """Prepare the macro steps.

        Called after initialization, and again when the schedule has changed.
        """

    @abstractmethod
    def _run_macro_steps(self, first: int, end: int) -> None:
        """Run macro steps from number `first` up to at most `end`.

        The current chunk has space for one row at least. A full chunk ends the call early.
        """

    @abstractmethod
    def _step_durations(self) -> Mapping[int, float]:
        """Return the shortest doStep duration so far (s) by the number of the step's first call."""
