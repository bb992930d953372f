"""Table of the built-in functions and operators of Modelica: one row for each.

The meaning of the functions is that of the Modelica Language Specification 3.6, chapters 3.7
(functions and event operators), 10 (arrays) and 16 (clocks).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from itertools import chain
from typing import Any, TypeAlias
from typing import Literal as OneOf

import numpy as np

from .arithmetic import (
    EvaluationError,
    check_int32,
    divide,
    elementwise,
    floor_to_int32,
    sum_of,
    to_python_scalar,
    with_ieee_results,
)
from .simplification import ONE, ZERO, add, multiply, negate, square, subtract
from .simplification import divide as quotient
from .syntax_tree import Binary, Builtin, Expression, If, Literal

#: derivative of a call, from a function that differentiates and the arguments; None if unknown
Derivative: TypeAlias = "Callable[..., Expression | None]"
#: "math": a function of the C library, applied element by element; "rounding": a value that
#: changes in steps; "memory": the value of a variable before the event; "conversion": another
#: rate of a clock; "clocked": a further operator on clocks; "": all others
Kind = OneOf["math", "rounding", "memory", "conversion", "clocked", ""]


@dataclass(frozen=True, slots=True)
class BuiltinFunction:
    """A built-in function or operator of Modelica."""

    name: str
    kind: Kind = ""
    #: value in Python, with the same results as the C code; None without one outside of a run
    evaluate: Callable[..., Any] | None = None
    derivative: Derivative | None = None
    #: functions of the C library or of runtime.h, for Real and for Integer operands
    c_functions: tuple[str, ...] = ()
    #: method of `BuiltinLowering` that generates the C code, without the prefix `_lower_`; "" for
    #: an operator that is replaced before code is generated
    lowering: str = ""
    #: true if it is applied to arrays element by element
    is_elementwise: bool = False


# -- evaluation in Python


def _real_or_integer(
    real: Callable[[float, float], float], whole: Callable[[int, int], int]
) -> Callable[[Any, Any], Any]:
    """Combine a function for Real and one for Integer arguments.

    The latter fails for a divisor of zero.
    """

    def wrapped(a: Any, b: Any) -> Any:
        if isinstance(a, float) or isinstance(b, float):
            return real(a, b)
        if b == 0:
            raise EvaluationError("division by zero in div(), mod() or rem()")
        return check_int32(whole(a, b))

    return wrapped


def _quotient(a: int, b: int) -> int:
    """Return the quotient rounded toward zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def _minimum(*arguments: Any) -> Any:
    return reduce(lambda a, b: a if a < b else b, _flat_elements(arguments))


def _maximum(*arguments: Any) -> Any:
    return reduce(lambda a, b: a if a > b else b, _flat_elements(arguments))


def _flat_elements(arguments: tuple[Any, ...]) -> list[Any]:
    """Return all elements of the arguments, converted to Real if one of them is Real."""
    flat = chain.from_iterable(np.asarray(argument).flat for argument in arguments)
    elements = list(map(to_python_scalar, flat))
    return [float(x) for x in elements] if any(isinstance(x, float) for x in elements) else elements


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def _as_matrix(value: Any) -> np.ndarray:
    """Return a scalar or a vector as a matrix with one column, as concatenation does."""
    array = np.asarray(value)
    return array.reshape(array.shape + (1,) * (2 - array.ndim)) if array.ndim < 2 else array


def _concatenated(axis: int) -> Callable[..., np.ndarray]:
    return lambda *parts: np.concatenate([_as_matrix(part) for part in parts], axis=axis)


def _size(array: Any, dimension: int | None = None) -> Any:
    return np.array(np.shape(array)) if dimension is None else np.shape(array)[dimension - 1]


def _linspace(first: float, last: float, n: int) -> np.ndarray:
    return np.array([first + (last - first) * k / (n - 1) for k in range(n)])


def _floor(x: float) -> float:
    return float(np.floor(x))


def _ceil(x: float) -> float:
    return float(np.ceil(x))


def _integer(x: Any) -> Any:
    return floor_to_int32(x) if isinstance(x, float) else x


def _on_elements(function: Callable[[Any], Any]) -> Callable[..., Any]:
    return partial(elementwise, function)


# -- derivatives


def _call(name: str, *arguments: Expression) -> Expression:
    return Builtin(name, arguments)


def _chain(outer: Callable[[Expression], Expression]) -> Derivative:
    """Return the derivative of f(x) by the chain rule; `outer` is the derivative of f."""
    return lambda differentiate, x: multiply(outer(x), differentiate(x))


def _constant(_differentiate: Any, *_arguments: Expression) -> Expression:
    return ZERO


def _of_argument(number: int) -> Derivative:
    """Return the derivative of a function that returns one of its arguments."""
    return lambda differentiate, *arguments: differentiate(arguments[number])


def _of_selected(comparison: str) -> Derivative:
    """Return the derivative of min() or max(): that of the selected argument."""

    def derivative(differentiate: Any, *arguments: Expression) -> Expression | None:
        if len(arguments) != 2:
            return None
        is_first = Builtin("noEvent", (Binary(comparison, *arguments),))
        return If(((is_first, differentiate(arguments[0])),), differentiate(arguments[1]))

    return derivative


def _of_atan2(differentiate: Any, y: Expression, x: Expression) -> Expression:
    numerator = subtract(multiply(x, differentiate(y)), multiply(y, differentiate(x)))
    return quotient(numerator, add(square(x), square(y)))


def _arc_sine_slope(x: Expression) -> Expression:
    return quotient(ONE, _call("sqrt", subtract(ONE, square(x))))


def _sign_of(x: Expression) -> Expression:
    is_negative = Builtin("noEvent", (Binary("<", x, ZERO),))
    return If(((is_negative, Literal(-1.0, "Real")),), ONE)


# -- the table


def _math(
    name: str, function: Callable[..., float], slope: Callable[[Expression], Expression]
) -> BuiltinFunction:
    """Return the row of a function of the C library with its derivative."""
    at_pole = -math.inf if name in ("log", "log10") else math.nan
    evaluate = _on_elements(with_ieee_results(function, at_pole))
    return BuiltinFunction(name, "math", evaluate, _chain(slope), (name,), "math", True)


def _array(name: str, evaluate: Callable[..., Any], lowering: str) -> BuiltinFunction:
    """Return the row of a function on arrays."""
    return BuiltinFunction(name, "", evaluate, lowering=lowering)


_ROWS = (
    _math("sin", math.sin, lambda x: _call("cos", x)),
    _math("cos", math.cos, lambda x: negate(_call("sin", x))),
    _math("tan", math.tan, lambda x: add(ONE, square(_call("tan", x)))),
    _math("asin", math.asin, _arc_sine_slope),
    _math("acos", math.acos, lambda x: negate(_arc_sine_slope(x))),
    _math("atan", math.atan, lambda x: quotient(ONE, add(ONE, square(x)))),
    _math("sinh", math.sinh, lambda x: _call("cosh", x)),
    _math("cosh", math.cosh, lambda x: _call("sinh", x)),
    _math("tanh", math.tanh, lambda x: subtract(ONE, square(_call("tanh", x)))),
    _math("exp", math.exp, lambda x: _call("exp", x)),
    _math("log", math.log, lambda x: quotient(ONE, x)),
    _math("log10", math.log10, lambda x: quotient(Literal(0.4342944819032518, "Real"), x)),
    _math("sqrt", math.sqrt, lambda x: quotient(Literal(0.5, "Real"), _call("sqrt", x))),
    BuiltinFunction("atan2", "", math.atan2, _of_atan2, ("atan2",), "atan2"),
    BuiltinFunction(
        "abs",
        evaluate=_on_elements(lambda x: check_int32(abs(x))),
        derivative=_chain(_sign_of),
        c_functions=("fabs", "absolute"),
        lowering="abs",
        is_elementwise=True,
    ),
    BuiltinFunction(
        "sign", "", _on_elements(lambda x: (x > 0) - (x < 0)), _constant, ("sign",), "sign", True
    ),
    BuiltinFunction(
        "min", "", _minimum, _of_selected("<"), ("smaller", "smaller_integer"), "two_operands"
    ),
    BuiltinFunction(
        "max", "", _maximum, _of_selected(">"), ("larger", "larger_integer"), "two_operands"
    ),
    # rounding
    BuiltinFunction("floor", "rounding", _on_elements(_floor), _constant, ("floor",), "math", True),
    BuiltinFunction("ceil", "rounding", _on_elements(_ceil), _constant, ("ceil",), "math", True),
    BuiltinFunction(
        "integer", "rounding", _on_elements(_integer), _constant, ("integer_of",), "integer", True
    ),
    BuiltinFunction(
        "div",
        "rounding",
        _real_or_integer(lambda a, b: float(np.trunc(divide(a, b))), _quotient),
        c_functions=("real_quotient", "divide"),
        lowering="two_operands",
    ),
    BuiltinFunction(
        "mod",
        "rounding",
        _real_or_integer(lambda a, b: a - float(np.floor(divide(a, b))) * b, operator.mod),
        c_functions=("real_modulo", "modulo"),
        lowering="two_operands",
    ),
    BuiltinFunction(
        "rem",
        "rounding",
        _real_or_integer(
            lambda a, b: a - float(np.trunc(divide(a, b))) * b, lambda a, b: a - b * _quotient(a, b)
        ),
        c_functions=("real_remainder", "remainder_of"),
        lowering="two_operands",
    ),
    # arrays; rows(a, b) is `[a; b]` and columns(a, b) is `[a, b]`
    _array("cat", lambda _, *arrays: np.concatenate(arrays), "concatenation"),
    _array("rows", _concatenated(0), "matrix"),
    _array("columns", _concatenated(1), "matrix"),
    _array("cross", _cross, "cross"),
    _array("diagonal", lambda x: np.diag(np.asarray(x)), "diagonal"),
    _array("fill", lambda value, *sizes: np.full(sizes, value), "fill"),
    _array("zeros", lambda *sizes: np.zeros(sizes, np.int64), "fill"),
    _array("ones", lambda *sizes: np.ones(sizes, np.int64), "fill"),
    _array("identity", lambda n: np.eye(n, dtype=np.int64), "identity"),
    _array("linspace", _linspace, "linspace"),
    _array("ndims", np.ndim, "ndims"),
    _array(
        "product",
        lambda x: reduce(lambda a, b: check_int32(a * b), _flat_elements((x,))),
        "product",
    ),
    _array("scalar", lambda x: to_python_scalar(np.asarray(x).flat[0]), "scalar"),
    _array("size", _size, "size"),
    _array("sum", sum_of, "sum"),
    _array("transpose", np.transpose, "transpose"),
    _array("vector", np.ravel, "vector"),
    BuiltinFunction("outerProduct"),
    # events and initialization
    BuiltinFunction(
        "noEvent",
        evaluate=lambda x: x,
        derivative=_of_argument(0),
        lowering="first_argument",
        is_elementwise=True,
    ),
    BuiltinFunction(
        "homotopy",
        evaluate=lambda actual, _: actual,
        derivative=_of_argument(0),
        lowering="first_argument",
        is_elementwise=True,
    ),
    BuiltinFunction(
        "smooth", evaluate=lambda _, x: x, derivative=_of_argument(1), lowering="smooth"
    ),
    BuiltinFunction("pre", "memory", lambda x: x, _constant, (), "pre", True),
    BuiltinFunction("edge", "memory", lambda _: False, lowering="edge"),
    BuiltinFunction("change", "memory", lambda _: False, lowering="change"),
    BuiltinFunction("der", is_elementwise=True),
    BuiltinFunction("delay"),
    BuiltinFunction("initial"),
    BuiltinFunction("sample"),
    BuiltinFunction("String", is_elementwise=True),
    # clocks
    *(
        BuiltinFunction(name, "conversion")
        for name in ("subSample", "superSample", "shiftSample", "backSample")
    ),
    *(
        BuiltinFunction(name, "clocked")
        for name in ("hold", "noClock", "previous", "firstTick", "interval", "Clock")
    ),
    # inserted by the compiler: clock k ticks, condition k has become true, argument of delay() k
    BuiltinFunction("due", lowering="event_flag"),
    BuiltinFunction("risen", lowering="event_flag"),
    BuiltinFunction("past", lowering="past"),
)

BUILTIN_FUNCTIONS = {row.name: row for row in _ROWS}
#: name in lower case -> name
SPELLINGS = {name.lower(): name for name in BUILTIN_FUNCTIONS}


def names_of_kind(*kinds: Kind) -> tuple[str, ...]:
    """Return the names of all functions of some kinds."""
    return tuple(row.name for row in _ROWS if row.kind in kinds)


#: operators that use the value of a variable before the current event
PRE_OPERATORS = names_of_kind("memory")
ROUNDINGS = names_of_kind("rounding")
CONVERSIONS = names_of_kind("conversion")
CLOCKED_OPERATORS = names_of_kind("conversion", "clocked")
