"""Conditions on recorded signals that end a simulation.

The Python executor evaluates them as Python expressions. For the native executor they are compiled
to instructions of a stack machine in `_native.c`.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..core.expressions import Reader, spelt_name
from .layout import ArrayPosition
from .plan import Plan
from .settings import StopCondition, StopOutcome

#: communication point that is never reached
NEVER = (1 << 63) - 1


class MetCondition(NamedTuple):
    """Condition that ended the simulation.

    Attributes:
        condition: its name.
        outcome: "crash" or "decided".
        cause: the condition, or those operands of its outermost `or` that were met.
        since: time of the first of the uninterrupted points at which the condition was met (s).
        time: end of the simulation (s).
    """

    condition: str
    outcome: StopOutcome
    cause: str
    since: float
    time: float


class StopConditions:
    """Evaluation of the stop conditions of a plan at recorded communication points.

    A condition ends the simulation at the first recorded point at which it has been met for its
    hold time: at this point, at an earlier recorded point that lies at least the hold time back,
    and at all recorded points between them. Of several conditions that end at the same point the
    first one counts. A condition without a value is not met.

    Attributes:
        begins: for each condition the first of the uninterrupted points at which it was met; None:
            it is not met now. These are its state.
        wake_point: communication point from which on a condition may have been met for its hold
            time.
    """

    def __init__(self, plan: Plan):
        self._plan, self._conditions = plan, plan.settings.stop_conditions
        self._evaluators = [
            condition.expression.bind(self._reader) for condition in self._conditions
        ]
        self._holds = [math.ceil(condition.hold / plan.grid.step) for condition in self._conditions]
        self.begins: list[int | None] = [None] * len(self._conditions)
        self.wake_point = NEVER

    def __bool__(self) -> bool:
        return bool(self._conditions)

    def _position(self, name: str) -> ArrayPosition:
        return self._plan.outputs.positions[self._plan.settings.columns[name]]

    def _reader(self, name: str) -> Reader:
        position = self._position(name)
        values: Any = self._plan.outputs.arrays[position.dtype].data
        index = position.offset
        return lambda: float(values[index])

    def instructions(self) -> Iterator[list[tuple[Instruction, np.ndarray]]]:
        """Yield each condition's instructions in C, with arrays that begin with their values."""
        for condition in self._conditions:
            yield [
                (each, self._values_from(each.name))
                for each in compile_condition(condition.expression.tree)
            ]

    def _values_from(self, name: str) -> np.ndarray:
        """Return the values from that of a signal on; an empty array without a name."""
        if not name:
            return np.zeros(0)
        position = self._position(name)
        return self._plan.outputs.arrays[position.dtype][position.offset :]

    def check(self, n: int) -> MetCondition | None:
        """Evaluate all conditions at communication point `n`; return the one that ends the run."""
        met = None
        for k, evaluate in enumerate(self._evaluators):
            value = evaluate()
            if not value or math.isnan(value):
                self.begins[k] = None
                continue
            begin = self.begins[k]
            begin = self.begins[k] = n if begin is None else begin
            if n - begin >= self._holds[k] and met is None:
                met = self._describe(self._conditions[k], begin, n)
        self._set_wake_point()
        return met

    def restore(self, begins: Sequence[int | None]) -> None:
        """Restore a state."""
        self.begins = list(begins)
        self._set_wake_point()

    def _set_wake_point(self) -> None:
        pending = (
            begin + hold
            for begin, hold in zip(self.begins, self._holds, strict=True)
            if begin is not None
        )
        self.wake_point = min(pending, default=NEVER)

    def _describe(self, condition: StopCondition, begin: int, end: int) -> MetCondition:
        parts = condition.expression.alternatives
        causes = []
        for part in parts:
            value = part.bind(self._reader)()
            if value and not math.isnan(value):
                causes.append(part.text)
        cause = " or ".join(causes) or condition.expression.text
        time_at = self._plan.grid.time_at
        return MetCondition(condition.name, condition.outcome, cause, time_at(begin), time_at(end))


_BINARY = {
    ast.Add: "ADD",
    ast.Sub: "SUBTRACT",
    ast.Mult: "MULTIPLY",
    ast.Div: "DIVIDE",
    ast.Pow: "POWER",
}
_UNARY = {ast.USub: "NEGATE", ast.Not: "NOT"}
_COMPARISONS = {
    ast.Lt: "LT",
    ast.LtE: "LE",
    ast.Gt: "GT",
    ast.GtE: "GE",
    ast.Eq: "EQ",
    ast.NotEq: "NE",
}


class Instruction(NamedTuple):
    """One instruction.

    PUSH puts `value` on the stack, LOAD the value of the signal `name`. AND and OR remove the
    topmost value if the further operands matter; otherwise they replace it by the result and skip
    the next `skip` instructions. The other operations replace the topmost one or two values by
    their result.
    """

    operation: str
    value: float = 0.0
    name: str = ""
    skip: int = 0


def compile_condition(node: ast.expr) -> list[Instruction]:
    """Return the instructions that leave the value of a valid expression on the stack."""
    match node:
        case ast.Constant(value=int() | float() as value):
            return [Instruction("PUSH", _as_float(value))]
        case ast.BinOp(left=left, op=op, right=right):
            return [
                *compile_condition(left),
                *compile_condition(right),
                Instruction(_BINARY[type(op)]),
            ]
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return compile_condition(operand)
        case ast.UnaryOp(op=op, operand=operand):
            return [*compile_condition(operand), Instruction(_UNARY[type(op)])]
        case ast.BoolOp(op=op, values=values):
            return _combine(
                "OR" if isinstance(op, ast.Or) else "AND",
                [compile_condition(value) for value in values],
            )
        case ast.Compare(left=left, ops=ops, comparators=right_sides):
            sides = [compile_condition(side) for side in (left, *right_sides)]
            pairs = zip(ops, sides, sides[1:], strict=False)
            return _combine(
                "AND", [[*a, *b, Instruction(_COMPARISONS[type(op)])] for op, a, b in pairs]
            )
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _compile_call(name, [compile_condition(argument) for argument in arguments])
    return [Instruction("LOAD", name=spelt_name(node))]


def _as_float(value: float) -> float:
    """Return a constant; NaN, which is no value, for an integer that is too large."""
    try:
        return float(value)
    except OverflowError:
        return math.nan


def _combine(operation: str, parts: Sequence[Sequence[Instruction]]) -> list[Instruction]:
    """Return the instructions of `and` or `or`, which evaluate an operand only if it matters."""
    code = [*parts[-1], Instruction("TRUTH")]
    for part in reversed(parts[:-1]):
        code = [*part, Instruction(operation, skip=len(code)), *code]
    return code


def _compile_call(name: str, arguments: Sequence[Sequence[Instruction]]) -> list[Instruction]:
    first, *others = arguments
    code = [*first]
    if name == "log":  # to a base: the quotient of two logarithms
        code.append(Instruction("LOG"))
        for each in others:
            code += [*each, Instruction("LOG"), Instruction("DIVIDE")]
        return code
    operation = Instruction(name.upper())
    if not others:
        return [*first, operation]
    for each in others:
        code += [*each, operation]
    return code
