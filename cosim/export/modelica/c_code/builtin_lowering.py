"""Lowering of Modelica's built-in functions to C."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce

from ..model.builtin_functions import BUILTIN_FUNCTIONS
from ..model.syntax_tree import Builtin, Expression, Index, Literal, Name, raise_model_error
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
from .lowering import Lowering

#: functions of runtime.h that can fail and therefore take the model as first argument
_FALLIBLE = ("modulo", "remainder_of", "divide")


class BuiltinLowering(Lowering):
    """Lowering of built-in functions; the table of functions names the method for each."""

    def _builtin(self, node: Builtin) -> CValue:
        function = BUILTIN_FUNCTIONS.get(node.name)
        if function is None or not function.lowering:
            raise_model_error(f"{node.name}() is not supported here", node.where)
        lower: Callable[[Builtin], CValue] = getattr(self, f"_lower_{function.lowering}")
        return lower(node)

    def _lower_math(self, node: Builtin) -> CValue:
        (name,) = BUILTIN_FUNCTIONS[node.name].c_functions
        return map_elements(self.lower(node.arguments[0]), "Real", lambda x: c_call(name, x))

    def _lower_atan2(self, node: Builtin) -> CValue:
        y, x = map(self.scalar_of, node.arguments)
        return scalar_value("Real", c_call("atan2", y, x))

    def _lower_two_operands(self, node: Builtin) -> CValue:
        """Lower min() and max() of two scalars or of an array, div(), mod() and rem()."""
        values = [self.lower(argument) for argument in node.arguments]
        type_name = common_type([value.type for value in values])
        elements = [value.element(k) for value, k in _elements(values)]
        if (len(values) == 2 and any(value.shape for value in values)) or not elements:
            raise_model_error(f"{node.name}() takes two scalars or one array", node.where)
        helper = BUILTIN_FUNCTIONS[node.name].c_functions[type_name != "Real"]
        model = ["m"] * (helper in _FALLIBLE)
        return scalar_value(type_name, reduce(lambda a, b: c_call(helper, *model, a, b), elements))

    def _lower_abs(self, node: Builtin) -> CValue:
        value = self.lower(node.arguments[0])
        if value.type == "Real":
            return map_elements(value, "Real", lambda x: c_call("fabs", x))
        return map_elements(value, "Integer", lambda x: c_call("absolute", "m", x))

    def _lower_integer(self, node: Builtin) -> CValue:
        """Lower integer(x) of a Real x, and Integer(e), the number of an enumeration literal."""
        value = self.lower(node.arguments[0])
        return map_elements(
            value,
            "Integer",
            (lambda x: c_call("integer_of", "m", x)) if value.type == "Real" else (lambda x: x),
        )

    def _lower_sum(self, node: Builtin) -> CValue:
        value = self.lower(node.arguments[0])
        return scalar_value(
            value.type, sum_terms(value.type, [value.element(k) for k in range(value.size)])
        )

    def _lower_product(self, node: Builtin) -> CValue:
        value = self.lower(node.arguments[0])
        multiply = (
            (lambda a, b: infix("*", a, b))
            if value.type == "Real"
            else (lambda a, b: c_call("multiply", "m", a, b))
        )
        return scalar_value(
            value.type,
            reduce(
                multiply, [value.element(k) for k in range(value.size)], c_literal(1, value.type)
            ),
        )

    def _lower_cross(self, node: Builtin) -> CValue:
        a, b = (self.evaluated_once(self.lower(argument)) for argument in node.arguments)
        if (a.shape, b.shape) != ((3,), (3,)):
            raise_model_error("cross() takes two vectors of three elements", node.where)

        def element(k: int | str) -> CExpression:
            i, j = (int(k) + 1) % 3, (int(k) + 2) % 3
            return infix(
                "-", infix("*", a.element(i), b.element(j)), infix("*", a.element(j), b.element(i))
            )

        return CValue("Real", (3,), element, indexable_in_loop=False)

    def _lower_transpose(self, node: Builtin) -> CValue:
        value = self.evaluated_once(self.lower(node.arguments[0]))
        rows, columns = value.shape
        return CValue(
            value.type,
            (columns, rows),
            lambda k: value.element(int(k) % rows * columns + int(k) // rows),
            indexable_in_loop=False,
        )

    def _lower_fill(self, node: Builtin) -> CValue:
        """Lower fill(value, sizes), zeros(sizes) and ones(sizes)."""
        sizes = node.arguments[1:] if node.name == "fill" else node.arguments
        value = self.evaluated_once(self.lower(node.arguments[0])) if node.name == "fill" else None
        element = value or scalar_value("Integer", c_literal(int(node.name == "ones"), "Integer"))
        return CValue(element.type, self._shape(node, sizes), lambda _: element.text, reusable=True)

    def _lower_matrix(self, node: Builtin) -> CValue:
        """Lower a concatenation: rows(a, b) of the parts of `[a; b]`, columns(a, b) of `[a, b]`.

        Scalars and vectors are columns.
        """
        parts = [self.lower(argument) for argument in node.arguments]
        shapes = [(*part.shape, 1, 1)[:2] if len(part.shape) < 2 else part.shape for part in parts]
        vertical = node.name == "rows"
        if len({shape[vertical] for shape in shapes}) != 1:
            raise_model_error(
                f"the parts of a matrix have the sizes {', '.join(str(list(s)) for s in shapes)}",
                node.where,
            )
        elements = []
        if vertical:
            shape = (sum(rows for rows, _ in shapes), shapes[0][1])
            elements = _elements(parts)
        else:
            shape = (shapes[0][0], sum(columns for _, columns in shapes))
            for row in range(shape[0]):
                for part, (_, columns) in zip(parts, shapes, strict=True):
                    elements += [(part, row * columns + column) for column in range(columns)]
        return _joined(parts, shape, elements)

    def _lower_vector(self, node: Builtin) -> CValue:
        value = self.lower(node.arguments[0])
        return replace(value, shape=(value.size,))

    def _lower_scalar(self, node: Builtin) -> CValue:
        return replace(self.lower(node.arguments[0]), shape=())

    def _lower_diagonal(self, node: Builtin) -> CValue:
        value = self.evaluated_once(self.lower(node.arguments[0]))
        n, zero = value.size, c_literal(0, value.type)
        return CValue(
            value.type,
            (n, n),
            lambda k: value.element(int(k) // n) if int(k) % (n + 1) == 0 else zero,
            indexable_in_loop=False,
        )

    def _lower_linspace(self, node: Builtin) -> CValue:
        first, last = (
            self.evaluated_once(self.lower(argument)).text for argument in node.arguments[:2]
        )
        (n,) = self._shape(node, node.arguments[2:])

        def element(k: int | str) -> CExpression:
            step = infix("*", infix("-", last, first), c_literal(float(k), "Real"))
            return infix("+", first, infix("/", step, c_literal(float(n - 1), "Real")))

        return CValue("Real", (n,), element, indexable_in_loop=False)

    def _lower_past(self, node: Builtin) -> CValue:
        """Lower past(k, T), the value of the argument of delay() number k at the time - T."""
        index, duration = (
            self.static_integer(node.arguments[0]),
            self.scalar_of(node.arguments[1]),
        )
        at = infix("-", CExpression("time"), duration)
        return scalar_value("Real", c_call("past_value", f"&m->past[{index}]", at))

    def _lower_identity(self, node: Builtin) -> CValue:
        (n,) = self._shape(node, node.arguments)
        return CValue(
            "Integer",
            (n, n),
            lambda k: c_literal(int(int(k) % (n + 1) == 0), "Integer"),
            indexable_in_loop=False,
            reusable=True,
        )

    def _shape(
        self,
        node: Builtin,
        sizes: tuple[Expression, ...],
    ) -> tuple[int, ...]:
        numbers = []
        for size in sizes:
            number = self.static_integer(size)
            if number is None:
                raise_model_error(f"the sizes in {node.name}() must be constant", node.where)
            numbers.append(number)
        return tuple(numbers)

    def _lower_concatenation(self, node: Builtin) -> CValue:
        parts = [self.lower(argument) for argument in node.arguments[1:]]
        if node.arguments[0] != Literal(1, "Integer"):
            raise_model_error("cat() is supported along the first dimension only", node.where)
        shape = (sum(part.shape[0] for part in parts), *parts[0].shape[1:])
        return _joined(parts, shape, _elements(parts))

    def _lower_size(self, node: Builtin) -> CValue:
        shape = self.lower(node.arguments[0]).shape
        if len(node.arguments) == 1:
            return CValue(
                "Integer",
                (len(shape),),
                lambda k: c_literal(shape[int(k)], "Integer"),
                indexable_in_loop=False,
                reusable=True,
            )
        dimension = self.static_integer(node.arguments[1])
        if dimension is None or not 1 <= dimension <= len(shape):
            raise_model_error("size() needs a constant dimension of the array", node.where)
        return scalar_value("Integer", c_literal(shape[dimension - 1], "Integer"), reusable=True)

    def _lower_ndims(self, node: Builtin) -> CValue:
        return scalar_value(
            "Integer", c_literal(len(self.lower(node.arguments[0]).shape), "Integer"), reusable=True
        )

    def _lower_first_argument(self, node: Builtin) -> CValue:
        """Lower noEvent(x) and homotopy(actual, simplified) to their first argument.

        There are no state events or iterations.
        """
        return self.lower(node.arguments[0])

    def _lower_smooth(self, node: Builtin) -> CValue:
        return self.lower(node.arguments[1])

    def _lower_sign(self, node: Builtin) -> CValue:
        return map_elements(self.lower(node.arguments[0]), "Integer", lambda x: c_call("sign", x))

    def _lower_pre(self, node: Builtin) -> CValue:
        (argument,) = node.arguments
        if isinstance(argument, Index):
            return self.select_elements(self._pre_value(argument.base, node), argument)
        return self._pre_value(argument, node)

    def _pre_value(self, name: Expression, node: Builtin) -> CValue:
        if not isinstance(name, Name) or name.name not in self.pre_scope:
            raise_model_error(f"{node.name}() takes a variable", node.where)
        return self.pre_scope[name.name]

    def _lower_edge(self, node: Builtin) -> CValue:
        current = self.scalar_of(node.arguments[0])
        return scalar_value(
            "Boolean", infix("&&", current, prefix("!", self._lower_pre(node).text))
        )

    def _lower_change(self, node: Builtin) -> CValue:
        current = self.scalar_of(node.arguments[0])
        return scalar_value("Boolean", infix("!=", current, self._lower_pre(node).text))

    def _lower_event_flag(self, node: Builtin) -> CValue:
        """Lower the event flags due(k) and risen(k)."""
        index = self.static_integer(node.arguments[0])
        return scalar_value("Boolean", CExpression(f"{node.name}[{index}]"), reusable=True)


def _elements(parts: Sequence[CValue]) -> list[tuple[CValue, int]]:
    """Return all elements of some arrays, each as its array and its row-major index."""
    return [(part, k) for part in parts for k in range(part.size)]


def _joined(
    parts: Sequence[CValue], shape: tuple[int, ...], elements: Sequence[tuple[CValue, int]]
) -> CValue:
    """Return the array of some elements of its parts."""

    def element(k: int | str) -> CExpression:
        part, index = elements[int(k)]
        return part.element(index)

    return CValue(
        common_type([part.type for part in parts]),
        shape,
        element,
        indexable_in_loop=False,
        reusable=all(part.reusable for part in parts),
    )
