"""Execution of the steps of components, and checks of what they return.

A scheduled step is a sequence of prepared calls. Each returns a status or a result. Outputs must
be finite.
"""

import ctypes
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..core.component import SUCCESS_STATUSES, PreparedCall, StepResult
from ..core.errors import (
    PASS_THROUGH_EXCEPTIONS,
    ComponentError,
    CosimError,
    describe_exception,
    join_alternatives,
)
from ..process import float_mode
from ..process.journal import CALL_NUMBER, ROW_COUNT, STEP_COUNT, STEP_TIME
from .iteration import FixedPointIteration
from .plan import Plan, ScheduledStep, Step, all_steps
from .stop_conditions import MetCondition

#: status of a call into Python during which a component requested termination; no FMU can return it
_STATUS_TERMINATION = 1 << 32


class Termination(NamedTuple):
    """End of the simulation at `time` (s), before the stop time.

    Attributes:
        component: component that requested the end; "" if a condition ended the simulation.
        time: time (s).
        complete: the component reached the end of its step, so the macro step counts.
        condition: condition that ended the simulation.
    """

    component: str
    time: float
    complete: bool = True
    condition: MetCondition | None = None


class StepRunner:
    """Runs scheduled steps call by call, collects the termination request and raises the errors.

    Attributes:
        current_time: start of the current macro step (s), at an address that the calls share.
        termination: the end of the simulation before the stop time, if any.
    """

    def __init__(self, marker: np.ndarray):
        self.current_time = ctypes.c_double.from_buffer(marker.data, 8 * STEP_TIME)
        self.termination: Termination | None = None
        self._marker = marker.data
        self._float_mode = float_mode.FloatModeGuard()

    @property
    def completed_steps(self) -> int:
        """Number of macro steps completed so far, which is the number of the current one."""
        return self._marker[STEP_COUNT]

    @property
    def recorded_rows(self) -> int:
        """Number of rows recorded so far."""
        return self._marker[ROW_COUNT]

    @property
    def termination_status(self) -> int:
        """Status of a call into Python: not 0 after a termination request."""
        return _STATUS_TERMINATION if self.termination else 0

    def run_step(self, step: ScheduledStep, first: int = 0) -> None:
        """Run the calls of a step, beginning with the call at index `first`.

        Raises:
            ComponentError: a call failed.
        """
        for number, call in enumerate(step.calls[first:], start=step.first_call + first):
            self._marker[CALL_NUMBER] = number
            if (status := call.function(*call.arguments)) not in SUCCESS_STATUSES:
                self.handle_status(step, call, status)
        if float_mode.is_changed() or float_mode.enabled_traps():
            self.restore_float_mode(step.step.name)

    def run_python_component(self, step: Step) -> int:
        """Run set_inputs, do_step and get_outputs of a component without prepared calls.

        Returns a status.

        Raises:
            ComponentError: the component raised an exception or did not reach the end of its step.
        """
        component = step.component
        # written out: the context manager `as_component_error` costs as much as the step of some
        # components
        try:
            component.set_inputs()
            result = component.do_step(self.current_time.value, step.step_size)
            if result is not None:
                self._handle_step_result(step, result)
            component.get_outputs()
        except (CosimError, *PASS_THROUGH_EXCEPTIONS):
            raise
        except BaseException as error:
            raise ComponentError(
                step.name, "do_step", describe_exception(error), self.current_time.value
            ) from error
        return self.termination_status

    def run_iteration(self, iteration: FixedPointIteration) -> int:
        """Iterate the current macro step of a loop until it converges; returns a status.

        Raises:
            ComponentError: a component failed, or the iteration did not converge.
        """
        earlier_request = self.termination

        def discard_requests() -> None:
            self.termination = earlier_request

        iteration.step(self.current_time.value, discard_requests)
        return self.termination_status

    def handle_status(self, step: ScheduledStep, call: PreparedCall, status: int) -> None:
        """Interpret a status that is neither OK nor a warning.

        Raises:
            ComponentError: the status means that the call failed.
        """
        if status != _STATUS_TERMINATION:
            self._handle_step_result(
                step.step, step.step.component.interpret_status(call.name, status)
            )

    def _handle_step_result(self, step: Step, result: StepResult) -> None:
        time = self.current_time.value
        if not isinstance(result, StepResult):
            raise ComponentError(
                step.name, "do_step", f"returned {result!r}, expected None or a StepResult", time
            )
        end = time + step.step_size
        complete = result.time_reached >= end
        if result.terminate_requested:
            if not self.termination or (self.termination.complete and not complete):
                self.termination = Termination(step.name, min(result.time_reached, end), complete)
        elif not complete:
            reached = f"reached only t = {result.time_reached!r} s of {end!r} s"
            raise ComponentError(
                step.name, "do_step", f"{reached}; early return is not supported", time
            )

    def restore_float_mode(self, component: str) -> None:
        """Restore the default floating-point mode, which a step of `component` has changed."""
        self._float_mode.restore(component, "the step", self.current_time.value)

    def restore_float_traps(self, components: Iterable[str], end: float) -> None:
        """Disable floating-point traps that one of the components has enabled before `end` (s)."""
        self._float_mode.restore(join_alternatives(components), "a step", end, "before")


_FLOAT_DTYPES = (np.dtype(np.float64), np.dtype(np.float32))


class FiniteCheck:
    """Check of float outputs for NaN and infinity, according to `non_finite` of the settings.

    Args:
        plan: the compiled system.
        runner: provides the present time.
    """

    def __init__(self, plan: Plan, runner: StepRunner):
        self._plan, self._runner = plan, runner
        policy, recorded = plan.settings.non_finite, plan.settings.columns.values()
        connections = plan.system.connections if policy != "allow" else ()
        reader_of = {connection.source: connection.target for connection in reversed(connections)}
        checked = [
            *dict.fromkeys(connection.source for connection in connections),
            *(recorded if policy == "fail" else ()),
        ]
        order = {step.name: k for k, step in enumerate(all_steps(plan.all_phases))}
        # the cause before those that depend on it
        checked.sort(key=lambda endpoint: order.get(endpoint.component, 0))
        positions = [
            (endpoint, plan.outputs.positions[endpoint], reader_of.get(endpoint))
            for endpoint in dict.fromkeys(checked)
        ]
        self._checked = [each for each in positions if each[1].dtype in _FLOAT_DTYPES]

    @property
    def monitored_floats(self) -> list[np.ndarray]:
        """Arrays to monitor after each macro step.

        A value in them that is not finite requires a call of `run`.
        """
        arrays = []
        for dtype in _FLOAT_DTYPES:
            if offsets := [
                position.offset for _, position, _ in self._checked if position.dtype == dtype
            ]:
                arrays.append(self._plan.outputs.arrays[dtype][min(offsets) : max(offsets) + 1])
        return arrays

    def run(self, function: str = "do_step") -> None:
        """Check the present value of every checked output.

        Args:
            function: the function that computed the outputs, for the message.

        Raises:
            ComponentError: a checked output is NaN or infinite.
        """
        for endpoint, position, reader in self._checked:
            value = self._plan.outputs.arrays[position.dtype][position.offset]
            if not np.isfinite(value):
                time = self._plan.grid.time_at(
                    self._runner.completed_steps + (function == "do_step")
                )
                use = f"and {reader} reads it" if reader else f"and is recorded for t = {time!r} s"
                text = f'the output "{endpoint.scalar}" is {value}, {use}'
                raise ComponentError(
                    endpoint.component, function, text, self._runner.current_time.value
                )
