"""What lowering to C needs besides the expressions themselves: the scope, statements in front, temporaries, constants."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import prod
from typing import Protocol

from ..model import flat_model
from ..model.flat_model import Expression, Place, refuse
from .c_values import C_TYPES, Text, Value, scalar, stored


@dataclass(frozen=True, slots=True)
class Instance:
    """A function of the model for arguments of given shapes, as a C function; `outputs` tell types and shapes."""

    name: str
    inputs: tuple[Value, ...]
    outputs: tuple[Value, ...]
    takes_model: bool

    @property
    def returns(self) -> bool:
        """Whether there is one scalar result, which is the value of the C function."""
        return len(self.outputs) == 1 and not self.outputs[0].shape


class Unit(Protocol):
    """What expressions need to know of the C file around them."""

    def failure(self, reason: str, where: Place | None) -> str:
        """The number of a reason why a step can fail."""

    def function(self, call: flat_model.Call, shapes: tuple[tuple[int, ...], ...]) -> Instance:
        """The C function for a call with arguments of these shapes."""


@dataclass
class Lowering:
    """One scope, the model (`m->x`) or the body of a function, and the C statements written so far."""

    unit: Unit
    scope: dict[str, Value]
    memory: dict[str, Value] = field(default_factory=dict)
    out: list[str] = field(default_factory=list)
    temporaries: int = 0

    def lower(self, node: Expression) -> Value:
        lowering = getattr(self, f"_{type(node).__name__.lower()}", None)
        if lowering is None:
            refuse(f"{type(node).__name__} cannot stand here", getattr(node, "where", None))
        return lowering(node)

    def scalar_of(self, node: Expression) -> Text:
        value = self.lower(node)
        if value.shape:
            refuse("a scalar is expected here, not an array", getattr(node, "where", None))
        return value.text

    @contextmanager
    def block(self) -> Iterator[list[str]]:
        """Collects the statements that are written meanwhile, indented."""
        outer, self.out = self.out, []
        yield self.out
        inner, self.out = self.out, outer
        inner[:] = ["    " + line for line in inner]

    def temporary(self, kind: str, shape: tuple[int, ...]) -> Value:
        """A new C variable that is declared here and not yet set."""
        self.temporaries += 1
        name = f"tmp_{self.temporaries}"
        self.out.append(f"{C_TYPES[kind]} {name}{f'[{prod(shape)}]' if shape else ''};")
        return stored(kind, shape, name)

    def held(self, value: Value) -> Value:
        """The same value, computed once."""
        if value.simple:
            return value
        if value.shape:
            target = self.temporary(value.type, value.shape)
            self.copy(target, value)
            return target
        self.temporaries += 1
        name = f"tmp_{self.temporaries}"
        self.out.append(f"const {C_TYPES[value.type]} {name} = {value.text.code};")
        return scalar(value.type, Text(name), simple=True)

    def array(self, value: Value, kind: str) -> str:
        """The name of a C array of this type that holds the value."""
        if value.pointer is not None and C_TYPES[value.type] == C_TYPES[kind]:
            return value.pointer
        target = self.temporary(kind, value.shape)
        self.copy(target, value)
        return str(target.pointer)

    def copy(self, target: Value, value: Value) -> None:
        """Element by element; the caller makes sure that the value does not read what is overwritten."""
        if value.loops and target.loops and value.size > 4:
            self.out.append(f"for (int each = 0; each < {value.size}; each++)")
            self.out.append(f"    {target.at('each').code} = {value.at('each').code};")
        else:
            self.out += [f"{target.at(k).code} = {value.at(k).code};" for k in range(value.size)]

    def shape(self, node: Expression) -> tuple[int, ...]:
        with self.block():
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
            return None if dimension is None else self.shape(node.arguments[0])[dimension - 1]
        return None

    def static_range(self, node: flat_model.Range) -> list[int]:
        start, step, stop = (
            self.static_integer(e) for e in (node.start, node.step or flat_model.Literal(1, "Integer"), node.stop)
        )
        if start is None or step is None or stop is None:
            refuse("the bounds of a slice must be constant", getattr(node.stop, "where", None))
        return list(range(start, stop + (1 if step > 0 else -1), step))
