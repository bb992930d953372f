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
_WORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline int long register restrict
    return short signed sizeof static struct switch typedef union unsigned void volatile while bool true false NULL NAN INFINITY I
    m time each due risen event fail element add subtract multiply divide modulo remainder_of absolute integer_of smaller larger
    smaller_integer larger_integer square sign real_modulo real_remainder real_quotient
    integrate advance derivatives runge_kutta System
    acos asin atan atan2 ceil cos cosh exp fabs floor isfinite log log10 memcpy memset pow sin sinh sqrt tan tanh trunc
"""
_TAKEN = frozenset(_WORDS.split())
_OURS = re.compile(r"tmp_\d+|holds_\d+|pre_\w+")


def identifier(name: str) -> str:
    """A C identifier for a Modelica name: "pid[1].kp" becomes pid_1_kp."""
    plain = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
    if not plain or plain[0].isdigit():
        plain = "_" + plain
    return plain + "_" if plain in _TAKEN or _OURS.fullmatch(plain) else plain


class Text(NamedTuple):
    """A C expression and how tightly its outermost operator binds (see LEVELS; 20 for names, calls and parentheses)."""

    code: str
    level: int = 20

    def within(self, level: int) -> str:
        """The code as operand of an operator of this level, in parentheses where it binds less tightly."""
        return self.code if self.level >= level else f"({self.code})"


LEVELS = {
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
_OPERANDS = {"||": (6, 6), "&&": (4, 5), "==": (9, 9), "!=": (9, 9), "<": (9, 9), "<=": (9, 9), ">": (9, 9), ">=": (9, 9)}
_OPERANDS |= {"+": (9, 10), "-": (9, 10), "*": (10, 11), "/": (10, 11)}


def infix(operator: str, left: Text, right: Text) -> Text:
    """`left operator right`, evaluated exactly in this grouping."""
    level, (needed_left, needed_right) = LEVELS[operator], _OPERANDS[operator]
    same = operator == "||" and left.level == level
    return Text(f"{left.code if same else left.within(needed_left)} {operator} {right.within(needed_right)}", level)


def prefix(operator: str, operand: Text) -> Text:
    return Text(f"{operator}{operand.within(LEVELS['unary'] + 1)}", LEVELS["unary"])


def call(function: str, *arguments: Text | str) -> Text:
    return Text(f"{function}({', '.join(a if isinstance(a, str) else a.code for a in arguments)})")


def choose(condition: Text, yes: Text, no: Text) -> Text:
    return Text(f"{condition.within(2)} ? {yes.within(2)} : {no.within(1)}", 1)


@dataclass(frozen=True, slots=True)
class Value:
    """A scalar or array. `at` gives the text of an element from its place, row by row (a number or the name of a C index).

    `pointer` names a C array that holds exactly the elements. Where `loops` is false, `at` needs a number. A `simple`
    value may be written several times without being computed several times.
    """

    type: str
    shape: tuple[int, ...]
    at: Callable[[int | str], Text]
    pointer: str | None = None
    loops: bool = True
    simple: bool = False
    #: bounds of a loop index that are known
    bounds: tuple[int, int] | None = None

    @property
    def text(self) -> Text:
        return self.at(0)

    @property
    def size(self) -> int:
        return prod(self.shape)


def scalar(kind: str, text: Text, simple: bool = False) -> Value:
    return Value(kind, (), lambda _: text, simple=simple)


def stored(kind: str, shape: tuple[int, ...], code: str) -> Value:
    """A C variable or array."""
    if not shape:
        return scalar(kind, Text(code), simple=True)
    return Value(kind, shape, lambda k: Text(f"{code}[{k}]"), pointer=code, simple=True)


def number(value: float | int | bool, kind: str) -> Text:
    """A literal; a negative one binds like a sign."""
    if kind == "Boolean":
        return Text("true" if value else "false")
    code = repr(float(value)) if kind == "Real" else str(int(value))
    return Text(code, LEVELS["unary"] if code.startswith("-") else 20)


def offset(terms: list[tuple[int, int | str]]) -> int | str:
    """The C text of sum(factor * index), numbers folded."""
    constant = sum(factor * index for factor, index in terms if isinstance(index, int))
    parts = [index if factor == 1 else f"{factor}*{_grouped(index)}" for factor, index in terms if isinstance(index, str)]
    if not parts:
        return constant
    return " + ".join(parts) + (f" + {constant}" if constant > 0 else f" - {-constant}" if constant < 0 else "")


def _grouped(index: str) -> str:
    return index if re.fullmatch(r"\w+(\(.*\))?", index) else f"({index})"


def common(kinds: list[str]) -> str:
    """The type of an array or choice of values of these types: Real where Real and Integer meet."""
    return "Real" if "Real" in kinds else kinds[0]


def mapped(value: Value, kind: str, change: Callable[[Text], Text]) -> Value:
    """An elementwise function of one value."""
    return Value(kind, value.shape, lambda k: change(value.at(k)), loops=value.loops)


def add_up(kind: str, terms: list[Text]) -> Text:
    """The sum from left to right."""
    if not terms:
        return number(0, kind)
    if kind == "Real":
        return reduce(lambda a, b: infix("+", a, b), terms)
    return reduce(lambda a, b: call("add", "m", a, b), terms)
