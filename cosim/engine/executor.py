"""The pure Python executor of a plan."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from ..component import Component, StepResult
from ..errors import ComponentError
from .plan import Gather, Plan, Step
from .recorder import Recorder

Action = Callable[[], object]


class Termination(NamedTuple):
    """A component asked to end the simulation."""

    component: str
    time: float


class _Turn(NamedTuple):
    """One component's turn with everything bound beforehand; gathers of its phase run before the first turn of it."""

    divisor: int
    step_size: float
    set_inputs: Action
    do_step: Callable[[float, float], StepResult | None]
    get_outputs: Action
    name: str


class Executor:
    """Initializes the components of a plan and runs macro steps."""

    def __init__(self, plan: Plan, recorder: Recorder):
        self.plan, self.recorder = plan, recorder
        self.termination: Termination | None = None
        #: macro steps finished so far
        self.finished = 0
        self._delays = [_DelayLine(gather) for phase in plan.phases for gather in phase.gathers if gather.delay]
        lines = {line.gather: line for line in self._delays}
        self._phases = [
            ([lines[g].move if g.delay else _move(g) for g in phase.gathers], [_turn(step) for step in phase.steps])
            for phase in plan.phases
        ]

    def initialize(self) -> None:
        """From freshly bound components to the initial outputs at the start time, recorded as row 0.

        In initialization mode outputs go to inputs again and again until nothing changes, at most once per component.
        """
        system, grid = self.plan.system, self.plan.grid
        start, stop = grid.seconds(0), grid.seconds(grid.count)
        for name, component in system.components.items():
            for variable, value in system.start_values.get(name, {}).items():
                component.set(variable, value)
        for component in system.components.values():
            component.enter_initialization_mode(start, stop)
            component.get_outputs()
        self._take_start_values()
        self._propagate(start)
        for component in system.components.values():
            component.exit_initialization_mode()
            component.get_outputs()
        for line in self._delays:
            line.fill()
        self.recorder.record(0)

    def _take_start_values(self) -> None:
        """Fill bound inputs that no connection feeds with the components' own values."""
        for name, (inputs, _) in self.plan.ports.items():
            component = self.plan.system.components[name]
            filled = dict.fromkeys(inputs.arrays, 0)
            for variable in inputs.variables:
                size = len(variable.slots)
                begin = filled[variable.dtype]
                inputs.arrays[variable.dtype][begin : begin + size] = component.get(variable.name)
                filled[variable.dtype] = begin + size

    def _propagate(self, time: float) -> None:
        moves = {step.name: [] for step in self.plan.steps}  # type: dict[str, list[Action]]
        for phase in self.plan.phases:
            for gather in phase.gathers:
                moves[gather.component].append(_move(gather))
        before = self._snapshot()
        for _ in range(len(moves) + 1):
            for name, component in self.plan.system.components.items():
                for move in moves[name]:
                    move()
                component.set_inputs()
                component.get_outputs()
            after = self._snapshot()
            if after == before:
                return
            changed, before = [name for name in moves if after[name] != before[name]], after
        loop = " -> ".join(changed)
        raise ComponentError(
            loop, "initialization", f"the outputs still change after {len(moves)} rounds: an algebraic loop", time
        )

    def _snapshot(self) -> dict[str, list[object]]:
        return {
            name: [array.tolist() if array.dtype.hasobject else array.tobytes() for array in outputs.arrays.values()]
            for name, (_, outputs) in self.plan.ports.items()
        }

    def run(self, end: int) -> None:
        """Macro steps until communication point `end` is reached, or a component asks to terminate."""
        seconds, phases, record = self.plan.grid.seconds, self._phases, self.recorder.record
        for n in range(self.finished, end):
            time = seconds(n)
            for moves, turns in phases:
                for move in moves:
                    move()
                for divisor, step_size, set_inputs, do_step, get_outputs, name in turns:
                    if divisor != 1 and n % divisor:
                        continue
                    set_inputs()
                    result = do_step(time, step_size)
                    if result is not None:
                        self._ended_early(name, time, step_size, result)
                    get_outputs()
            self.finished = n + 1
            record(n + 1)
            if self.termination:
                return

    def _ended_early(self, name: str, time: float, step_size: float, result: StepResult) -> None:
        if result.terminate_requested:
            self.termination = self.termination or Termination(name, result.time_reached)
        elif result.time_reached < time + step_size:
            reached = f"reached only t = {result.time_reached!r} s of {time + step_size!r} s"
            raise ComponentError(name, "do_step", f"{reached}; staged stepping needs whole steps", time)


def _turn(step: Step) -> _Turn:
    component: Component = step.component
    return _Turn(step.divisor, step.step_size, component.set_inputs, component.do_step, component.get_outputs, step.name)


def _move(gather: Gather) -> Action:
    """The gather as one call that allocates as little as numpy allows."""
    first, count = int(gather.target_indices[0]), len(gather.target_indices)
    together = np.array_equal(gather.target_indices, np.arange(first, first + count))
    same = gather.source.dtype == gather.target.dtype and gather.factor is None
    if same and together:
        return partial(gather.source.take, gather.source_indices, None, gather.target[first : first + count], "clip")
    return partial(_scatter, gather, gather.source, gather.source_indices)


def _scatter(gather: Gather, source: np.ndarray, indices: np.ndarray) -> None:
    values = source[indices]
    if gather.factor is not None:
        values = gather.factor * values + gather.offset
    gather.target[gather.target_indices] = values


class _DelayLine:
    """A gather whose values arrive `delay` macro steps late; until then the initial outputs do."""

    def __init__(self, gather: Gather):
        self.gather = gather
        self._ring = np.empty((gather.delay, len(gather.source_indices)), gather.source.dtype)
        self._oldest = 0
        self._all = np.arange(len(gather.source_indices))

    def fill(self) -> None:
        self._ring[:] = self.gather.source[self.gather.source_indices]

    def move(self) -> None:
        oldest = self._ring[self._oldest]
        _scatter(self.gather, oldest, self._all)
        oldest[:] = self.gather.source[self.gather.source_indices]
        self._oldest = (self._oldest + 1) % len(self._ring)
