"""Conditions of when-clauses: clocks, edge detectors and initialization.

A when-clause becomes an if-statement on the event flags due(k), "clock k ticks in this event", and
risen(k), "the condition of edge detector k has become true in this event".
"""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

from ..model.flat_model import Model
from ..model.syntax_tree import (
    Array,
    Binary,
    Body,
    Builtin,
    EdgeDetector,
    Expression,
    IfStatement,
    Index,
    Literal,
    Name,
    SourceLocation,
    When,
    raise_model_error,
)
from ..model.traversal import is_call, rewrite_outermost, variable_names, walk


@dataclass(frozen=True, slots=True)
class Clock:
    """Clock of a sample(start, period), with ticks at start + k*period for k = 0, 1, ..."""

    #: time of the first tick (s), an expression of parameters
    start: Expression
    #: period (s), an expression of parameters
    period: Expression
    where: SourceLocation | None = field(default=None, compare=False)


def edge_flag(index: int) -> Builtin:
    """Return the event flag of an edge detector."""
    return Builtin("risen", (Literal(index, "Integer"),))


def tick_flag(index: int) -> Builtin:
    """Return the event flag of a clock."""
    return Builtin("due", (Literal(index, "Integer"),))


class WhenConditions:
    """Translation of when-clauses.

    Assigns one number to each distinct clock and edge detector of a model.
    """

    def __init__(self, model: Model):
        self._model = model
        self.clocks: list[Clock] = []
        self.edge_detectors: list[EdgeDetector] = []
        #: edge detectors that are part of an algorithm
        self.in_place: set[int] = set()

    def at_event(self, when: When) -> Body:
        """Translate a when-clause for an event.

        Branches that only initial() activates are omitted.
        """
        flagged = [(self._flags(condition, when.where), body) for condition, body in when.branches]
        branches = tuple((_disjunction(flags), body) for flags, body in flagged if flags)
        return (IfStatement(branches, (), when.where),) if branches else ()

    def at_initialization(self, when: When) -> Body:
        """Return the statements of a when-clause for the initialization.

        The first branch with initial() in its condition.
        """
        return next(
            (
                body
                for condition, body in when.branches
                if Builtin("initial", ()) in self._alternatives(condition)
            ),
            (),
        )

    def _flags(self, condition: Expression, where: SourceLocation | None) -> list[Builtin]:
        alternatives = [c for c in self._alternatives(condition) if c != Builtin("initial", ())]
        return [self._flag(alternative, where) for alternative in alternatives]

    def _alternatives(self, condition: Expression) -> tuple[Expression, ...]:
        """Return the conditions of a vector of conditions."""
        variable = (
            self._model.variables.get(condition.name) if isinstance(condition, Name) else None
        )
        if variable is not None and variable.shape:
            return tuple(
                Index(condition, (Literal(k + 1, "Integer"),)) for k in range(variable.shape[0])
            )
        return condition.elements if isinstance(condition, Array) else (condition,)

    def detectors_in(self, body: Body, assigned: Collection[str]) -> list[EdgeDetector]:
        """Return the edge detectors that read variables which the same algorithm assigns.

        They are evaluated in place, in the order of the algorithm.
        """
        used = {
            int(item.arguments[0].number)
            for item in walk(body)
            if is_call(item, "risen") and isinstance(item.arguments[0], Literal)
        }
        found = [detector for detector in self.edge_detectors if detector.index in used]
        found = [
            detector for detector in found if variable_names(detector.condition) & set(assigned)
        ]
        self.in_place |= {detector.index for detector in found}
        return found

    def _flag(self, condition: Expression, where: SourceLocation | None) -> Builtin:
        if is_call(condition, "sample"):
            return tick_flag(self._clock_index(condition, where))
        condition = rewrite_outermost(condition, self.as_tick_flag)
        conditions = [detector.condition for detector in self.edge_detectors]
        if condition not in conditions:
            conditions.append(condition)
            self.edge_detectors.append(EdgeDetector(len(self.edge_detectors), condition, where))
        return edge_flag(conditions.index(condition))

    def as_tick_flag(self, node: Any) -> Builtin | None:
        """Return the event flag of a sample(), or None for all other nodes."""
        if not (is_call(node, "sample")):
            return None
        return tick_flag(self._clock_index(node, node.where))

    def _clock_index(self, sample: Builtin, where: SourceLocation | None) -> int:
        if len(sample.arguments) != 2:
            raise_model_error("sample() must have a start and a period", where)
        start, period = map(_to_real, sample.arguments)
        clock = Clock(start, period, where)
        if clock not in self.clocks:
            self.clocks.append(clock)
        return self.clocks.index(clock)


def _disjunction(flags: list[Builtin]) -> Expression:
    result: Expression = flags[0]
    for flag in flags[1:]:
        result = Binary("or", result, flag)
    return result


def _to_real(expression: Expression) -> Expression:
    return (
        Literal(float(expression.number), "Real") if isinstance(expression, Literal) else expression
    )
