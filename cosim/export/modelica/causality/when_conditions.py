"""When-conditions: the sampled clocks, the conditions that are watched for a rising edge, and initialization.

A `when` becomes an `if` on the flags due(k), "clock k ticks in this event", and risen(k), "condition k has become true".
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..model.flat_model import (
    Array,
    Binary,
    Body,
    Builtin,
    EdgeDetector,
    Expression,
    IfStatement,
    Literal,
    Model,
    SourceLocation,
    When,
    raise_model_error,
)
from ..model.traversal import PRE_OPERATORS, has_builtin


@dataclass(frozen=True, slots=True)
class Clock:
    """Ticks at start + k*period, k = 0, 1, ...; both are expressions of parameters, in seconds."""

    start: Expression
    period: Expression
    where: SourceLocation | None = field(default=None, compare=False)


def edge_flag(index: int) -> Builtin:
    return Builtin("risen", (Literal(index, "Integer"),))


def tick_flag(index: int) -> Builtin:
    return Builtin("due", (Literal(index, "Integer"),))


class WhenConditions:
    """Numbers the clocks and watched conditions of a model; equal ones share a number."""

    def __init__(self, model: Model):
        self._model = model
        self.clocks: list[Clock] = []
        self.edge_detectors: list[EdgeDetector] = []

    def at_event(self, when: When) -> Body:
        """The when-clause as seen in an event; branches that only initial() activates are left out."""
        flagged = [(self._flags(condition, when.where), body) for condition, body in when.branches]
        branches = tuple((_disjunction(flags), body) for flags, body in flagged if flags)
        return (IfStatement(branches, (), when.where),) if branches else ()

    def at_initialization(self, when: When) -> Body:
        """What of the when-clause is active in the initialization: the first branch with initial() in its condition."""
        return next((body for condition, body in when.branches if Builtin("initial", ()) in _alternatives(condition)), ())

    def _flags(self, condition: Expression, where: SourceLocation | None) -> list[Builtin]:
        alternatives = [c for c in _alternatives(condition) if c != Builtin("initial", ())]
        return [self._flag(alternative, where) for alternative in alternatives]

    def _flag(self, condition: Expression, where: SourceLocation | None) -> Builtin:
        if isinstance(condition, Builtin) and condition.name == "sample":
            return tick_flag(_index_of(self.clocks, self._clock(condition, where)))
        if has_builtin(condition, "sample", "initial"):
            raise_model_error("sample() must stand alone in a when-condition; put further conditions into an if inside", where)
        if has_builtin(condition, *PRE_OPERATORS):
            raise_model_error(
                "pre(), edge() and change() in a when-condition are not supported: a when-clause reacts to edges anyway", where
            )
        return edge_flag(_index_of(self.edge_detectors, EdgeDetector(len(self.edge_detectors), condition, where)))

    def _clock(self, sample: Builtin, where: SourceLocation | None) -> Clock:
        if len(sample.arguments) != 2:
            raise_model_error("sample() needs a start and a period", where)
        start, period = map(_to_real, sample.arguments)
        return Clock(start, period, where)


def _index_of(items: list, item: Clock | EdgeDetector) -> int:
    """The place of an item in the list, where it is put when it is new; a Watch is compared by its condition alone."""
    same = [
        k
        for k, other in enumerate(items)
        if other == item or (isinstance(item, EdgeDetector) and other.condition == item.condition)
    ]
    if not same:
        items.append(item)
    return same[0] if same else len(items) - 1


def _alternatives(condition: Expression) -> tuple[Expression, ...]:
    return condition.elements if isinstance(condition, Array) else (condition,)


def _disjunction(flags: list[Builtin]) -> Expression:
    result: Expression = flags[0]
    for flag in flags[1:]:
        result = Binary("or", result, flag)
    return result


def _to_real(expression: Expression) -> Expression:
    return Literal(float(expression.value), "Real") if isinstance(expression, Literal) else expression
