"""Lowering of Modelica expressions to C.

An expression may require statements in front of it, for example the call of a function with an
array result. They are appended to `Lowering.lines`; those of a branch that is not always evaluated
remain inside this branch.
"""

from __future__ import annotations

import json
from collections.abc import Callable

from ..model.syntax_tree import (
    Array,
    Binary,
    Call,
    Comprehension,
    Expression,
    If,
    Literal,
    Name,
    Range,
    SourceLocation,
    Unary,
    raise_model_error,
)
from ..model.traversal import unroll
from .builtin_lowering import BuiltinLowering
from .c_values import (
    CExpression,
    CValue,
    c_call,
    c_literal,
    common_type,
    conditional,
    infix,
    linear_index,
    map_elements,
    prefix,
    scalar_value,
    sum_terms,
    variable_value,
)

_ARITHMETIC = {"+": "add", "-": "subtract", "*": "multiply"}
_COMPARISONS = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "==": "==", "<>": "!="}


class ExpressionLowering(BuiltinLowering):
    """Lowering of expressions."""

    def _literal(self, node: Literal) -> CValue:
        if node.type == "String":
            return scalar_value(
                "String", CExpression(json.dumps(node.value, ensure_ascii=False)), reusable=True
            )
        if node.type == "Integer" and not -(2**31) <= node.number < 2**31:
            raise_model_error(
                f"the Integer {node.value} does not fit into 32 bits; use a Real", None
            )
        return scalar_value(node.type, c_literal(node.number, node.type), reusable=True)

    def _name(self, node: Name) -> CValue:
        if node.name not in self.scope:
            raise_model_error(f"unknown name {node.name}", node.where)
        return self.scope[node.name]

    def _comprehension(self, node: Comprehension) -> CValue:
        if not isinstance(node.range, Range):
            raise_model_error("an iterator needs a range such as 1:n", node.where)
        return self.lower(
            unroll(node, [Literal(k, "Integer") for k in self.static_range(node.range)])
        )

    def _array(self, node: Array) -> CValue:
        parts = [self.lower(element) for element in node.elements]
        if len({part.shape for part in parts}) != 1:
            raise_model_error("the elements of an array constructor have different shapes", None)
        type_name, inner = common_type([part.type for part in parts]), parts[0].size
        reusable = all(part.reusable for part in parts)
        return CValue(
            type_name,
            (len(parts), *parts[0].shape),
            lambda k: parts[int(k) // inner].element(int(k) % inner),
            indexable_in_loop=False,
            reusable=reusable,
        )

    def _range(self, node: Range) -> CValue:
        numbers = self.static_range(node)
        return CValue(
            "Integer",
            (len(numbers),),
            lambda k: c_literal(numbers[int(k)], "Integer"),
            indexable_in_loop=False,
            reusable=True,
        )

    # operators

    def _unary(self, node: Unary) -> CValue:
        operand = self.lower(node.operand)
        if node.operator == "not":
            return map_elements(operand, "Boolean", lambda text: prefix("!", text))
        if isinstance(node.operand, Literal):
            return scalar_value(
                operand.type, c_literal(-node.operand.number, operand.type), reusable=True
            )
        if operand.type == "Integer":
            return map_elements(operand, "Integer", lambda text: c_call("subtract", "m", "0", text))
        return map_elements(operand, "Real", lambda text: prefix("-", text))

    def _binary(self, node: Binary) -> CValue:
        operator = node.operator
        if operator in ("and", "or"):
            return self._logical(node)
        left, right = self.lower(node.left), self.lower(node.right)
        if operator == "*" and left.shape and right.shape:
            return self._matrix_product(left, right, node.where)
        if "String" in (left.type, right.type):
            raise_model_error(
                f"the operator {operator} is not supported for Strings that are not parameters",
                node.where,
            )
        if operator in _COMPARISONS:
            return self._lower_elementwise(
                left, right, "Boolean", lambda a, b: infix(_COMPARISONS[operator], a, b), node.where
            )
        operator = operator.removeprefix(".")
        type_name = "Real" if operator in ("/", "^") else common_type([left.type, right.type])
        return self._lower_elementwise(
            left, right, type_name, self._arithmetic(operator, type_name, left, node), node.where
        )

    def _arithmetic(
        self, operator: str, type_name: str, left: CValue, node: Binary
    ) -> Callable[[CExpression, CExpression], CExpression]:
        if operator == "^":
            if node.right == Literal(2, "Integer"):
                return lambda a, _: c_call("square", a)
            return lambda a, b: c_call("pow", a, b)
        if type_name == "Integer":
            return lambda a, b: c_call(_ARITHMETIC[operator], "m", a, b)
        if operator == "/" and left.type == "Integer":
            return lambda a, b: infix(
                "/", CExpression(a.code + ".0") if a.code.isdigit() else prefix("(double)", a), b
            )
        return lambda a, b: infix(operator, a, b)

    def _logical(self, node: Binary) -> CValue:
        left = self.scalar_of(node.left)
        with self.collect_lines() as lines:
            right = self.scalar_of(node.right)
        if not lines:
            return scalar_value(
                "Boolean", infix("&&" if node.operator == "and" else "||", left, right)
            )
        result = self.new_temporary("Boolean", ())
        self.lines += [f"{result.text.code} = {left.code};"]
        self.lines += [f"if ({'' if node.operator == 'and' else '!'}{result.text.code}) {{", *lines]
        self.lines += [f"    {result.text.code} = {right.code};", "}"]
        return result

    def _lower_elementwise(
        self,
        left: CValue,
        right: CValue,
        type_name: str,
        combine: Callable[[CExpression, CExpression], CExpression],
        where: SourceLocation | None,
    ) -> CValue:
        if left.shape and right.shape and left.shape != right.shape:
            raise_model_error(
                f"the operands are arrays of different sizes: {list(left.shape)} and "
                f"{list(right.shape)}",
                where,
            )
        if bool(left.shape) != bool(right.shape):
            left, right = (
                (self.evaluated_once(left), right)
                if right.shape
                else (left, self.evaluated_once(right))
            )
        return CValue(
            type_name,
            left.shape or right.shape,
            lambda k: combine(left.element(k), right.element(k)),
            indexable_in_loop=left.indexable_in_loop and right.indexable_in_loop,
        )

    def _matrix_product(self, left: CValue, right: CValue, where: SourceLocation | None) -> CValue:
        inner = left.shape[-1]
        if inner != right.shape[0]:
            raise_model_error(
                f"arrays of the sizes {list(left.shape)} and {list(right.shape)} cannot be "
                "multiplied",
                where,
            )
        left, right = self.evaluated_once(left), self.evaluated_once(right)
        columns = right.size // inner
        type_name = common_type([left.type, right.type])

        def element(k: int | str) -> CExpression:
            row, column = (k, 0) if columns == 1 else divmod(int(k), columns)
            pairs = (
                (
                    left.element(linear_index([(inner, row), (1, j)])),
                    right.element(columns * j + column),
                )
                for j in range(inner)
            )
            return sum_terms(
                type_name,
                [
                    infix("*", a, b) if type_name == "Real" else c_call("multiply", "m", a, b)
                    for a, b in pairs
                ],
            )

        return CValue(
            type_name,
            (*left.shape[:-1], *right.shape[1:]),
            element,
            indexable_in_loop=columns == 1 and left.indexable_in_loop,
        )

    def known_branch(self, node: If) -> Expression | None:
        """Return an if-expression without its first condition if that is constant, else None.

        It is the value of the first branch, or the expression without this branch.
        """
        condition, value = node.branches[0]
        known = self.static_value(condition)
        if known is None:
            return None
        return value if known else _without_first_branch(node)

    def _if(self, node: If) -> CValue:
        if (known := self.known_branch(node)) is not None:
            return self.lower(known)
        condition, yes = node.branches[0]
        test = self.scalar_of(condition)
        with self.collect_lines() as yes_lines:
            first = self.lower(yes)
        with self.collect_lines() as no_lines:
            second = self.lower(_without_first_branch(node))
        type_name = common_type([first.type, second.type])
        if not (yes_lines or no_lines or first.shape):
            return scalar_value(type_name, conditional(test, first.text, second.text))
        result = self.new_temporary(type_name, first.shape)
        for opening, lines, value in (
            (f"if ({test.code}) {{", yes_lines, first),
            ("} else {", no_lines, second),
        ):
            with self.collect_lines() as copying:
                self.copy_elements(result, value)
            self.lines += [opening, *lines, *copying]
        self.lines.append("}")
        return result

    # functions

    def _call(self, node: Call) -> CValue:
        return self.lower_call(node)[node.result]

    def lower_call(self, node: Call, target: str | None = None) -> tuple[CValue, ...]:
        """Lower a call of a function of the model.

        Args:
            node: The call.
            target: A C array for the only result. If None, new temporaries receive all results that
                are not returned.

        Returns:
            The results of the function.
        """
        arguments = [self.lower(argument) for argument in node.arguments]
        function = self.translation_unit.function_instance(
            node,
            tuple(argument.shape for argument in arguments),
            tuple(map(self.static_integer, node.arguments)),
        )
        c_arguments = ["m"] * function.takes_model
        for argument, parameter in zip(arguments, function.inputs, strict=True):
            c_arguments.append(
                self.as_c_array(argument, parameter.type) if argument.shape else argument.text.code
            )
        if function.returns_scalar:
            return (scalar_value(function.outputs[0].type, c_call(function.name, *c_arguments)),)
        results = tuple(
            variable_value(o.type, o.shape, target)
            if target
            else self.new_temporary(o.type, o.shape)
            for o in function.outputs
        )
        c_arguments += [result.pointer or "&" + result.text.code for result in results]
        self.lines.append(c_call(function.name, *c_arguments).code + ";")
        return results


def _without_first_branch(node: If) -> Expression:
    rest = node.branches[1:]
    return If(rest, node.otherwise) if rest else node.otherwise
