"""Executor that adds values to inputs while it steps, for linearisation and frequency responses."""

from collections import defaultdict
from collections.abc import Callable, Sequence, Set
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.system import Endpoint, System
from .plan import Phase, Plan, ScheduledStep
from .python_executor import PythonExecutor, _CompiledPhase
from .recorder import Recorder


class PerturbationTarget(NamedTuple):
    """Input or tunable parameter that gets `factor` times the value of a channel."""

    endpoint: Endpoint
    factor: float = 1.0


class _ConnectedInput(NamedTuple):
    """Element of a connected input.

    `observed`: its value before the addition is that of the channel.
    """

    values: memoryview
    offset: int
    channel: int
    factor: float
    observed: bool


class PerturbingExecutor(PythonExecutor):
    """Executor in pure Python that adds a row of values to channels of inputs in every macro step.

    A value is added to a connected input after its transfer. An input without a connection and a
    tunable parameter are set to the value that they had when the channels were chosen, plus the
    added value.

    Attributes:
        observed: Value of each channel before the addition, shape (steps, channels); 0 for a
            channel without a connection.
    """

    def __init__(self, plan: Plan, recorder: Recorder, marker: np.ndarray | None = None):
        super().__init__(plan, recorder, marker)
        self._active: Set[str] | None = None
        self._connected: dict[int, list[_ConnectedInput]] = {}
        self._setters: list[tuple[int, Callable[[float], None]]] = []
        self.set_values(np.zeros((0, 0)))

    def set_channels(
        self, channels: Sequence[Sequence[PerturbationTarget]], active: Set[str] | None = None
    ) -> None:
        """Choose the inputs of each channel, and the components that step.

        The others hold their outputs.

        Args:
            channels: Targets of each channel.
            active: Names of components; None: all.

        Raises:
            InputError: An input belongs to components that are iterated within a macro step.
        """
        self._active = active
        self._connected, self._setters = defaultdict(list), []
        last_phases, positions = self._last_phases(), self.plan.inputs.positions
        fed = {connection.target for connection in self.plan.system.connections}
        for channel, targets in enumerate(channels):
            inputs = [target for target in targets if target.endpoint in fed]
            if iterated := [
                str(each.endpoint) for each in inputs if positions[each.endpoint] not in last_phases
            ]:
                raise InputError(
                    f"{iterated[0]} belongs to components that are iterated within a macro step, "
                    "expected another input"
                )
            inputs.sort(key=lambda each: last_phases[positions[each.endpoint]])
            for i, (endpoint, factor) in enumerate(inputs):
                dtype, offset = position = positions[endpoint]
                element = _ConnectedInput(
                    self.plan.inputs.arrays[dtype].data, offset, channel, factor, not i
                )
                self._connected[last_phases[position]].append(element)
            self._setters += [
                (channel, _setter(self.plan.system, each))
                for each in targets
                if each.endpoint not in fed
            ]
        self._prepare()

    def set_values(self, values: np.ndarray) -> None:
        """Add a row of `values`, shape (steps, channels), in each of the next macro steps."""
        self._values, self._begin = values, self.completed_steps
        self.observed, self._last_row = np.zeros(values.shape), np.zeros(values.shape[1])

    def _last_phases(self) -> dict[Any, int]:
        """Return the last phase in which each connected input is transferred, by its position."""
        return {
            (transfer.target.dtype, offset): number
            for number, phase in enumerate(self.plan.phases)
            for transfer in phase.transfers
            for offset in transfer.target_indices.tolist()
        }

    def _prepare(self) -> None:
        super()._prepare()
        hooks: dict[int, list[Callable[[], object]]] = {
            i: [partial(self._add, inputs)] for i, inputs in self._connected.items()
        }
        if self._setters:
            hooks.setdefault(0, []).append(self._set_free_inputs)
        self._phases = [
            each._replace(transfers=[*each.transfers, *hooks.get(i, ())])
            for i, each in enumerate(self._phases)
        ]

    def _compile_phase(self, phase: Phase, steps: Sequence[ScheduledStep]) -> _CompiledPhase:
        active = self._active
        return super()._compile_phase(
            phase, [step for step in steps if active is None or step.step.name in active]
        )

    def _add(self, inputs: Sequence[_ConnectedInput]) -> None:
        row = self.completed_steps - self._begin
        if row < len(self._values):
            values, observed = self._values[row], self.observed[row]
            for memory, offset, channel, factor, is_observed in inputs:
                if is_observed:
                    observed[channel] = memory[offset] / factor
                memory[offset] += factor * values[channel]

    def _set_free_inputs(self) -> None:
        row = self.completed_steps - self._begin
        values = self._values[row] if row < len(self._values) else np.zeros(len(self._last_row))
        for channel, assign in self._setters:
            if values[channel] != self._last_row[channel]:
                assign(float(values[channel]))
        self._last_row = values


def _setter(system: System, target: PerturbationTarget) -> Callable[[float], None]:
    """Return a function that sets an input to its present value plus a multiple of its argument."""
    endpoint, factor = target
    component, (variable, element) = (
        system.components[endpoint.component],
        system.find_element(endpoint),
    )
    present = component.get(variable.name)

    def assign(value: float) -> None:
        if variable.shape:
            changed = list(present)
            changed[element] += factor * value
        else:
            changed = present + factor * value
        component.set(variable.name, changed)

    return assign
