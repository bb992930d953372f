"""Splitting of array equations into scalar equations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import reduce
from itertools import product
from typing import Any

import numpy as np

from ..model.arithmetic import EvaluationError
from ..model.builtin_functions import BUILTIN_FUNCTIONS
from ..model.evaluate import Evaluator, convert_to_type
from ..model.flat_model import Equation, Model
from ..model.syntax_tree import (
    Array,
    Binary,
    Builtin,
    Call,
    Colon,
    Expression,
    If,
    Index,
    Literal,
    Name,
    Unary,
    raise_model_error,
)
from ..model.traversal import variable_names

Position = tuple[int, ...]


class _ShapeEvaluator(Evaluator):
    """Evaluator of expressions of which only the shape matters."""

    def _builtin(self, node: Builtin) -> Any:
        if node.name in ("due", "risen", "past"):
            return False
        return super()._builtin(node)


class EquationSplitter:
    """Splitting of the equations of one model.

    Shapes are those of the values that the default values give.
    """

    def __init__(self, model: Model):
        values: dict[str, Any] = {
            v.name: convert_to_type(1, v.type, v.shape)
            for v in model.variables.values()
            if v.type != "String"
        }
        # external functions leave their outputs zero: only the sizes matter
        self._evaluate = _ShapeEvaluator(
            {
                name: replace(f, external=replace(f.external, library=None)) if f.external else f
                for name, f in model.functions.items()
            },
            {**values, "time": 0.0},
        )

    def split(self, equation: Equation) -> Iterator[Equation]:
        """Yield one equation for each element.

        An equation between arrays without elements yields none.
        """
        shapes = [self.shape(side) for side in (equation.left, equation.right)]
        shape = max(shapes, key=len)
        if any(other and other != shape for other in shapes):
            raise_model_error(
                f"the sides of this equation have the sizes {list(shapes[0])} and "
                f"{list(shapes[1])}",
                equation.where,
            )
        for position in product(*map(range, shape)):
            left, right = (
                self.element(side, position if s else ())
                for side, s in zip((equation.left, equation.right), shapes, strict=True)
            )
            yield Equation(left, right, equation.where)

    def shape(self, node: Expression) -> tuple[int, ...]:
        """Return the shape of an expression."""
        try:
            with np.errstate(all="ignore"):
                return np.shape(self._evaluate(node))
        except KeyError:  # a built-in function without a value here, such as sample()
            return ()
        except (EvaluationError, ZeroDivisionError) as error:
            raise_model_error(
                f"the size of an expression is not known: {error}", getattr(node, "where", None)
            )

    def element(self, node: Expression, position: Position) -> Expression:
        """Return the expression of one element, counted from 0."""
        method: Callable[..., Expression | None] | None = getattr(
            self, f"_{type(node).__name__.lower()}", None
        )
        result = (
            method(node, position) if method and (position or not isinstance(node, Array)) else None
        )
        if result is not None:
            return result
        return Index(node, _literals(position)) if position else node

    def _array(self, node: Array, position: Position) -> Expression:
        return self.element(node.elements[position[0]], position[1:])

    def _unary(self, node: Unary, position: Position) -> Expression:
        return replace(node, operand=self.element(node.operand, position))

    def _if(self, node: If, position: Position) -> Expression:
        branches = tuple(
            (self.element(condition, ()), self.element(value, position))
            for condition, value in node.branches
        )
        return If(branches, self.element(node.otherwise, position))

    def _index(self, node: Index, position: Position) -> Expression | None:
        """Select from the subscripts of a variable, or of another array."""
        subscripts: list[Expression] = []
        rest = list(position)
        for subscript in (
            *node.subscripts,
            *[Colon()] * (len(self.shape(node.base)) - len(node.subscripts)),
        ):
            if isinstance(subscript, Colon):
                subscripts.append(Literal(rest.pop(0) + 1, "Integer"))
            elif variable_names(subscript) & set(self._evaluate.values):
                return None if position else node
            else:
                numbers = self._evaluate(subscript)
                subscripts.append(
                    Literal(int(numbers[rest.pop(0)] if np.ndim(numbers) else numbers), "Integer")
                )
        if isinstance(node.base, Name):
            return Index(node.base, tuple(subscripts), node.where)
        return self.element(
            node.base, tuple(int(s.number) - 1 for s in subscripts if isinstance(s, Literal))
        )

    def _binary(self, node: Binary, position: Position) -> Expression | None:
        left, right = self.shape(node.left), self.shape(node.right)
        if node.operator == "*" and left and right:
            return self._product(node, len(left), len(right), left[-1], position)
        a, b = (
            self.element(side, position if shape else ())
            for side, shape in ((node.left, left), (node.right, right))
        )
        return Binary(node.operator.removeprefix("."), a, b, node.where)

    def _product(
        self, node: Binary, left: int, right: int, inner: int, position: Position
    ) -> Expression:
        row, column = position[: left - 1], position[left - 1 :]
        assert len(column) == right - 1
        terms = [
            Binary(
                "*",
                self.element(node.left, (*row, k)),
                self.element(node.right, (k, *column)),
                node.where,
            )
            for k in range(inner)
        ]
        return _total(terms)

    def _builtin(self, node: Builtin, position: Position) -> Expression | None:
        arguments = node.arguments
        if node.name == "smooth":
            return replace(node, arguments=(arguments[0], self.element(arguments[1], position)))
        if node.name == "delay":
            return replace(node, arguments=(self.element(arguments[0], position), *arguments[1:]))
        if BUILTIN_FUNCTIONS[node.name].is_elementwise:
            return replace(
                node,
                arguments=tuple(
                    self.element(a, position if self.shape(a) else ()) for a in arguments
                ),
            )
        if node.name in ("zeros", "ones"):
            return Literal(float(node.name == "ones"), "Real")
        if node.name == "fill":
            return arguments[0]
        if node.name == "identity":
            return Literal(float(position[0] == position[1]), "Real")
        if node.name == "transpose":
            return self.element(arguments[0], position[::-1])
        if node.name in ("rows", "columns"):
            return self._joined(arguments, position, axis=("rows", "columns").index(node.name))
        if node.name == "sum" and not position:
            return _total(
                [
                    self.element(arguments[0], p)
                    for p in product(*map(range, self.shape(arguments[0])))
                ]
            )
        if (
            node.name in ("min", "max")
            and len(arguments) == 1
            and (size := self.shape(arguments[0]))
        ):
            elements = [self.element(arguments[0], p) for p in product(*map(range, size))]
            return (
                reduce(lambda a, b: Builtin(node.name, (a, b), node.where), elements)
                if elements
                else None
            )
        return None

    def _joined(self, parts: Sequence[Expression], position: Position, axis: int) -> Expression:
        """Select from `[a, b]` or `[a; b]`.

        A vector is a column, and a scalar a matrix with one element.
        """
        index = list(position)
        for part in parts:
            shape = self.shape(part)
            size = (*shape, 1, 1)[axis]
            if index[axis] < size:
                return self.element(part, tuple(index[: len(shape)]))
            index[axis] -= size
        raise AssertionError(position)

    def _call(self, node: Call, position: Position) -> Expression | None:
        return None if position else node


def _literals(position: Sequence[int]) -> tuple[Expression, ...]:
    return tuple(Literal(k + 1, "Integer") for k in position)


def _total(terms: Sequence[Expression]) -> Expression:
    if not terms:
        return Literal(0.0, "Real")
    result = terms[0]
    for term in terms[1:]:
        result = Binary("+", result, term)
    return result
