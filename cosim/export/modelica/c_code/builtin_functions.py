"""Lowering of Modelica's built-in functions to C, most of them to calls of runtime.h or of the C library."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import reduce

from ..model import syntax_tree
from ..model.syntax_tree import raise_model_error
from .c_values import (
    CExpression,
    CValue,
    c_call,
    c_literal,
    common_type,
    infix,
    map_elements,
    prefix,
    scalar_value,
    sum_terms,
)
from .lowering import SubscriptLowering

_TRIGONOMETRIC_FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
_MATH_FUNCTIONS = (*_TRIGONOMETRIC_FUNCTIONS, "exp", "log", "log10", "sqrt", "ceil", "floor")
#: functions of runtime.h for Real and for Integer operands
_TWO_OPERAND_HELPERS = {
    "min": ("smaller", "smaller_integer"),
    "max": ("larger", "larger_integer"),
    "mod": ("real_modulo", "modulo"),
    "rem": ("real_remainder", "remainder_of"),
    "div": ("real_quotient", "divide"),
}
#: functions of runtime.h that can fail and therefore take the model as first argument
_FALLIBLE = ("modulo", "remainder_of", "divide")


def _math_function(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    return map_elements(lowering.lower(node.arguments[0]), "Real", lambda x: c_call(node.name, x))


def _atan2(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    y, x = map(lowering.scalar_of, node.arguments)
    return scalar_value("Real", c_call("atan2", y, x))


def _call_helper(name: str, type_name: str, a: CExpression, b: CExpression) -> CExpression:
    helper = _TWO_OPERAND_HELPERS[name][type_name != "Real"]
    return c_call(helper, "m", a, b) if helper in _FALLIBLE else c_call(helper, a, b)


def _two_operand_function(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower min() and max() of two scalars or of an array, div(), mod() and rem()."""
    values = [lowering.lower(argument) for argument in node.arguments]
    type_name = common_type([value.type for value in values])
    elements = [value.element(k) for value in values for k in range(value.size)]
    if (len(values) == 2 and any(value.shape for value in values)) or not elements:
        raise_model_error(f"{node.name}() takes two scalars or one array", node.where)
    return scalar_value(
        type_name, reduce(lambda a, b: _call_helper(node.name, type_name, a, b), elements)
    )


def _abs(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    value = lowering.lower(node.arguments[0])
    if value.type == "Real":
        return map_elements(value, "Real", lambda x: c_call("fabs", x))
    return map_elements(value, "Integer", lambda x: c_call("absolute", "m", x))


def _integer(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower integer(x), the largest Integer not above x, and Integer(e), the number of an enumeration literal."""
    value = lowering.lower(node.arguments[0])
    return map_elements(
        value,
        "Integer",
        (lambda x: c_call("integer_of", "m", x)) if value.type == "Real" else (lambda x: x),
    )


def _sum(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    value = lowering.lower(node.arguments[0])
    return scalar_value(
        value.type, sum_terms(value.type, [value.element(k) for k in range(value.size)])
    )


def _product(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    value = lowering.lower(node.arguments[0])
    multiply = (
        (lambda a, b: infix("*", a, b))
        if value.type == "Real"
        else (lambda a, b: c_call("multiply", "m", a, b))
    )
    return scalar_value(
        value.type,
        reduce(multiply, [value.element(k) for k in range(value.size)], c_literal(1, value.type)),
    )


def _cross(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    a, b = (lowering.evaluated_once(lowering.lower(argument)) for argument in node.arguments)
    if (a.shape, b.shape) != ((3,), (3,)):
        raise_model_error("cross() takes two vectors of three elements", node.where)

    def element(k: int | str) -> CExpression:
        i, j = (int(k) + 1) % 3, (int(k) + 2) % 3
        return infix(
            "-", infix("*", a.element(i), b.element(j)), infix("*", a.element(j), b.element(i))
        )

    return CValue("Real", (3,), element, indexable_in_loop=False)


def _transpose(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    value = lowering.evaluated_once(lowering.lower(node.arguments[0]))
    rows, columns = value.shape
    return CValue(
        value.type,
        (columns, rows),
        lambda k: value.element(int(k) % rows * columns + int(k) // rows),
        indexable_in_loop=False,
    )


def _fill(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower fill(value, sizes), zeros(sizes) and ones(sizes)."""
    sizes = node.arguments[1:] if node.name == "fill" else node.arguments
    value = (
        lowering.evaluated_once(lowering.lower(node.arguments[0])) if node.name == "fill" else None
    )
    element = value or scalar_value("Integer", c_literal(int(node.name == "ones"), "Integer"))
    return CValue(
        element.type, _shape(lowering, node, sizes), lambda _: element.text, reusable=True
    )


def _matrix(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower a concatenation: rows(a, b) of the parts of `[a; b]`, columns(a, b) of `[a, b]`.

    Scalars and vectors are columns.
    """
    parts = [lowering.lower(argument) for argument in node.arguments]
    shapes = [(*part.shape, 1, 1)[:2] if len(part.shape) < 2 else part.shape for part in parts]
    vertical = node.name == "rows"
    if len({shape[vertical] for shape in shapes}) != 1:
        raise_model_error(
            f"the parts of a matrix have the sizes {', '.join(str(list(s)) for s in shapes)}",
            node.where,
        )
    shape = (
        (sum(s[0] for s in shapes), shapes[0][1])
        if vertical
        else (shapes[0][0], sum(s[1] for s in shapes))
    )
    elements = [
        (part, row * size[1] + column)
        for row_parts in (
            [[pair] for pair in zip(parts, shapes, strict=True)]
            if vertical
            else [list(zip(parts, shapes, strict=True))]
        )
        for row in range(row_parts[0][1][0])
        for part, size in row_parts
        for column in range(size[1])
    ]
    return CValue(
        common_type([part.type for part in parts]),
        shape,
        lambda k: elements[int(k)][0].element(elements[int(k)][1]),
        indexable_in_loop=False,
        reusable=all(part.reusable for part in parts),
    )


def _vector(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    value = lowering.lower(node.arguments[0])
    return replace(value, shape=(value.size,))


def _scalar(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    return replace(lowering.lower(node.arguments[0]), shape=())


def _diagonal(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    value = lowering.evaluated_once(lowering.lower(node.arguments[0]))
    n, zero = value.size, c_literal(0, value.type)
    return CValue(
        value.type,
        (n, n),
        lambda k: value.element(int(k) // n) if int(k) % (n + 1) == 0 else zero,
        indexable_in_loop=False,
    )


def _linspace(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    first, last = (
        lowering.evaluated_once(lowering.lower(argument)).text for argument in node.arguments[:2]
    )
    (n,) = _shape(lowering, node, node.arguments[2:])

    def element(k: int | str) -> CExpression:
        step = infix("*", infix("-", last, first), c_literal(float(k), "Real"))
        return infix("+", first, infix("/", step, c_literal(float(n - 1), "Real")))

    return CValue("Real", (n,), element, indexable_in_loop=False)


def _past(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower past(k, T), the value of the argument of delay() number k at the time - T."""
    index, duration = (
        lowering.static_integer(node.arguments[0]),
        lowering.scalar_of(node.arguments[1]),
    )
    at = infix("-", CExpression("time"), duration)
    return scalar_value("Real", c_call("past_value", f"&m->past[{index}]", at))


def _identity(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    (n,) = _shape(lowering, node, node.arguments)
    return CValue(
        "Integer",
        (n, n),
        lambda k: c_literal(int(int(k) % (n + 1) == 0), "Integer"),
        indexable_in_loop=False,
        reusable=True,
    )


def _shape(
    lowering: SubscriptLowering,
    node: syntax_tree.Builtin,
    sizes: tuple[syntax_tree.Expression, ...],
) -> tuple[int, ...]:
    numbers = [lowering.static_integer(size) for size in sizes]
    return tuple(
        n
        if n is not None
        else raise_model_error(f"the sizes in {node.name}() must be constant", node.where)
        for n in numbers
    )


def _cat(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    parts = [lowering.lower(argument) for argument in node.arguments[1:]]
    if node.arguments[0] != syntax_tree.Literal(1, "Integer"):
        raise_model_error("cat() is supported along the first dimension only", node.where)
    elements = [(part, k) for part in parts for k in range(part.size)]
    shape = (sum(part.shape[0] for part in parts), *parts[0].shape[1:])
    reusable = all(part.reusable for part in parts)
    return CValue(
        common_type([p.type for p in parts]),
        shape,
        lambda k: elements[int(k)][0].element(elements[int(k)][1]),
        indexable_in_loop=False,
        reusable=reusable,
    )


def _size(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    shape = lowering.lower(node.arguments[0]).shape
    if len(node.arguments) == 1:
        return CValue(
            "Integer",
            (len(shape),),
            lambda k: c_literal(shape[int(k)], "Integer"),
            indexable_in_loop=False,
            reusable=True,
        )
    dimension = lowering.static_integer(node.arguments[1])
    if dimension is None or not 1 <= dimension <= len(shape):
        raise_model_error("size() needs a constant dimension of the array", node.where)
    return scalar_value("Integer", c_literal(shape[dimension - 1], "Integer"), reusable=True)


def _ndims(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    return scalar_value(
        "Integer", c_literal(len(lowering.lower(node.arguments[0]).shape), "Integer"), reusable=True
    )


def _first_argument(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower noEvent(x) and homotopy(actual, simplified) to their first argument.

    There are no state events or iterations.
    """
    return lowering.lower(node.arguments[0])


def _smooth(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    return lowering.lower(node.arguments[1])


def _sign(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    return map_elements(lowering.lower(node.arguments[0]), "Integer", lambda x: c_call("sign", x))


def _pre(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    (argument,) = node.arguments
    if isinstance(argument, syntax_tree.Index):
        return lowering.select_elements(_pre_value(lowering, argument.base, node), argument)
    return _pre_value(lowering, argument, node)


def _pre_value(
    lowering: SubscriptLowering, name: syntax_tree.Expression, node: syntax_tree.Builtin
) -> CValue:
    if not isinstance(name, syntax_tree.Name) or name.name not in lowering.pre_scope:
        raise_model_error(f"{node.name}() takes a variable", node.where)
    return lowering.pre_scope[name.name]


def _edge(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    current = lowering.scalar_of(node.arguments[0])
    return scalar_value("Boolean", infix("&&", current, prefix("!", _pre(lowering, node).text)))


def _change(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    current = lowering.scalar_of(node.arguments[0])
    return scalar_value("Boolean", infix("!=", current, _pre(lowering, node).text))


def _event_flag(lowering: SubscriptLowering, node: syntax_tree.Builtin) -> CValue:
    """Lower the event flags due(k) and risen(k)."""
    index = lowering.static_integer(node.arguments[0])
    return scalar_value("Boolean", CExpression(f"{node.name}[{index}]"), reusable=True)


BUILTINS: dict[str, Callable[[SubscriptLowering, syntax_tree.Builtin], CValue]] = {
    **dict.fromkeys(_MATH_FUNCTIONS, _math_function),
    **dict.fromkeys(_TWO_OPERAND_HELPERS, _two_operand_function),
    **dict.fromkeys(("fill", "zeros", "ones"), _fill),
    **dict.fromkeys(("noEvent", "homotopy"), _first_argument),
    **dict.fromkeys(("due", "risen"), _event_flag),
    **dict.fromkeys(("rows", "columns"), _matrix),
    "abs": _abs,
    "atan2": _atan2,
    "cat": _cat,
    "diagonal": _diagonal,
    "linspace": _linspace,
    "past": _past,
    "scalar": _scalar,
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
    "vector": _vector,
}
