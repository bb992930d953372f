"""C text for Modelica values: names, types, precedence, and arrays as functions from an index to the text of an element."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from math import prod
from typing import NamedTuple

C_TYPES = {"Real": "double", "Integer": "int32_t", "Enumeration": "int32_t", "Boolean": "bool"}

#: words of C, and the functions and locals that the emitted code uses itself
_RESERVED_WORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register restrict
    return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false NULL NAN INFINITY I
    m time each due risen event fail element add subtract multiply divide modulo remainder_of absolute integer_of smaller larger
    smaller_integer larger_integer square sign real_modulo real_remainder real_quotient
    integrate advance derivatives runge_kutta System
    acos asin atan atan2 ceil cos cosh exp fabs floor isfinite log log10 memcpy memset pow sin sinh sqrt tan tanh trunc
"""
_RESERVED = frozenset(_RESERVED_WORDS.split())
_GENERATED_NAME = re.compile(r"tmp_\d+|holds_\d+|pre_\w+")


def c_identifier(name: str) -> str:
    """A C identifier for a Modelica name: "pid[1].kp" becomes pid_1_kp."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
    if not plain or plain[0].isdigit():
        plain = "_" + plain
    return plain + "_" if plain in _RESERVED or _GENERATED_NAME.fullmatch(plain) else plain


class CExpression(NamedTuple):
    """A C expression and how tightly its outermost operator binds (see LEVELS; 20 for names, calls and parentheses)."""

    code: str
    precedence: int = 20

    def parenthesized(self, level: int) -> str:
        """The code as operand of an operator of this level, in parentheses where it binds less tightly."""
        return self.code if self.precedence >= level else f"({self.code})"


PRECEDENCE = {
    "?": 1,
    "||": 2,
    "&&": 4,
    "==": 6,
    "!=": 6,
    "<": 7,
    "<=": 7,
    ">": 7,
    ">=": 7,
    "+": 9,
    "-": 9,
    "*": 10,
    "/": 10,
    "unary": 12,
}


#: least levels that the left and the right operand need to stand without parentheses; more than C asks for where gcc warns
_OPERAND_PRECEDENCE = {
    "||": (6, 6),
    "&&": (4, 5),
    "==": (9, 9),
    "!=": (9, 9),
    "<": (9, 9),
    "<=": (9, 9),
    ">": (9, 9),
    ">=": (9, 9),
}
_OPERAND_PRECEDENCE |= {"+": (9, 10), "-": (9, 10), "*": (10, 11), "/": (10, 11)}


def infix(operator: str, left: CExpression, right: CExpression) -> CExpression:
    """`left operator right`, evaluated exactly in this grouping."""
    level, (needed_left, needed_right) = PRECEDENCE[operator], _OPERAND_PRECEDENCE[operator]
    same = operator == "||" and left.precedence == level
    return CExpression(
        f"{left.code if same else left.parenthesized(needed_left)} {operator} {right.parenthesized(needed_right)}", level
    )


def prefix(operator: str, operand: CExpression) -> CExpression:
    return CExpression(f"{operator}{operand.parenthesized(PRECEDENCE['unary'] + 1)}", PRECEDENCE["unary"])


def c_call(function: str, *arguments: CExpression | str) -> CExpression:
    return CExpression(f"{function}({', '.join(a if isinstance(a, str) else a.code for a in arguments)})")


def conditional(condition: CExpression, yes: CExpression, no: CExpression) -> CExpression:
    return CExpression(f"{condition.parenthesized(2)} ? {yes.parenthesized(2)} : {no.parenthesized(1)}", 1)


@dataclass(frozen=True, slots=True)
class CValue:
    """A scalar or array. `at` gives the text of an element from its place, row by row (a number or the name of a C index).

    `pointer` names a C array that holds exactly the elements. Where `loops` is false, `at` needs a number. A `simple`
    value may be written several times without being computed several times.
    """

    type: str
    shape: tuple[int, ...]
    element: Callable[[int | str], CExpression]
    pointer: str | None = None
    indexable_in_loop: bool = True
    reusable: bool = False
    #: bounds of a loop index that are known
    bounds: tuple[int, int] | None = None

    @property
    def text(self) -> CExpression:
        return self.element(0)

    @property
    def size(self) -> int:
        return prod(self.shape)


def scalar_value(kind: str, text: CExpression, simple: bool = False) -> CValue:
    return CValue(kind, (), lambda _: text, reusable=simple)


def variable_value(kind: str, shape: tuple[int, ...], code: str) -> CValue:
    """A C variable or array."""
    if not shape:
        return scalar_value(kind, CExpression(code), simple=True)
    return CValue(kind, shape, lambda k: CExpression(f"{code}[{k}]"), pointer=code, reusable=True)


def c_literal(value: float | int | bool, kind: str) -> CExpression:
    """A literal; a negative one binds like a sign."""
    if kind == "Boolean":
        return CExpression("true" if value else "false")
    code = repr(float(value)) if kind == "Real" else str(int(value))
    return CExpression(code, PRECEDENCE["unary"] if code.startswith("-") else 20)


def linear_index(terms: list[tuple[int, int | str]]) -> int | str:
    """The C text of sum(factor * index), numbers folded."""
    constant = sum(factor * index for factor, index in terms if isinstance(index, int))
    parts = [
        index if factor == 1 else f"{factor}*{_parenthesize_index(index)}" for factor, index in terms if isinstance(index, str)
    ]
    if not parts:
        return constant
    return " + ".join(parts) + (f" + {constant}" if constant > 0 else f" - {-constant}" if constant < 0 else "")


def _parenthesize_index(index: str) -> str:
    return index if re.fullmatch(r"\w+(\(.*\))?", index) else f"({index})"


def common_type(kinds: list[str]) -> str:
    """The type of an array or choice of values of these types: Real where Real and Integer meet."""
    return "Real" if "Real" in kinds else kinds[0]


def map_elements(value: CValue, kind: str, change: Callable[[CExpression], CExpression]) -> CValue:
    """An elementwise function of one value."""
    return CValue(kind, value.shape, lambda k: change(value.element(k)), indexable_in_loop=value.indexable_in_loop)


def sum_terms(kind: str, terms: list[CExpression]) -> CExpression:
    """The sum from left to right."""
    if not terms:
        return c_literal(0, kind)
    if kind == "Real":
        return reduce(lambda a, b: infix("+", a, b), terms)
    return reduce(lambda a, b: c_call("add", "m", a, b), terms)
