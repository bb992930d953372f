"""Arithmetic with the same results as the generated C code, bit for bit.

The order of operations is that of the C code, and `math` provides the functions of the C library.
Where Python would raise an exception, the result is that of IEEE 754 (NaN or infinity). Arrays are
NumPy arrays that are computed element by element.
"""

import math
import operator
from collections.abc import Callable, Mapping
from functools import reduce
from itertools import product
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
    rows = zip(*(array.flat for array in arrays), strict=True)
    results = [function(*map(to_python_scalar, row)) for row in rows]
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
    sums = []
    for row, column in product(rows, columns.T):
        pairs = zip(map(to_python_scalar, row), map(to_python_scalar, column), strict=True)
        sums.append(sum_of([check_int32(a * b) for a, b in pairs]))
    return to_python_scalar(np.array(sums).reshape((*left.shape[:-1], *right.shape[1:]))[()])


def sum_of(values: Any) -> Any:
    """Return the sum of all elements from left to right, as in the C code."""
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


def with_ieee_results(
    function: Callable[..., float], at_pole: float = math.nan
) -> Callable[..., float]:
    """Wrap a function of `math` so that it returns the value of IEEE 754 for an error.

    It is NaN, infinity or the value at a pole.
    """

    def wrapped(*arguments: float) -> float:
        try:
            return function(*arguments)
        except OverflowError:
            return math.inf
        except ValueError:
            return at_pole if 0 in arguments else math.nan

    return wrapped


def floor_to_int32(x: float) -> int:
    """Return the largest Integer that is not greater than a number.

    Raises:
        EvaluationError: It does not fit into 32 bits.
    """
    if not math.isfinite(x) or math.floor(x) not in _INT32:
        raise EvaluationError("Integer overflow")
    return math.floor(x)


OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: check_int32(a + b),
    "-": lambda a, b: check_int32(a - b),
    "*": lambda a, b: check_int32(a * b),
    "/": divide,
    "^": lambda a, b: with_ieee_results(math.pow, math.inf)(a, b),
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "<>": operator.ne,
}
