"""The pure Python executor of a plan."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..component import Call, Component, Ports, StepResult
from ..errors import ComponentError
from .plan import Gather, Plan, Step
from .recorder import Recorder

Action = Callable[[], object]

#: the highest FMI status that lets a simulation go on
WARNING = 1

#: up to so many values are faster assigned one by one than by numpy
FEW = 4


class Termination(NamedTuple):
    """A component asked to end the simulation."""

    component: str
    time: float


class _Turn(NamedTuple):
    """One component's turn as calls that return an FMI status."""

    divisor: int
    calls: Sequence[Call]
    step: Step


class Executor:
    """Initializes the components of a plan and runs macro steps."""

    def __init__(self, plan: Plan, recorder: Recorder):
        self.plan, self.recorder = plan, recorder
        self.termination: Termination | None = None
        #: macro steps finished so far
        self.finished = 0
        self._clock = ctypes.c_double()
        self._delays = {g: _DelayLine(g) for phase in plan.phases for g in phase.gathers if g.delay}
        self._phases: list[tuple[list[Action], list[_Turn]]] = []

    def initialize(self) -> None:
        """From fresh components to the initial outputs at the start time, recorded as row 0.

        In initialization mode outputs go to inputs again and again until nothing changes, at most once per component.
        """
        plan, grid = self.plan, self.plan.grid
        start, stop = grid.seconds(0), grid.seconds(grid.count)
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
        self._phases = [
            ([self._move(gather) for gather in phase.gathers], [self._turn(step) for step in phase.steps])
            for phase in plan.phases
        ]
        self.recorder.record(0)

    def _propagate(self, time: float) -> None:
        moves = [_copy(gather) for phase in self.plan.phases for gather in phase.gathers]
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

    def _move(self, gather: Gather) -> Action:
        return self._delays[gather].move if gather.delay else _copy(gather)

    def _turn(self, step: Step) -> _Turn:
        calls = step.component.turn(self._clock, step.step_size)
        return _Turn(step.divisor, calls or [Call(self._python_turn, (step,), "do_step")], step)

    def _python_turn(self, step: Step) -> int:
        component = step.component
        component.set_inputs()
        result = component.do_step(self._clock.value, step.step_size)
        if result is not None:
            self._ended_early(step, result)
        component.get_outputs()
        return 0

    def run(self, end: int) -> None:
        """Macro steps until communication point `end` is reached, or a component asks to terminate."""
        seconds, phases, record, clock = self.plan.grid.seconds, self._phases, self.recorder.record, self._clock
        warning = WARNING
        for n in range(self.finished, end):
            clock.value = seconds(n)
            for moves, turns in phases:
                for move in moves:
                    move()
                for divisor, calls, step in turns:
                    if divisor != 1 and n % divisor:
                        continue
                    for function, arguments, name in calls:
                        status = function(*arguments)
                        if status > warning:
                            self._ended_early(step, step.component.failed(name, status))
                            break
            self.finished = n + 1
            record(n + 1)
            if self.termination:
                return

    def _ended_early(self, step: Step, result: StepResult) -> None:
        time = self._clock.value
        if result.terminate_requested:
            self.termination = self.termination or Termination(step.name, result.time_reached)
        elif result.time_reached < time + step.step_size:
            reached = f"reached only t = {result.time_reached!r} s of {time + step.step_size!r} s"
            raise ComponentError(step.name, "do_step", f"{reached}; staged stepping needs whole steps", time)


def _take_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's own values, which those keep that no connection feeds."""
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.slots)
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)


def _copy(gather: Gather) -> Action:
    """The gather, its delay left aside, as one call that allocates as little as numpy allows."""
    first, count = int(gather.target_indices[0]), len(gather.target_indices)
    together = np.array_equal(gather.target_indices, np.arange(first, first + count))
    if count <= FEW and gather.factor is None and not gather.source.dtype.hasobject:
        places = list(zip(gather.target_indices.tolist(), gather.source_indices.tolist(), strict=True))
        return partial(_assign, gather.target.data, gather.source.data, places)
    if gather.factor is not None or gather.source.dtype != gather.target.dtype or not together:
        return partial(_scatter, gather, gather.source, gather.source_indices)
    return partial(gather.source.take, gather.source_indices, None, gather.target[first : first + count], "clip")


def _assign(target: memoryview, source: memoryview, places: Sequence[tuple[int, int]]) -> None:
    for i, j in places:
        target[i] = source[j]


def _scatter(gather: Gather, source: np.ndarray, indices: np.ndarray) -> None:
    values: Any = source[indices]
    if gather.factor is not None:
        values = gather.factor * values + gather.offset
    gather.target[gather.target_indices] = values


class _DelayLine:
    """A gather whose values arrive `delay` macro steps late; until then the initial outputs do."""

    def __init__(self, gather: Gather):
        self._gather = gather
        self._ring = np.empty((gather.delay, len(gather.source_indices)), gather.source.dtype)
        self._oldest = 0
        self._all = np.arange(len(gather.source_indices))

    def fill(self) -> None:
        self._ring[:] = self._gather.source[self._gather.source_indices]

    def move(self) -> None:
        oldest = self._ring[self._oldest]
        _scatter(self._gather, oldest, self._all)
        oldest[:] = self._gather.source[self._gather.source_indices]
        self._oldest = (self._oldest + 1) % len(self._ring)
