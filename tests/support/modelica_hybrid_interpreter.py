"""Interpreter of models with event iteration.

It performs the same operations as hybrid.h, past.h and the generated code.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

import numpy as np
from modelica_interpreter import TICK_TOLERANCE, Interpreter

from cosim.core.errors import ComponentError
from cosim.export.modelica.causality.analysed_model import AnalysedModel
from cosim.export.modelica.causality.hybrid import (
    MAX_EVENTS,
    MAX_PASSES,
    PAST_VALUES,
    SAME_TIME,
    chattering_reason,
    endless_reason,
    iterated_names,
)
from cosim.export.modelica.model.arithmetic import EvaluationError, divide
from cosim.export.modelica.model.flat_model import (
    Model,
    derivative_name,
    is_input,
    is_integrated,
    previous_name,
)

RELATIVE_TOLERANCE, ABSOLUTE_TOLERANCE = 1e-7, 1e-9

_COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
#: times of the stages, weights of the slopes of each stage, and those of the error, as fractions of
#: the step
NODES = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
WEIGHTS: Sequence[Sequence[float]] = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)


class PastValues:
    """Ring buffer of the values of the argument of a delay()."""

    def __init__(self) -> None:
        self._values: list[tuple[float, float]] = []

    def record(self, time: float, value: float, spacing: float) -> None:
        """Append a value; see `record_value` in past.h."""
        values = self._values
        if values and values[-1] == (time, value):
            return
        if (
            len(values) > 1
            and values[-1][0] < time
            and time - values[-2][0] < spacing
            and values[-2][0] < values[-1][0]
        ):
            values[-1] = (time, value)
            return
        values.append((time, value))
        del values[:-PAST_VALUES]

    def value(self, time: float) -> float:
        """Return the value at a time by linear interpolation; see `past_value` in past.h."""
        low, high, at = 0, len(self._values), time + 1e-12 * (1 + abs(time))
        while high - low > 1:
            middle = (low + high) // 2
            if self._values[middle][0] <= at:
                low = middle
            else:
                high = middle
        start, value = self._values[low]
        if low + 1 >= len(self._values) or time <= start:
            return value
        end, next_value = self._values[low + 1]
        return value + (next_value - value) * ((time - start) / (end - start))


class HybridInterpreter(Interpreter):
    """An instance of a model with event iteration."""

    def __init__(self, analysed: AnalysedModel):
        super().__init__(analysed)
        model = analysed.model
        assert model.hybrid
        self._hybrid = model.hybrid
        self._inputs = [name for name in self._hybrid.remembered if is_input(model.variables[name])]
        self._states = list(_elements(model, model.states))
        self._rates = list(_elements(model, [derivative_name(name) for name in model.states]))
        self._past = [PastValues() for _ in self._hybrid.delays]
        self.evaluate.past = lambda index, time: self._past[index].value(time)
        self._step = 0.0
        self._parameters_changed = False
        self._event_time = -math.inf

    def set(self, name: str, value: Any) -> None:
        """Set a parameter or an input.

        A parameter causes an event at the start of the next step.
        """
        super().set(name, value)
        self._parameters_changed |= self.model.variables[name].variability == "parameter"

    def initialize(self, time: float = 0.0) -> None:
        """Solve the initial equations, and evaluate the events at the start time (s).

        Raises:
            ComponentError: The model has failed.
        """
        self._step, self._event_time = 0.0, -math.inf
        self._past[:] = [PastValues() for _ in self._hybrid.delays]
        self.apply_start_values(inputs=False)
        self.evaluate.previous_conditions.clear()
        self._start_clocks(time)
        self.values["time"] = time
        with self._as_component_error("initialize", time), np.errstate(all="ignore"):
            for count in range(MAX_PASSES + 1):
                self.evaluate.execute(self.schedule.initialization)
                relations = [r.name for r in self._hybrid.relations]
                if not self._changed(relations):
                    break
                self._remember(relations)
                self._check_passes(count)
        self._remember(self._inputs)
        self._record(time)
        self._event("initialize", time, ())
        due, tick = self._next_ticks()
        if due and not self._inputs and tick <= time + TICK_TOLERANCE * self._shortest_period():
            self._event("initialize", time, due)
            self._count_ticks(due)

    def step(self, time: float, step_size: float) -> None:
        """Advance by a communication step.

        Args:
            time: The current time (s).
            step_size: The communication step size (s).

        Raises:
            ComponentError: The model has failed.
        """
        end, reached, count = time + step_size, time, 0
        while True:
            due, tick = self._next_ticks()
            slack = TICK_TOLERANCE * self._shortest_period() if due else 0.0
            is_tick = bool(due) and tick < end - slack
            at_start = is_tick and tick <= time + slack
            target = tick if is_tick else end
            inputs_first = not at_start or bool(self._hybrid.sampled)
            if (
                count == 0
                and inputs_first
                and (self._parameters_changed or self._changed(self._inputs))
            ):
                self._event("step", time, ())
                self._event_time = -math.inf
            crossing = False
            if is_integrated(self.model) and not at_start:
                with self._as_component_error("step", reached), np.errstate(all="ignore"):
                    reached, crossing = self._advance(reached, target)
            count += 1
            if crossing:
                if count > MAX_EVENTS:
                    self._raise_chattering(reached)
                self._event("step", reached, ())
                continue
            if not is_tick:
                break
            self._event("step", target, due)
            self._count_ticks(due)
        self._event("step", end, ())

    def _raise_chattering(self, time: float) -> NoReturn:
        self.values["time"] = time
        relations = [
            r
            for r in self._hybrid.relations
            if bool(self.evaluate(r.condition)) != self.values[r.name]
        ]
        raise ComponentError(self.model.name, "step", chattering_reason(relations[-1]), time)

    # events

    def _check_passes(self, count: int) -> None:
        if count == MAX_PASSES:
            name = next(name for name in iterated_names(self._hybrid) if self._changed([name]))
            raise EvaluationError(
                endless_reason(self._hybrid, name), self.model.variables[name].where
            )

    def _event(self, function: str, time: float, due: Sequence[int]) -> None:
        self.values["time"] = time
        with self._as_component_error(function, time), np.errstate(all="ignore"):
            self.evaluate.execute(self.schedule.between.limits)
            self._remember_sampled(time)
            self._remember([name for name in self._hybrid.remembered if name not in self._inputs])
            for count in range(MAX_PASSES + 1):
                self.evaluate.event_flags.update(
                    {("due", k): k in due for k in range(len(self.clocks))}
                )
                self.evaluate.execute(self.schedule.event)
                self._check_finite()
                if not (due or self._changed(self._hybrid.iterated)):
                    break
                self._check_passes(count)
                self._remember(self._hybrid.remembered)
                due = ()
        self._remember(self._inputs)
        self._parameters_changed = False
        self._record(time)

    def _remember_sampled(self, time: float) -> None:
        """Store the values of sampled variables, unless the previous event was at the same time."""
        if self._hybrid.sampled and time > self._event_time:
            for name in self._hybrid.sampled:
                self.values[previous_name(name)] = self.get(name)
        self._event_time = time + SAME_TIME

    def _remember(self, names: Sequence[str]) -> None:
        for name in names:
            if name not in self._hybrid.sampled:
                self.values[previous_name(name)] = self.get(name)

    def _changed(self, names: Sequence[str]) -> bool:
        return any(
            not np.array_equal(self.values[name], self.values[previous_name(name)])
            for name in names
        )

    def _record(self, time: float) -> None:
        for past, delay in zip(self._past, self._hybrid.delays, strict=True):
            past.record(
                time, self.values[delay.name], self.evaluate(delay.duration) / (PAST_VALUES // 2)
            )

    def _next_ticks(self) -> tuple[Sequence[int], float]:
        """Return the clocks that tick next, and the time of the tick."""
        ticks = [start + count * period for start, period, count in self.clocks]
        if not ticks:
            return (), math.inf
        tick = min(ticks)
        return [
            k for k, other in enumerate(ticks) if other <= tick + TICK_TOLERANCE * self.clocks[k][1]
        ], tick

    def _shortest_period(self) -> float:
        return min((period for _, period, _ in self.clocks), default=math.inf)

    def _count_ticks(self, due: Sequence[int]) -> None:
        for k in due:
            self.clocks[k][2] += 1

    # integration

    def _get_states(self) -> list[float]:
        return [_element(self.values, key) for key in self._states]

    def _set_states(self, values: Sequence[float]) -> None:
        for (name, index), value in zip(self._states, values, strict=True):
            if index is None:
                self.values[name] = value
            else:
                self.values[name].flat[index] = value

    def _slopes(self, time: float) -> list[float]:
        self.values["time"] = time
        self.evaluate.execute(self.schedule.between.derivatives)
        return [_element(self.values, key) for key in self._rates]

    def _crossed(self, time: float) -> tuple[bool, list[float]]:
        """Return whether a relation has changed, and the differences of the operands of all."""
        self.values["time"] = time
        self.evaluate.execute(self.schedule.between.indicators)
        changed, differences = False, []
        for relation in self._hybrid.relations:
            left, right = (
                float(self.evaluate(side))
                for side in (relation.condition.left, relation.condition.right)
            )
            differences.append(left - right)
            changed |= (
                _COMPARISONS[relation.condition.operator](left, right) != self.values[relation.name]
            )
        return changed, differences

    def _dormand_prince(
        self, time: float, h: float, start: Sequence[float], slopes: list[list[float]]
    ) -> float:
        """Advance the states from `start` with the slopes in the first row.

        Return the error as a multiple of the tolerance.
        """
        del slopes[1:]
        for node, weights in zip(NODES[1:], WEIGHTS[1:], strict=True):
            self._set_states(
                [x + h * weighted_sum(weights, slopes, i) for i, x in enumerate(start)]
            )
            slopes.append(self._slopes(time + node * h))
        largest = 0.0
        for i, (x, y) in enumerate(zip(start, self._get_states(), strict=True)):
            a, b = abs(x), abs(y)
            scale = ABSOLUTE_TOLERANCE + RELATIVE_TOLERANCE * (a if a > b else b)
            ratio = abs(h * weighted_sum(ERROR, slopes, i)) / scale
            if not ratio <= largest:
                largest = ratio
        return largest

    def _advance(self, start_time: float, end: float) -> tuple[float, bool]:
        """Integrate to `end` or to the first event.

        Return the time reached, and whether there is an event.

        The event before has computed the derivatives.
        """
        time, slopes = start_time, [[_element(self.values, key) for key in self._rates]]
        if not self._step > 0:
            self._step = end - start_time
        while time < end:
            last = not self._step < end - time
            h = end - time if last else self._step
            start = self._get_states()
            error = self._dormand_prince(time, h, start, slopes)
            if not error <= 1:
                factor = 0.9 * math.pow(error, -0.2)
                self._set_states(start)
                self._step = h * (factor if factor > 0.2 else 0.2)
                if not time + self._step > time:
                    raise EvaluationError("the integration step has become too small")
                continue
            if self._crossed(time + h)[0]:
                time = self._locate(time, h, start, slopes)
                self._record(time)
                return time, True
            following = h * (min(0.9 * math.pow(error, -0.2), 5.0) if error > 0 else 5.0)
            self._step = max(self._step, following) if last else following
            time = end if last else time + h
            self._record(time)
            slopes = [slopes[-1]]
        return time, False

    def _locate(
        self, time: float, h: float, start: Sequence[float], slopes: list[list[float]]
    ) -> float:
        """Return the first time in (time, time + h] after which a relation has changed.

        The states are those of this time.
        """
        width = max(1e-10, 8 * 2.0**-52 * abs(time + h))
        left, right, after = 0.0, h, self._crossed(time + h)[1]
        self._set_states(start)
        self._slopes(time)
        before, side, count = self._crossed(time)[1], True, 0
        while right - left > width and count < 100:
            at = right
            for a, b in zip(before, after, strict=True):
                root = left + (right - left) * divide(a, a - b)
                if left < root < at:
                    at = root
            at = (
                left + (right - left) / 2
                if count % 3 == 2
                else at + (-width if side else width) / 2
            )
            at = min(max(at, left + width / 4), right - width / 4)
            self._dormand_prince(time, at, start, slopes)
            side, differences = self._crossed(time + at)
            if side:
                right, after = at, differences
            else:
                left, before = at, differences
            count += 1
        self._dormand_prince(time, right, start, slopes)
        return time + right


def _elements(model: Model, names: Sequence[str]) -> Iterator[tuple[str, int | None]]:
    """Yield the elements of variables: the name and the row-major index, or None for a scalar."""
    for name in names:
        shape = model.variables[name].shape
        yield from ((name, k) for k in range(math.prod(shape))) if shape else ((name, None),)


def _element(values: Any, key: tuple[str, int | None]) -> float:
    name, index = key
    return float(values[name] if index is None else values[name].flat[index])


def weighted_sum(weights: Sequence[float], slopes: Sequence[Sequence[float]], index: int) -> float:
    """Return the sum of the slopes of a state, each with its weight."""
    total = 0.0
    for weight, row in zip(weights, slopes, strict=True):
        if weight:
            total += weight * row[index]
    return total
