"""Inference of the clocks of clocked equations (`Clock`, `sample(u, c)`, `hold()`, `previous()`).

Variables of one equation have the same clock, unless an operator separates them: the argument of
`hold()` or `sample()` belongs to another partition, and the argument of `subSample()`,
`superSample()`, `shiftSample()` or `backSample()` has a clock in a known ratio to that of the
equation (Modelica Language Specification 3.6, section 16.7). Equal clocks are merged with a
union-find structure (Tarjan 1975). Constructors `Clock(...)` give the clock of some partitions; the
ratios, exact fractions, carry it to all others until nothing changes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from fractions import Fraction
from typing import Any

from ..model.builtin_functions import CLOCKED_OPERATORS, CONVERSIONS
from ..model.evaluate import Evaluator
from ..model.flat_model import EVENT_SECTIONS, Model
from ..model.syntax_tree import (
    Builtin,
    Expression,
    If,
    Index,
    Name,
    SourceLocation,
    When,
    raise_model_error,
)
from ..model.traversal import is_call, variable_names, walk


@dataclass(frozen=True, slots=True)
class Rate:
    """Ticks of a clock: at `offset` + k `period` (s), or when `condition` becomes true."""

    period: Fraction = Fraction(0)
    offset: Fraction = Fraction(0)
    condition: Expression | None = None

    def __str__(self) -> str:
        return "a condition" if self.condition else f"{self.period} s from {self.offset} s"


@dataclass(frozen=True, slots=True)
class _Relation:
    """The period of the second node is `scale` times that of the first.

    The shift is a part of the first period.
    """

    first: str
    second: str
    scale: Fraction
    shift: Fraction


def is_clock(expression: Any, model: Model) -> bool:
    """Return whether an expression has the type Clock."""
    if isinstance(expression, If):
        return is_clock(expression.otherwise, model)
    if isinstance(expression, Builtin):
        return expression.name == "Clock" or (
            expression.name in CONVERSIONS and is_clock(expression.arguments[0], model)
        )
    base = expression.base if isinstance(expression, Index) else expression
    return (
        isinstance(base, Name)
        and base.name in model.variables
        and model.variables[base.name].type == "Clock"
    )


def is_sampler(call: Builtin, model: Model) -> bool:
    """Return whether a call is `sample(u)` or `sample(u, clock)`.

    `sample(start, period)` is an event.
    """
    return call.name == "sample" and (
        len(call.arguments) == 1 or is_clock(call.arguments[1], model)
    )


def samplers(trees: Any, model: Model) -> Iterator[Builtin]:
    """Yield the calls of `sample(u)` and `sample(u, clock)`."""
    return (item for item in walk(trees) if isinstance(item, Builtin) and is_sampler(item, model))


def is_clocked_when(when: Any, model: Model) -> bool:
    """Return whether the condition of a when-clause is a clock."""
    return isinstance(when, When) and is_clock(when.branches[0][0], model)


def clock_parameters(model: Model) -> set[str]:
    """Return the parameters that determine clocks; they are constants of the FMU."""
    calls = [item for item in walk(event_sections(model)) if is_call(item, *CONVERSIONS, "Clock")]
    return {
        name
        for name in variable_names(tuple(calls))
        if name in model.variables and model.variables[name].variability == "parameter"
    }


def event_sections(model: Model) -> tuple[Any, ...]:
    """Return all equations and statements that are evaluated at events."""
    return tuple(getattr(model, section) for section in EVENT_SECTIONS)


class ClockInference:
    """Clocks of all equations and variables of a model.

    A node is a variable, an equation or the argument of an operator.

    Args:
        model: The flat model with its structural parameters as literals.

    Raises:
        InputError: A clock is contradictory, or not determined.
    """

    def __init__(self, model: Model):
        self._model = model
        self._parents: dict[str, str] = {}
        self._relations: list[_Relation] = []
        self._constructors: list[tuple[str, Rate, SourceLocation | None]] = []
        self._clocked: dict[str, SourceLocation | None] = {}
        self._arguments: dict[int, str] = {}
        self._continuous: list[tuple[str, str, SourceLocation | None]] = []
        for node, item in self.items():
            self._collect(node, item, getattr(item, "where", None))
        self._rates = self._solve()
        for node, name, where in self._continuous:
            if self.rate(node):
                raise_model_error(f"{name} belongs to no clock; write sample() of it", where)

    def items(self) -> Iterator[tuple[str, Any]]:
        """Yield the names of the nodes and the items of all sections."""
        for section in EVENT_SECTIONS:
            for number, item in enumerate(getattr(self._model, section)):
                yield f"{section} {number}", item

    def rate(self, node: str) -> Rate | None:
        """Return the clock of a node, or None if it is continuous."""
        return self._rates.get(self._find(node))

    def argument(self, call: Builtin) -> str:
        """Return the node of the argument of an operator."""
        return self._arguments[id(call)]

    def evaluate(self, expression: Expression) -> Any:
        """Return the value of an expression of parameters with their default values."""
        values = {
            name: self.evaluate(self._value(name, expression))
            for name in variable_names(expression)
        }
        return Evaluator(self._model.functions, values)(expression)

    def _value(self, name: str, expression: Expression) -> Expression:
        variable = self._model.variables.get(name)
        value = (
            variable
            and variable.variability in ("parameter", "constant")
            and (variable.binding or variable.start)
        )
        where = getattr(expression, "where", None)
        return value or raise_model_error(
            f"a clock needs values that are known when the FMU is built; {name} is not", where
        )

    # collection

    def _collect(self, node: str, tree: Any, where: SourceLocation | None) -> None:
        if isinstance(tree, tuple) and not isinstance(tree, SourceLocation):
            for item in tree:
                self._collect(node, item, where)
        elif isinstance(tree, Builtin) and (
            tree.name in CLOCKED_OPERATORS or is_sampler(tree, self._model)
        ):
            self._operator(node, tree, where)
        elif isinstance(tree, Index) and is_clock(tree, self._model):
            self._parents[self._find(node)] = self._find(str(replace(tree, where=None)))
        elif isinstance(tree, Name):
            self._reference(node, tree.name, where)
        elif isinstance(tree, If) and is_clock(tree, self._model):
            self._collect(node, self.selected(tree), where)
        elif is_dataclass(tree):
            if is_call(tree, "der"):
                self._continuous.append((node, "der()", where))
            for field in fields(tree):
                self._collect(node, getattr(tree, field.name), where)

    def selected(self, choice: If) -> Expression:
        """Return the branch of an if-expression between clocks."""
        return next(
            (value for condition, value in choice.branches if self.evaluate(condition)),
            choice.otherwise,
        )

    def _reference(self, node: str, name: str, where: SourceLocation | None) -> None:
        variable = self._model.variables.get(name)
        if name == "time" or (variable and variable.top_level and variable.causality == "input"):
            self._continuous.append((node, name, where))
        elif variable and variable.variability not in ("parameter", "constant"):
            self._parents[self._find(node)] = self._find(name)

    def _operator(self, node: str, call: Builtin, where: SourceLocation | None) -> None:
        if call.name in ("previous", "firstTick", "interval", "Clock"):
            self._clocked[node] = where
            if call.name == "Clock" and call.arguments:
                self._constructors.append((node, self._constructed(call), where))
            elif call.name != "Clock":
                self._collect(node, call.arguments, where)
            return
        inner = self._arguments[id(call)] = f"argument {len(self._arguments)}"
        if call.name not in ("hold", "noClock"):
            self._clocked[node] = where
        if call.name != "sample":
            self._clocked[inner] = where
        if call.name in CONVERSIONS and (relation := self._relation(inner, node, call)):
            self._relations.append(relation)
        self._collect(inner, call.arguments[0], where)
        if call.name == "sample":
            self._collect(node, call.arguments[1:], where)

    def _constructed(self, call: Builtin) -> Rate:
        first, *others = call.arguments
        if isinstance(first, Name) and self._model.variables[first.name].type == "Boolean":
            return Rate(condition=first)
        if is_clock(first, self._model):
            raise_model_error(
                "a clock with a solver method is not supported; write difference equations",
                call.where,
            )
        counter = self.evaluate(first)
        period = Fraction(repr(counter)) / (int(self.evaluate(others[0])) if others else 1)
        return (
            Rate(period)
            if period > 0
            else raise_model_error(f"found the period {period} s, expected > 0", call.where)
        )

    def _relation(self, inner: str, node: str, call: Builtin) -> _Relation | None:
        values = [int(self.evaluate(argument)) for argument in call.arguments[1:]]
        if call.name in ("subSample", "superSample"):
            factor = Fraction(values[0] if values else 0)
            if factor == 0:
                return None
            return _Relation(
                inner, node, factor if call.name == "subSample" else 1 / factor, Fraction(0)
            )
        shift = Fraction(values[0], values[1] if len(values) > 1 else 1)
        return _Relation(inner, node, Fraction(1), shift if call.name == "shiftSample" else -shift)

    def _find(self, node: str) -> str:
        while (parent := self._parents.setdefault(node, node)) != node:
            self._parents[node] = node = self._parents[parent]
        return node

    # solution

    def _solve(self) -> dict[str, Rate]:
        rates: dict[str, Rate] = {}
        for node, rate, where in self._constructors:
            self._set(rates, node, rate, where)
        count = -1
        while count != len(rates):
            count = len(rates)
            for relation in self._relations:
                self._propagate(rates, relation)
        for node, where in self._clocked.items():
            if self._find(node) not in rates:
                raise_model_error(
                    "the clock of this equation is not determined; write sample(u, Clock(0.1))",
                    where,
                )
        return rates

    def _set(
        self, rates: dict[str, Rate], node: str, rate: Rate, where: SourceLocation | None
    ) -> None:
        if rate.offset < 0:
            raise_model_error("backSample() begins before the clock of its argument", where)
        if (known := rates.setdefault(self._find(node), rate)) != rate:
            raise_model_error(
                f"this equation has two clocks: {known} and {rate}; convert one with subSample()",
                where,
            )

    def _propagate(self, rates: dict[str, Rate], relation: _Relation) -> None:
        first, second = (rates.get(self._find(node)) for node in (relation.first, relation.second))
        known = first or second
        where = self._clocked[relation.first]
        if known and known.condition:
            raise_model_error("the clock of a condition cannot be converted to another rate", where)
        if first:
            shifted = first.offset + relation.shift * first.period
            self._set(rates, relation.second, Rate(first.period * relation.scale, shifted), where)
        elif second:
            period = second.period / relation.scale
            self._set(
                rates, relation.first, Rate(period, second.offset - relation.shift * period), where
            )
