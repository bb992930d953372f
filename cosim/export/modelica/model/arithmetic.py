"""Operators and built-in functions of the interpreter, with the same results as the generated C code, bit for bit.

The order of operations is that of the C code, and `math` provides the functions of the C library. Where Python would raise an
exception, the result is that of IEEE 754 (NaN or infinity). Arrays are NumPy arrays that are computed element by element.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping
from functools import partial, reduce
from typing import Any

import numpy as np

from .syntax_tree import SourceLocation

_INT32 = range(-(2**31), 2**31)


class EvaluationError(Exception):
    """Failure of a model during its evaluation, for example a violated assert().

    The text is the reason.
    """

    def __init__(self, reason: str, where: SourceLocation | None = None):
        super().__init__(f"{reason} ({where.file_and_line})" if where else reason)


def elementwise(function: Callable[..., Any], *arguments: Any) -> Any:
    """Apply a function of scalars to scalars, or element by element to arrays of equal shape."""
    if not any(isinstance(a, np.ndarray) for a in arguments):
        return function(*arguments)
    arrays = np.broadcast_arrays(*arguments)
    results = [
        function(*(to_python_scalar(x) for x in elements))
        for elements in zip(*(a.flat for a in arrays), strict=True)
    ]
    return np.array(results).reshape(arrays[0].shape)


def to_python_scalar(value: Any) -> Any:
    """Convert a NumPy scalar to a Python scalar; return all other values unchanged."""
    return value.item() if isinstance(value, np.generic) else value


def check_int32(value: float | int) -> float | int:
    """Return a number after the check that it is not an Integer outside the range of int32.

    Raises:
        EvaluationError: The number is an Integer outside the range of int32.
    """
    if isinstance(value, int) and value not in _INT32:
        raise EvaluationError("Integer overflow")
    return value


def matrix_product(left: np.ndarray, right: np.ndarray) -> Any:
    """Return the matrix product, with sums from left to right as in the C code.

    NumPy may add in another order.
    """
    rows, columns = left.reshape(-1, left.shape[-1]), right.reshape(right.shape[0], -1)
    sums = [
        [
            _sum(
                [
                    check_int32(to_python_scalar(a) * to_python_scalar(b))
                    for a, b in zip(r, c, strict=True)
                ]
            )
            for c in columns.T
        ]
        for r in rows
    ]
    return to_python_scalar(np.array(sums).reshape((*left.shape[:-1], *right.shape[1:]))[()])


def _sum(values: Any) -> Any:
    return (
        reduce(lambda a, b: check_int32(a + b), map(to_python_scalar, np.asarray(values).flat))
        if np.size(values)
        else 0
    )


def divide(a: float, b: float) -> float:
    """Return `a / b` as defined by IEEE 754, also for b = 0."""
    if b != 0:
        return a / b
    with np.errstate(all="ignore"):
        return float(np.float64(a) / np.float64(b))


def _with_ieee_results(
    function: Callable[..., float], at_pole: float = math.nan
) -> Callable[..., float]:
    """Wrap a function of `math` so that it returns NaN, infinity or the value at its pole where Python raises an error."""

    def wrapped(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except ValueError:
            return at_pole if 0 in arguments else math.nan

    return wrapped


def _floor_to_int32(x: float) -> int:
    if not math.isfinite(x) or math.floor(x) not in _INT32:
        raise EvaluationError("Integer overflow")
    return math.floor(x)


def _real_or_integer(
    real: Callable[[float, float], float], whole: Callable[[int, int], int]
) -> Callable[[Any, Any], Any]:
    """Combine a function for Real and one for Integer arguments.

    For Integers division by zero is a failure.
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
    elements = [to_python_scalar(x) for argument in arguments for x in np.asarray(argument).flat]
    return [float(x) for x in elements] if any(isinstance(x, float) for x in elements) else elements


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def _as_matrix(value: Any) -> np.ndarray:
    """Return a scalar or a vector as a matrix with one column, as concatenation does."""
    array = np.asarray(value)
    return array.reshape(array.shape + (1,) * (2 - array.ndim)) if array.ndim < 2 else array


def _size(array: Any, dimension: int | None = None) -> Any:
    return np.array(np.shape(array)) if dimension is None else np.shape(array)[dimension - 1]


OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: check_int32(a + b),
    "-": lambda a, b: check_int32(a - b),
    "*": lambda a, b: check_int32(a * b),
    "/": divide,
    "^": lambda a, b: _with_ieee_results(math.pow, math.inf)(a, b),
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "<>": operator.ne,
}
_FUNCTIONS = (
    math.sin,
    math.cos,
    math.tan,
    math.asin,
    math.acos,
    math.atan,
    math.sinh,
    math.cosh,
    math.tanh,
    math.exp,
    math.sqrt,
)
_MATH_FUNCTIONS = {function.__name__: _with_ieee_results(function) for function in _FUNCTIONS}
_MATH_FUNCTIONS |= {
    function.__name__: _with_ieee_results(function, -math.inf)
    for function in (math.log, math.log10)
}
_MATH_FUNCTIONS |= {"floor": lambda x: float(np.floor(x)), "ceil": lambda x: float(np.ceil(x))}
BUILTINS: Mapping[str, Callable[..., Any]] = {
    **{name: partial(elementwise, function) for name, function in _MATH_FUNCTIONS.items()},
    "abs": lambda x: elementwise(lambda y: check_int32(abs(y)), x),
    "atan2": math.atan2,
    "cat": lambda _, *arrays: np.concatenate(arrays),
    "change": lambda _: False,
    "columns": lambda *parts: np.concatenate([_as_matrix(part) for part in parts], axis=1),
    "cross": _cross,
    "diagonal": lambda x: np.diag(np.asarray(x)),
    "div": _real_or_integer(lambda a, b: float(np.trunc(divide(a, b))), _quotient),
    "edge": lambda _: False,
    "fill": lambda value, *sizes: np.full(sizes, value),
    "homotopy": lambda actual, _: actual,
    "identity": lambda n: np.eye(n, dtype=np.int64),
    "integer": lambda x: elementwise(
        lambda y: _floor_to_int32(y) if isinstance(y, float) else y, x
    ),
    "linspace": lambda first, last, n: np.array(
        [first + (last - first) * k / (n - 1) for k in range(n)]
    ),
    "max": _maximum,
    "min": _minimum,
    "mod": _real_or_integer(lambda a, b: a - float(np.floor(divide(a, b))) * b, operator.mod),
    "ndims": np.ndim,
    "noEvent": lambda x: x,
    "ones": lambda *sizes: np.ones(sizes, np.int64),
    "pre": lambda x: x,
    "product": lambda x: reduce(lambda a, b: check_int32(a * b), _flat_elements((x,))),
    "rows": lambda *parts: np.concatenate([_as_matrix(part) for part in parts], axis=0),
    "scalar": lambda x: to_python_scalar(np.asarray(x).flat[0]),
    "rem": _real_or_integer(
        lambda a, b: a - float(np.trunc(divide(a, b))) * b, lambda a, b: a - b * _quotient(a, b)
    ),
    "sign": lambda x: elementwise(lambda y: (y > 0) - (y < 0), x),
    "size": _size,
    "smooth": lambda _, x: x,
    "sum": _sum,
    "transpose": np.transpose,
    "vector": np.ravel,
    "zeros": lambda *sizes: np.zeros(sizes, np.int64),
}
