"""What lowering to C needs besides the expressions themselves: the scope, statements in front, temporaries, constants."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import prod
from typing import Protocol

from ..model import flat_model
from ..model.flat_model import Expression, SourceLocation, raise_model_error
from .c_values import C_TYPES, CExpression, CValue, scalar_value, variable_value


@dataclass(frozen=True, slots=True)
class FunctionInstance:
    """A function of the model for arguments of given shapes, as a C function; `outputs` tell types and shapes."""

    name: str
    inputs: tuple[CValue, ...]
    outputs: tuple[CValue, ...]
    takes_model: bool

    @property
    def returns_scalar(self) -> bool:
        """Whether there is one scalar result, which is the value of the C function."""
        return len(self.outputs) == 1 and not self.outputs[0].shape


class TranslationUnit(Protocol):
    """What expressions need to know of the C file around them."""

    def failure_code(self, reason: str, where: SourceLocation | None) -> str:
        """The number of a reason why a step can fail."""

    def function_instance(self, call: flat_model.Call, shapes: tuple[tuple[int, ...], ...]) -> FunctionInstance:
        """The C function for a call with arguments of these shapes."""


@dataclass
class Lowering:
    """One scope, the model (`m->x`) or the body of a function, and the C statements written so far."""

    translation_unit: TranslationUnit
    scope: dict[str, CValue]
    pre_scope: dict[str, CValue] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)
    temporaries: int = 0

    def lower(self, node: Expression) -> CValue:
        lowering = getattr(self, f"_{type(node).__name__.lower()}", None)
        if lowering is None:
            raise_model_error(f"{type(node).__name__} cannot stand here", getattr(node, "where", None))
        return lowering(node)

    def scalar_of(self, node: Expression) -> CExpression:
        value = self.lower(node)
        if value.shape:
            raise_model_error("a scalar is expected here, not an array", getattr(node, "where", None))
        return value.text

    @contextmanager
    def collect_lines(self) -> Iterator[list[str]]:
        """Collects the statements that are written meanwhile, indented."""
        outer, self.lines = self.lines, []
        yield self.lines
        inner, self.lines = self.lines, outer
        inner[:] = ["    " + line for line in inner]

    def new_temporary(self, kind: str, shape: tuple[int, ...]) -> CValue:
        """A new C variable that is declared here and not yet set."""
        self.temporaries += 1
        name = f"tmp_{self.temporaries}"
        self.lines.append(f"{C_TYPES[kind]} {name}{f'[{prod(shape)}]' if shape else ''};")
        return variable_value(kind, shape, name)

    def evaluated_once(self, value: CValue) -> CValue:
        """The same value, computed once."""
        if value.reusable:
            return value
        if value.shape:
            target = self.new_temporary(value.type, value.shape)
            self.copy_elements(target, value)
            return target
        self.temporaries += 1
        name = f"tmp_{self.temporaries}"
        self.lines.append(f"const {C_TYPES[value.type]} {name} = {value.text.code};")
        return scalar_value(value.type, CExpression(name), simple=True)

    def as_c_array(self, value: CValue, kind: str) -> str:
        """The name of a C array of this type that holds the value."""
        if value.pointer is not None and C_TYPES[value.type] == C_TYPES[kind]:
            return value.pointer
        target = self.new_temporary(kind, value.shape)
        self.copy_elements(target, value)
        return str(target.pointer)

    def copy_elements(self, target: CValue, value: CValue) -> None:
        """Element by element; the caller makes sure that the value does not read what is overwritten."""
        if value.indexable_in_loop and target.indexable_in_loop and value.size > 4:
            self.lines.append(f"for (int each = 0; each < {value.size}; each++)")
            self.lines.append(f"    {target.element('each').code} = {value.element('each').code};")
        else:
            self.lines += [f"{target.element(k).code} = {value.element(k).code};" for k in range(value.size)]

    def shape_of(self, node: Expression) -> tuple[int, ...]:
        with self.collect_lines():
            return self.lower(node).shape

    # what is known while translating

    def static_integer(self, node: Expression) -> int | None:
        """The value of an Integer expression that does not depend on variables: literals, size() and sums of them."""
        if isinstance(node, flat_model.Literal) and node.type in ("Integer", "Enumeration"):
            return int(node.value)
        if isinstance(node, flat_model.Unary) and node.operator == "-":
            operand = self.static_integer(node.operand)
            return None if operand is None else -operand
        if isinstance(node, flat_model.Binary) and node.operator in ("+", "-", "*"):
            left, right = self.static_integer(node.left), self.static_integer(node.right)
            if left is None or right is None:
                return None
            return {"+": left + right, "-": left - right, "*": left * right}[node.operator]
        if isinstance(node, flat_model.Builtin) and node.name == "size" and len(node.arguments) == 2:
            dimension = self.static_integer(node.arguments[1])
            return None if dimension is None else self.shape_of(node.arguments[0])[dimension - 1]
        return None

    def static_range(self, node: flat_model.Range) -> list[int]:
        start, step, stop = (
            self.static_integer(e) for e in (node.start, node.step or flat_model.Literal(1, "Integer"), node.stop)
        )
        if start is None or step is None or stop is None:
            raise_model_error("the bounds of a slice must be constant", getattr(node.stop, "where", None))
        return list(range(start, stop + (1 if step > 0 else -1), step))
