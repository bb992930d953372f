"""Base of the lowering to C: scope, temporary variables, static evaluation, subscripts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import product
from math import prod
from typing import Any, Protocol

from ....core.text import count_noun
from ..model.arithmetic import EvaluationError
from ..model.evaluate import Evaluator
from ..model.flat_model import Function
from ..model.syntax_tree import (
    Assert,
    Binary,
    Builtin,
    Call,
    Colon,
    Expression,
    Index,
    Literal,
    Name,
    Range,
    SourceLocation,
    Unary,
    raise_model_error,
)
from ..model.traversal import is_call, walk
from .c_values import (
    C_TYPES,
    CExpression,
    CValue,
    c_call,
    linear_index,
    scalar_value,
    variable_value,
)


@dataclass(frozen=True, slots=True)
class FunctionInstance:
    """A C function: a function of the model, translated for arguments of given shapes."""

    name: str
    inputs: tuple[CValue, ...]
    outputs: tuple[CValue, ...]
    #: true if the first parameter is the model, which is needed to report failures
    takes_model: bool

    @property
    def returns_scalar(self) -> bool:
        """True if the C function returns its result: there is only one, and it is a scalar."""
        return len(self.outputs) == 1 and not self.outputs[0].shape


class TranslationUnit(Protocol):
    """The C file that contains the lowered code: its failure reasons and functions."""

    functions: dict[str, Function]

    def failure_code(self, reason: str, where: SourceLocation | None) -> str:
        """Return the number of a failure reason."""

    def warning_number(self, node: Assert) -> int:
        """Return the number of an assertion with the level warning."""

    def function_instance(
        self,
        call: Call,
        shapes: tuple[tuple[int, ...], ...],
        numbers: tuple[int | None, ...],
    ) -> FunctionInstance:
        """Return the C function for a call with arguments of these shapes."""


@dataclass
class Lowering:
    """Lowering in one scope: the model, or the body of a function.

    The methods of the subclasses for the kinds of nodes are named after the classes of
    `syntax_tree`.
    """

    translation_unit: TranslationUnit
    #: Modelica name -> current value
    scope: dict[str, CValue]
    #: Modelica name -> value before the event, for pre()
    pre_scope: dict[str, CValue] = field(default_factory=dict)
    #: generated C statements
    lines: list[str] = field(default_factory=list)
    #: number of temporary variables
    temporaries: int = 0

    def lower(self, node: Expression) -> CValue:
        """Lower an expression.

        Raises:
            InputError: The expression is not supported.
        """
        method: Callable[[Expression], CValue] | None = getattr(
            self, f"_{type(node).__name__.lower()}", None
        )
        if method is None:
            raise_model_error(
                f"{type(node).__name__} is not supported here", getattr(node, "where", None)
            )
        return method(node)

    def scalar_of(self, node: Expression) -> CExpression:
        """Lower a scalar expression.

        Raises:
            InputError: The expression is an array or is not supported.
        """
        value = self.lower(node)
        if value.shape:
            raise_model_error("found an array, expected a scalar", getattr(node, "where", None))
        return value.text

    @contextmanager
    def collect_lines(self) -> Iterator[list[str]]:
        """Collect the statements of this block in a separate list, indented by one level."""
        outer, self.lines = self.lines, []
        yield self.lines
        inner, self.lines = self.lines, outer
        inner[:] = ["    " + line for line in inner]

    def new_temporary(self, type_name: str, shape: tuple[int, ...]) -> CValue:
        """Declare a temporary C variable or array without initialization."""
        self.temporaries += 1
        name = f"tmp_{self.temporaries}"
        self.lines.append(
            f"{C_TYPES[type_name]} {name}{f'[{max(prod(shape), 1)}]' if shape else ''};"
        )
        return variable_value(type_name, shape, name)

    def evaluated_once(self, value: CValue) -> CValue:
        """Return a reusable value.

        The value is stored in a temporary variable if it is not reusable yet.
        """
        if value.reusable:
            return value
        if value.shape:
            target = self.new_temporary(value.type, value.shape)
            self.copy_elements(target, value)
            return target
        self.temporaries += 1
        name = f"tmp_{self.temporaries}"
        self.lines.append(f"const {C_TYPES[value.type]} {name} = {value.text.code};")
        return scalar_value(value.type, CExpression(name), reusable=True)

    def as_c_array(self, value: CValue, type_name: str) -> str:
        """Return the name of a C array with the elements of a value.

        They are copied unless such an array exists.
        """
        if value.pointer is not None and C_TYPES[value.type] == C_TYPES[type_name]:
            return value.pointer
        target = self.new_temporary(type_name, value.shape)
        self.copy_elements(target, value)
        return str(target.pointer)

    def copy_elements(self, target: CValue, value: CValue) -> None:
        """Generate the assignment of all elements; the value must not depend on the target."""
        if value.indexable_in_loop and target.indexable_in_loop and value.size > 4:
            self.lines.append(f"for (int each = 0; each < {value.size}; each++)")
            self.lines.append(f"    {target.element('each').code} = {value.element('each').code};")
        else:
            self.lines += [
                f"{target.element(k).code} = {value.element(k).code};" for k in range(value.size)
            ]

    def shape_of(self, node: Expression) -> tuple[int, ...]:
        """Return the shape of an expression; no code is generated."""
        with self.collect_lines():
            return self.lower(node).shape

    # static evaluation

    def static_integer(self, node: Expression) -> int | None:
        """Evaluate an Integer expression of literals, size(), `+`, `-` and `*`.

        It may contain built-in functions of constants. Return None for all other expressions.
        """
        if isinstance(node, Literal) and node.type in ("Integer", "Enumeration"):
            return int(node.number)
        if isinstance(node, Unary) and node.operator == "-":
            operand = self.static_integer(node.operand)
            return None if operand is None else -operand
        if isinstance(node, Binary) and node.operator in ("+", "-", "*"):
            left, right = self.static_integer(node.left), self.static_integer(node.right)
            if left is None or right is None:
                return None
            return {"+": left + right, "-": left - right, "*": left * right}[node.operator]
        if is_call(node, "size") and len(node.arguments) == 2:
            dimension = self.static_integer(node.arguments[1])
            return None if dimension is None else self.shape_of(node.arguments[0])[dimension - 1]
        value = self.static_value(node) if isinstance(node, Builtin) else None
        return value if isinstance(value, int) else None

    def static_value(self, node: Expression) -> Any:
        """Return the value of an expression without variables; None for all other expressions."""
        if any(isinstance(n, Name | Call) for n in walk(node)):
            return None
        try:
            return Evaluator({}, {})(node)
        except (EvaluationError, KeyError):
            return None

    def static_range(self, node: Range) -> list[int]:
        """Return the values of a range.

        Raises:
            InputError: The bounds or the step are not constant.
        """
        start, step, stop = (
            self.static_integer(e)
            for e in (node.start, node.step or Literal(1, "Integer"), node.stop)
        )
        if start is None or step is None or stop is None:
            raise_model_error(
                "the bounds of a range must be constant here", getattr(node.stop, "where", None)
            )
        return list(range(start, stop + (1 if step > 0 else -1), step))

    # subscripts

    def _index(self, node: Index) -> CValue:
        base = self.lower(node.base)
        return self.select_elements(base, node)

    def select_elements(self, base: CValue, node: Index) -> CValue:
        """Return the element or slice of an array; it can be the target of an assignment.

        Args:
            base: The array.
            node: The expression with the subscripts.

        Raises:
            InputError: A subscript is not supported, or a constant subscript is out of range.
        """
        if len(node.subscripts) > len(base.shape):
            found = f"found {count_noun(len(node.subscripts), 'subscript')}"
            raise_model_error(f"{found}, expected at most {len(base.shape)}", node.where)
        label = node.base.name if isinstance(node.base, Name) else "array"
        subscripts = [
            *node.subscripts,
            *[Colon()] * (len(base.shape) - len(node.subscripts)),
        ]
        offsets = [
            self._element_offsets(s, n, label, node.where)
            for s, n in zip(subscripts, base.shape, strict=True)
        ]
        if any(isinstance(offset, str) for offset in offsets) and base.pointer is None:
            base = variable_value(base.type, base.shape, self.as_c_array(base, base.type))
        offset_lists = [offset if isinstance(offset, list) else [offset] for offset in offsets]
        shape = tuple(len(offset) for offset in offsets if isinstance(offset, list))
        factors = [prod(base.shape[d + 1 :]) for d in range(len(base.shape))]
        selected = [
            linear_index(list(zip(factors, index, strict=True))) for index in product(*offset_lists)
        ]
        if shape == base.shape and selected == list(range(base.size)):
            return base
        if not shape:
            return scalar_value(base.type, base.element(selected[0]), reusable=base.reusable)
        return CValue(
            base.type,
            shape,
            lambda k: base.element(selected[int(k)]),
            indexable_in_loop=False,
            reusable=base.reusable,
        )

    def _element_offsets(
        self,
        subscript: Expression | Colon,
        size: int,
        label: str,
        where: SourceLocation | None,
    ) -> list[int] | int | str:
        """Return the offset (from 0) of an element, a number or C code, or a list for a slice."""
        if isinstance(subscript, Colon):
            return list(range(size))
        if isinstance(subscript, Range):
            return [self._check_bounds(k, size, label, where) for k in self.static_range(subscript)]
        if (static := self.static_integer(subscript)) is not None:
            return self._check_bounds(static, size, label, where)
        value = self.lower(subscript)
        if value.shape or value.type == "Boolean":
            raise_model_error(f"this kind of subscript of {label} is not supported", where)
        if value.bounds and value.bounds[0] >= 1 and value.bounds[1] <= size:
            return f"{value.text.code} - 1"
        failure = self.translation_unit.failure_code(f"{label}: subscript outside 1..{size}", where)
        return c_call("element", "m", value.text, str(size), failure).code

    def _check_bounds(
        self, subscript: int, size: int, label: str, where: SourceLocation | None
    ) -> int:
        return (
            subscript - 1
            if 1 <= subscript <= size
            else raise_model_error(f"{label}: subscript {subscript} is outside 1..{size}", where)
        )
