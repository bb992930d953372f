"""The functions and operators of the language in C. Most are a call of a helper in runtime.h or of the C library."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Any

from ..model import flat_model
from ..model.flat_model import refuse
from .c_values import Text, Value, add_up, call, common, infix, mapped, number, prefix, scalar
from .subscripts import Subscripts

_LIBRARY = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "ceil", "floor")
#: names of the helpers for Real and for Integer
_TWO_NUMBERS = {
    "min": ("smaller", "smaller_integer"),
    "max": ("larger", "larger_integer"),
    "mod": ("real_modulo", "modulo"),
    "rem": ("real_remainder", "remainder_of"),
    "div": ("real_quotient", "divide"),
}
_FALLIBLE = ("modulo", "remainder_of", "divide")


def _library(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    return mapped(lowering.lower(node.arguments[0]), "Real", lambda x: call(node.name, x))


def _atan2(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    y, x = map(lowering.scalar_of, node.arguments)
    return scalar("Real", call("atan2", y, x))


def _helper(name: str, kind: str, a: Text, b: Text) -> Text:
    helper = _TWO_NUMBERS[name][kind != "Real"]
    return call(helper, "m", a, b) if helper in _FALLIBLE else call(helper, a, b)


def _two_numbers(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    """min and max of two scalars or of an array; div, mod and rem."""
    values = [lowering.lower(argument) for argument in node.arguments]
    kind = common([value.type for value in values])
    elements = [value.at(k) for value in values for k in range(value.size)]
    if (len(values) == 2 and any(value.shape for value in values)) or not elements:
        refuse(f"{node.name}() takes two scalars or one array", node.where)
    return scalar(kind, reduce(lambda a, b: _helper(node.name, kind, a, b), elements))


def _abs(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    value = lowering.lower(node.arguments[0])
    if value.type == "Real":
        return mapped(value, "Real", lambda x: call("fabs", x))
    return mapped(value, "Integer", lambda x: call("absolute", "m", x))


def _integer(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    """integer(x): the largest Integer not above x; Integer(e): the number of an enumeration literal."""
    value = lowering.lower(node.arguments[0])
    return mapped(value, "Integer", (lambda x: call("integer_of", "m", x)) if value.type == "Real" else (lambda x: x))


def _sum(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    value = lowering.lower(node.arguments[0])
    return scalar(value.type, add_up(value.type, [value.at(k) for k in range(value.size)]))


def _product(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    value = lowering.lower(node.arguments[0])
    multiply = (lambda a, b: infix("*", a, b)) if value.type == "Real" else (lambda a, b: call("multiply", "m", a, b))
    return scalar(value.type, reduce(multiply, [value.at(k) for k in range(value.size)], number(1, value.type)))


def _cross(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    a, b = (lowering.held(lowering.lower(argument)) for argument in node.arguments)
    if (a.shape, b.shape) != ((3,), (3,)):
        refuse("cross() takes two vectors of three elements", node.where)

    def element(k: int | str) -> Text:
        i, j = (int(k) + 1) % 3, (int(k) + 2) % 3
        return infix("-", infix("*", a.at(i), b.at(j)), infix("*", a.at(j), b.at(i)))

    return Value("Real", (3,), element, loops=False)


def _transpose(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    value = lowering.held(lowering.lower(node.arguments[0]))
    rows, columns = value.shape
    return Value(value.type, (columns, rows), lambda k: value.at(int(k) % rows * columns + int(k) // rows), loops=False)


def _fill(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    """fill(value, sizes), zeros(sizes), ones(sizes)."""
    sizes = node.arguments[1:] if node.name == "fill" else node.arguments
    value = lowering.held(lowering.lower(node.arguments[0])) if node.name == "fill" else None
    filled = value or scalar("Integer", number(int(node.name == "ones"), "Integer"))
    return Value(filled.type, _shape(lowering, node, sizes), lambda _: filled.text, simple=True)


def _identity(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    (n,) = _shape(lowering, node, node.arguments)
    return Value("Integer", (n, n), lambda k: number(int(int(k) % (n + 1) == 0), "Integer"), loops=False, simple=True)


def _shape(lowering: Subscripts, node: flat_model.Builtin, sizes: tuple[flat_model.Expression, ...]) -> tuple[int, ...]:
    numbers = [lowering.static_integer(size) for size in sizes]
    return tuple(n if n is not None else refuse(f"the sizes in {node.name}() must be constant", node.where) for n in numbers)


def _cat(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    parts = [lowering.lower(argument) for argument in node.arguments[1:]]
    if node.arguments[0] != flat_model.Literal(1, "Integer"):
        refuse("cat() is supported along the first dimension only", node.where)
    elements = [(part, k) for part in parts for k in range(part.size)]
    shape = (sum(part.shape[0] for part in parts), *parts[0].shape[1:])
    simple = all(part.simple for part in parts)
    return Value(
        common([p.type for p in parts]), shape, lambda k: elements[int(k)][0].at(elements[int(k)][1]), loops=False, simple=simple
    )


def _size(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    shape = lowering.lower(node.arguments[0]).shape
    if len(node.arguments) == 1:
        return Value("Integer", (len(shape),), lambda k: number(shape[int(k)], "Integer"), loops=False, simple=True)
    dimension = lowering.static_integer(node.arguments[1])
    if dimension is None or not 1 <= dimension <= len(shape):
        refuse("size() needs a constant dimension of the array", node.where)
    return scalar("Integer", number(shape[dimension - 1], "Integer"), simple=True)


def _ndims(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    return scalar("Integer", number(len(lowering.lower(node.arguments[0]).shape), "Integer"), simple=True)


def _first(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    """noEvent(x) and homotopy(actual, simplified): nothing here makes events or iterates."""
    return lowering.lower(node.arguments[0])


def _smooth(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    return lowering.lower(node.arguments[1])


def _sign(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    return mapped(lowering.lower(node.arguments[0]), "Integer", lambda x: call("sign", x))


def _pre(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    (argument,) = node.arguments
    if isinstance(argument, flat_model.Index):
        return lowering.select(_before(lowering, argument.base, node), argument)
    return _before(lowering, argument, node)


def _before(lowering: Subscripts, name: flat_model.Expression, node: flat_model.Builtin) -> Value:
    if not isinstance(name, flat_model.Name) or name.name not in lowering.memory:
        refuse(f"{node.name}() takes a variable", node.where)
    return lowering.memory[name.name]


def _edge(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    now = lowering.scalar_of(node.arguments[0])
    return scalar("Boolean", infix("&&", now, prefix("!", _pre(lowering, node).text)))


def _change(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    now = lowering.scalar_of(node.arguments[0])
    return scalar("Boolean", infix("!=", now, _pre(lowering, node).text))


def _flag(lowering: Subscripts, node: flat_model.Builtin) -> Value:
    """due(k) and risen(k), the flags of when-clauses."""
    return scalar("Boolean", Text(f"{node.name}[{node.arguments[0].value}]"), simple=True)  # type: ignore[union-attr]


BUILTINS: dict[str, Callable[[Any, flat_model.Builtin], Value]] = {
    **dict.fromkeys(_LIBRARY, _library),
    **dict.fromkeys(_TWO_NUMBERS, _two_numbers),
    **dict.fromkeys(("fill", "zeros", "ones"), _fill),
    **dict.fromkeys(("noEvent", "homotopy"), _first),
    **dict.fromkeys(("due", "risen"), _flag),
    "abs": _abs,
    "atan2": _atan2,
    "cat": _cat,
    "change": _change,
    "cross": _cross,
    "edge": _edge,
    "identity": _identity,
    "integer": _integer,
    "ndims": _ndims,
    "pre": _pre,
    "product": _product,
    "sign": _sign,
    "size": _size,
    "smooth": _smooth,
    "sum": _sum,
    "transpose": _transpose,
}
