"""Check that outputs are finite."""

from __future__ import annotations

import numpy as np

from ..core.errors import ComponentError
from .plan import Plan
from .step_runner import StepRunner

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
        order = {
            step.name: k
            for k, step in enumerate(step for phase in plan.all_phases for step in phase.steps)
        }
        checked.sort(
            key=lambda endpoint: order.get(endpoint.component, 0)
        )  # the cause before those that depend on it
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
