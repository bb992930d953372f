"""Modelica expressions in C.

An expression may need statements in front of it (the result of an array function, for example): they go to `self.out`.
Statements of a branch that is not always evaluated stay inside that branch.
"""

from __future__ import annotations

from collections.abc import Callable

from ..model import flat_model
from ..model.flat_model import Place, refuse
from .builtins import BUILTINS
from .c_values import Text, Value, add_up, call, choose, common, infix, mapped, number, offset, prefix, scalar, stored
from .subscripts import Subscripts

_ARITHMETIC = {"+": "add", "-": "subtract", "*": "multiply"}
_COMPARISONS = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "==": "==", "<>": "!="}


class Expressions(Subscripts):
    """Lowers expressions."""

    def _literal(self, node: flat_model.Literal) -> Value:
        if node.type == "String":
            refuse("texts can only stand in assert()", None)
        if node.type == "Integer" and not -(2**31) <= node.value < 2**31:  # type: ignore[operator]
            refuse(f"the Integer {node.value} does not fit into 32 bits; write a Real", None)
        return scalar(node.type, number(node.value, node.type), simple=True)  # type: ignore[arg-type]

    def _name(self, node: flat_model.Name) -> Value:
        if node.name not in self.scope:
            refuse(f"unknown name {node.name}", node.where)
        return self.scope[node.name]

    def _array(self, node: flat_model.Array) -> Value:
        parts = [self.lower(element) for element in node.elements]
        if len({part.shape for part in parts}) != 1:
            refuse("an array with rows of different shapes", None)
        kind, inner = common([part.type for part in parts]), parts[0].size
        simple = all(part.simple for part in parts)
        return Value(
            kind, (len(parts), *parts[0].shape), lambda k: parts[int(k) // inner].at(int(k) % inner), loops=False, simple=simple
        )

    def _range(self, node: flat_model.Range) -> Value:
        numbers = self.static_range(node)
        return Value("Integer", (len(numbers),), lambda k: number(numbers[int(k)], "Integer"), loops=False, simple=True)

    # operators

    def _unary(self, node: flat_model.Unary) -> Value:
        operand = self.lower(node.operand)
        if node.operator == "not":
            return mapped(operand, "Boolean", lambda text: prefix("!", text))
        if isinstance(node.operand, flat_model.Literal):
            return scalar(operand.type, number(-node.operand.value, operand.type), simple=True)  # type: ignore[operator]
        if operand.type == "Integer":
            return mapped(operand, "Integer", lambda text: call("subtract", "m", "0", text))
        return mapped(operand, "Real", lambda text: prefix("-", text))

    def _binary(self, node: flat_model.Binary) -> Value:
        operator = node.operator
        if operator in ("and", "or"):
            return self._logical(node)
        left, right = self.lower(node.left), self.lower(node.right)
        if operator == "*" and left.shape and right.shape:
            return self._matrix_product(left, right, node.where)
        if operator in _COMPARISONS:
            return self._zip(left, right, "Boolean", lambda a, b: infix(_COMPARISONS[operator], a, b), node.where)
        operator = operator.removeprefix(".")
        kind = "Real" if operator in ("/", "^") else common([left.type, right.type])
        return self._zip(left, right, kind, self._arithmetic(operator, kind, left, node), node.where)

    def _arithmetic(self, operator: str, kind: str, left: Value, node: flat_model.Binary) -> Callable[[Text, Text], Text]:
        if operator == "^":
            if node.right == flat_model.Literal(2, "Integer"):
                return lambda a, _: call("square", a)
            return lambda a, b: call("pow", a, b)
        if kind == "Integer":
            return lambda a, b: call(_ARITHMETIC[operator], "m", a, b)
        if operator == "/" and left.type == "Integer":
            return lambda a, b: infix("/", Text(a.code + ".0") if a.code.isdigit() else prefix("(double)", a), b)
        return lambda a, b: infix(operator, a, b)

    def _logical(self, node: flat_model.Binary) -> Value:
        left = self.scalar_of(node.left)
        with self.block() as lines:
            right = self.scalar_of(node.right)
        if not lines:
            return scalar("Boolean", infix("&&" if node.operator == "and" else "||", left, right))
        result = self.temporary("Boolean", ())
        self.out += [f"{result.text.code} = {left.code};"]
        self.out += [f"if ({'' if node.operator == 'and' else '!'}{result.text.code}) {{", *lines]
        self.out += [f"    {result.text.code} = {right.code};", "}"]
        return result

    def _zip(self, left: Value, right: Value, kind: str, combine: Callable[[Text, Text], Text], where: Place | None) -> Value:
        if left.shape and right.shape and left.shape != right.shape:
            refuse(f"arrays of different sizes {list(left.shape)} and {list(right.shape)}", where)
        if bool(left.shape) != bool(right.shape):
            left, right = (self.held(left), right) if right.shape else (left, self.held(right))
        return Value(
            kind, left.shape or right.shape, lambda k: combine(left.at(k), right.at(k)), loops=left.loops and right.loops
        )

    def _matrix_product(self, left: Value, right: Value, where: Place | None) -> Value:
        inner = left.shape[-1]
        if inner != right.shape[0]:
            refuse(f"product of arrays of sizes {list(left.shape)} and {list(right.shape)}", where)
        left, right = self.held(left), self.held(right)
        columns = right.size // inner
        kind = common([left.type, right.type])

        def element(k: int | str) -> Text:
            row, column = (k, 0) if columns == 1 else divmod(int(k), columns)
            pairs = ((left.at(offset([(inner, row), (1, j)])), right.at(columns * j + column)) for j in range(inner))
            return add_up(kind, [infix("*", a, b) if kind == "Real" else call("multiply", "m", a, b) for a, b in pairs])

        return Value(kind, (*left.shape[:-1], *right.shape[1:]), element, loops=columns == 1 and left.loops)

    def _if(self, node: flat_model.If) -> Value:
        (condition, yes), rest = node.branches[0], node.branches[1:]
        test = self.scalar_of(condition)
        with self.block() as yes_lines:
            first = self.lower(yes)
        with self.block() as no_lines:
            second = self.lower(flat_model.If(rest, node.otherwise) if rest else node.otherwise)
        kind = common([first.type, second.type])
        if not (yes_lines or no_lines or first.shape):
            return scalar(kind, choose(test, first.text, second.text))
        result = self.temporary(kind, first.shape)
        for opening, lines, value in ((f"if ({test.code}) {{", yes_lines, first), ("} else {", no_lines, second)):
            with self.block() as copying:
                self.copy(result, value)
            self.out += [opening, *lines, *copying]
        self.out.append("}")
        return result

    # functions

    def _builtin(self, node: flat_model.Builtin) -> Value:
        if node.name not in BUILTINS:
            refuse(f"{node.name}() is not supported here", node.where)
        return BUILTINS[node.name](self, node)

    def _call(self, node: flat_model.Call) -> Value:
        return self.invoke(node)[0]

    def invoke(self, node: flat_model.Call, target: str | None = None) -> tuple[Value, ...]:
        """Calls a function; its array results go to temporaries, or the first one to the C array `target`."""
        arguments = [self.lower(argument) for argument in node.arguments]
        function = self.unit.function(node, tuple(argument.shape for argument in arguments))
        passed = ["m"] * function.takes_model
        for argument, wanted in zip(arguments, function.inputs, strict=True):
            passed.append(self.array(argument, wanted.type) if argument.shape else argument.text.code)
        if function.returns:
            return (scalar(function.outputs[0].type, call(function.name, *passed)),)
        results = tuple(stored(o.type, o.shape, target) if target else self.temporary(o.type, o.shape) for o in function.outputs)
        passed += [result.pointer or "&" + result.text.code for result in results]
        self.out.append(call(function.name, *passed).code + ";")
        return results
