"""C expressions of Modelica values.

Identifiers, types, operator precedence and element access of arrays.
"""

import re
import textwrap
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import reduce
from math import prod
from typing import NamedTuple

from ..model.builtin_functions import BUILTIN_FUNCTIONS

C_TYPES = {
    "Real": "double",
    "Integer": "int32_t",
    "Enumeration": "int32_t",
    "Boolean": "bool",
    "String": "const char *",
    "ExternalObject": "uint64_t",
}

#: keywords of C, and the functions and local variables of the generated code besides `c_functions`
#: of the table of built-in functions
_RESERVED_WORDS = """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while bool true false NULL NAN INFINITY I
    m time each due risen event fail element add subtract multiply square
    integrate advance derivatives runge_kutta System isfinite memcpy memset pow trunc
"""
_RESERVED = frozenset(_RESERVED_WORDS.split()).union(
    *(function.c_functions for function in BUILTIN_FUNCTIONS.values())
)
_GENERATED_NAME = re.compile(r"tmp_\d+|holds_\d+|pre_\w+")


def c_identifier(name: str) -> str:
    """Return a C identifier for a Modelica name: "pid[1].kp" becomes pid_1_kp.

    Different names may give the same one.
    """
    identifier = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
    if not identifier or identifier[0].isdigit():
        identifier = "_" + identifier
    return (
        identifier + "_"
        if identifier in _RESERVED or _GENERATED_NAME.fullmatch(identifier)
        else identifier
    )


class CExpression(NamedTuple):
    """A C expression with the precedence of its outermost operator."""

    code: str
    #: a value of `PRECEDENCE`, or 20 for names, calls and parentheses
    precedence: int = 20

    def parenthesized(self, least_precedence: int) -> str:
        """Return the code, in parentheses if its precedence is lower than `least_precedence`."""
        return self.code if self.precedence >= least_precedence else f"({self.code})"


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

#: least precedence of the left and the right operand without parentheses; higher than C requires
#: where gcc would warn
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
    """Return `left operator right`.

    Parentheses preserve the grouping, so that floating-point results do not change.
    """
    precedence, (least_left, least_right) = PRECEDENCE[operator], _OPERAND_PRECEDENCE[operator]
    is_or_chain = operator == "||" and left.precedence == precedence
    left_code = left.code if is_or_chain else left.parenthesized(least_left)
    return CExpression(f"{left_code} {operator} {right.parenthesized(least_right)}", precedence)


def prefix(operator: str, operand: CExpression) -> CExpression:
    """Return a unary operation: `-operand`, `!operand` or a cast."""
    return CExpression(
        f"{operator}{operand.parenthesized(PRECEDENCE['unary'] + 1)}", PRECEDENCE["unary"]
    )


def c_call(function: str, *arguments: CExpression | str) -> CExpression:
    """Return a function call."""
    return CExpression(
        f"{function}({', '.join(a if isinstance(a, str) else a.code for a in arguments)})"
    )


def conditional(condition: CExpression, yes: CExpression, no: CExpression) -> CExpression:
    """Return the conditional expression `condition ? yes : no`."""
    return CExpression(
        f"{condition.parenthesized(2)} ? {yes.parenthesized(2)} : {no.parenthesized(1)}", 1
    )


@dataclass(frozen=True, slots=True)
class CValue:
    """A scalar or array value in C."""

    #: Modelica type
    type: str
    shape: tuple[int, ...]
    #: row-major index of an element (a number, or a C expression) -> C expression of the element
    element: Callable[[int | str], CExpression]
    #: name of the C array with these elements, if there is one
    pointer: str | None = None
    #: true if `element` accepts the name of a loop index, false if it accepts numbers only
    indexable_in_loop: bool = True
    #: true if the expression can be repeated in the C code without computing the value again
    reusable: bool = False
    #: smallest and largest value of a loop index, if they are known
    bounds: tuple[int, int] | None = None

    @property
    def text(self) -> CExpression:
        """Expression of a scalar, or of the first element."""
        return self.element(0)

    @property
    def size(self) -> int:
        """Number of elements."""
        return prod(self.shape)


def scalar_value(type_name: str, text: CExpression, reusable: bool = False) -> CValue:
    """Return a scalar value."""
    return CValue(type_name, (), lambda _: text, reusable=reusable)


def variable_value(type_name: str, shape: tuple[int, ...], code: str) -> CValue:
    """Return the value of a C variable, or of a C array if the shape is not ()."""
    if not shape:
        return scalar_value(type_name, CExpression(code), reusable=True)
    return CValue(
        type_name, shape, lambda k: CExpression(f"{code}[{k}]"), pointer=code, reusable=True
    )


def c_literal(value: float | int | bool, type_name: str) -> CExpression:
    """Return a literal; a negative one has the precedence of the unary minus."""
    if type_name == "Boolean":
        return CExpression("true" if value else "false")
    code = repr(float(value)) if type_name == "Real" else str(int(value))
    return CExpression(code, PRECEDENCE["unary"] if code.startswith("-") else 20)


def linear_index(terms: list[tuple[int, int | str]]) -> int | str:
    """Return the sum of all factor * index as a number, or as C code if an index is C code."""
    constant = sum(factor * index for factor, index in terms if isinstance(index, int))
    parts = [
        index if factor == 1 else f"{factor}*{_parenthesize_index(index)}"
        for factor, index in terms
        if isinstance(index, str)
    ]
    if not parts:
        return constant
    text = " + ".join(parts)
    if constant == 0:
        return text
    return f"{text} {'+' if constant > 0 else '-'} {abs(constant)}"


def _parenthesize_index(index: str) -> str:
    return index if re.fullmatch(r"\w+(\(.*\))?", index) else f"({index})"


def common_type(type_names: list[str]) -> str:
    """Return the common type of several values.

    Real if one of them is Real, else the type of the first.
    """
    return "Real" if "Real" in type_names else type_names[0]


def map_elements(
    value: CValue, type_name: str, change: Callable[[CExpression], CExpression]
) -> CValue:
    """Return the value of an elementwise function of one argument."""
    return CValue(
        type_name,
        value.shape,
        lambda k: change(value.element(k)),
        indexable_in_loop=value.indexable_in_loop,
    )


def sum_terms(type_name: str, terms: list[CExpression]) -> CExpression:
    """Return the sum of the terms from left to right; Integer sums are checked for overflow."""
    if not terms:
        return c_literal(0, type_name)
    if type_name == "Real":
        return reduce(lambda a, b: infix("+", a, b), terms)
    return reduce(lambda a, b: c_call("add", "m", a, b), terms)


_WIDTH = 118


def function_definition(head: str, body: Iterable[str]) -> str:
    """Return a C function definition with the given signature and unindented lines of its body."""
    return "\n".join([head, "{", *wrap_lines(body), "}"])


def wrap_lines(lines: Iterable[str]) -> Iterator[str]:
    """Yield the lines indented by one level.

    Long lines are wrapped, except those with text in quotation marks.
    """
    for line in lines:
        if '"' in line:
            yield "    " + line
            continue
        indent = " " * (8 + len(line) - len(line.lstrip()))
        yield from textwrap.wrap(
            "    " + line,
            _WIDTH,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
            drop_whitespace=True,
        ) or [""]


def uses_variable(name: str, lines: Iterable[str]) -> bool:
    """Return whether a C variable with this name (not a struct member) occurs in the lines."""
    return any(re.search(rf"(?<![\w>.]){re.escape(name)}\b", line) for line in lines)
