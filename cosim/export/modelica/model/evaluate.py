"""Evaluation of the expressions and execution of the statements of a flat model in Python."""

from __future__ import annotations

import operator
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arithmetic import (
    OPERATORS,
    EvaluationError,
    check_int32,
    elementwise,
    matrix_product,
    to_python_scalar,
)
from .builtin_functions import BUILTIN_FUNCTIONS
from .flat_model import Function, FunctionVariable
from .syntax_tree import (
    Array,
    Assert,
    Assign,
    Binary,
    Body,
    Builtin,
    Call,
    Colon,
    Comprehension,
    Expression,
    ExternalCall,
    For,
    If,
    IfStatement,
    Index,
    Literal,
    MultiAssign,
    Name,
    Range,
    Unary,
    While,
    referenced_variable,
)

DTYPES = {"Real": np.float64, "Integer": np.int64, "Enumeration": np.int64, "Boolean": np.bool_}


def convert_to_type(value: Any, type_name: str, shape: tuple[int, ...]) -> Any:
    """Convert a value to a Modelica type and shape.

    Returns:
        A Python scalar for the shape (), else a new NumPy array.
    """
    if shape:
        return np.array(np.broadcast_to(np.asarray(value, DTYPES[type_name]), shape))
    if type_name == "String":
        return str(value or "")
    return {"Real": float, "Boolean": bool}.get(type_name, int)(value)


@dataclass
class Evaluator:
    """Evaluator of expressions and statements in one scope: the model, or the body of a function.

    The methods for the kinds of nodes are named after the classes of `syntax_tree`.
    """

    functions: Mapping[str, Function]
    #: variable -> current value
    values: MutableMapping[str, Any]
    # statements

    def execute(self, body: Body) -> None:
        """Execute statements in order.

        Raises:
            EvaluationError: The model has failed.
        """
        for statement in body:
            getattr(self, f"_{type(statement).__name__.lower()}")(statement)

    def _assign(self, node: Assign) -> None:
        self._store(node.target, self(node.value))

    def _store(self, target: Name | Index, value: Any) -> None:
        name = referenced_variable(target)
        current = self.values[name]
        if isinstance(target, Index):
            current[self._indices(target, current.shape)] = value
        elif isinstance(current, np.ndarray):
            current[...] = value
        else:
            self.values[name] = type(current)(value)

    def _multiassign(self, node: MultiAssign) -> None:
        for target, value in zip(node.targets, self._call_function(node.call), strict=False):
            self._store(target, value)

    def _ifstatement(self, node: IfStatement) -> None:
        self.execute(
            next((body for condition, body in node.branches if self(condition)), node.otherwise)
        )

    def _for(self, node: For) -> None:
        shadowed = self.values.get(node.index)
        for index in self._range(node.range):
            self.values[node.index] = int(index)
            self.execute(node.body)
        self.values.pop(node.index, None)
        if shadowed is not None:
            self.values[node.index] = shadowed

    def _while(self, node: While) -> None:
        while self(node.condition):
            self.execute(node.body)

    def _assert(self, node: Assert) -> None:
        if not self(node.condition) and not (node.warning or node.terminates):
            raise EvaluationError("".join(map(self._as_text, node.message)), node.where)

    def _as_text(self, node: Expression) -> str:
        """Return the value of an expression as in a composed message.

        Reals with 6 significant digits.
        """
        value = self(node)
        if isinstance(value, float):
            return f"{value:g}"
        return str(value).lower() if isinstance(value, bool) else str(value)

    # expressions

    def __call__(self, node: Expression) -> Any:
        """Return the value of an expression.

        Raises:
            EvaluationError: The model has failed.
        """
        return getattr(self, f"_{type(node).__name__.lower()}")(node)

    def _literal(self, node: Literal) -> Any:
        return float(node.number) if node.type == "Real" else node.value

    def _name(self, node: Name) -> Any:
        return self.values[node.name]

    def _array(self, node: Array) -> np.ndarray:
        return np.array([self(element) for element in node.elements])

    def _comprehension(self, node: Comprehension) -> np.ndarray:
        shadowed, elements = self.values.get(node.index), []
        for number in self(node.range):
            self.values[node.index] = to_python_scalar(number)
            elements.append(self(node.value))
        self.values.pop(node.index, None)
        if shadowed is not None:
            self.values[node.index] = shadowed
        return np.array(elements)

    def _range(self, node: Range) -> np.ndarray:
        step = self(node.step) if node.step else 1
        return np.arange(self(node.start), self(node.stop) + (1 if step > 0 else -1), step)

    def _if(self, node: If) -> Any:
        return self(
            next((value for condition, value in node.branches if self(condition)), node.otherwise)
        )

    def _unary(self, node: Unary) -> Any:
        value = self(node.operand)
        return (
            elementwise(operator.not_, value)
            if node.operator == "not"
            else elementwise(lambda x: check_int32(-x), value)
        )

    def _binary(self, node: Binary) -> Any:
        if node.operator == "and":
            return bool(self(node.left)) and bool(self(node.right))
        if node.operator == "or":
            return bool(self(node.left)) or bool(self(node.right))
        left, right = self(node.left), self(node.right)
        if node.operator == "*" and isinstance(left, np.ndarray) and isinstance(right, np.ndarray):
            return matrix_product(left, right)
        if node.operator == "^" and node.right == Literal(2, "Integer"):
            return elementwise(lambda x: float(x) * float(x), left)
        return elementwise(OPERATORS[node.operator.removeprefix(".")], left, right)

    def _index(self, node: Index) -> Any:
        base = self(node.base)
        return to_python_scalar(base[self._indices(node, base.shape)])

    def _indices(self, node: Index, shape: tuple[int, ...]) -> tuple[Any, ...]:
        return tuple(
            self._index_of(s, n, node) for s, n in zip(node.subscripts, shape, strict=False)
        )

    def _index_of(self, subscript: Expression | Colon, size: int, node: Index) -> Any:
        if isinstance(subscript, Colon):
            return slice(None)
        index = self(subscript)
        if not all(1 <= k <= size for k in np.atleast_1d(index)):
            label = node.base.name if isinstance(node.base, Name) else "array"
            raise EvaluationError(f"{label}: subscript outside 1..{size}", node.where)
        return index - 1

    def _call(self, node: Call) -> Any:
        return self._call_function(node)[node.result]

    def _call_function(self, node: Call) -> list[Any]:
        function, arguments = (
            self.functions[node.function],
            [self(argument) for argument in node.arguments],
        )
        scope = Evaluator(self.functions, {})
        for local, value in zip(function.inputs, arguments, strict=True):
            scope.values[local.name] = convert_to_type(value, local.type, np.shape(value))
        for local in (*function.outputs, *function.locals):
            scope._declare(local)
        if function.external:
            scope.call_external(function)
        else:
            scope.execute(function.body)
        return [scope.values[local.name] for local in function.outputs]

    def call_external(self, function: Function) -> None:
        """Call the C function of an external function, whose scope is this one."""
        (node,) = function.body
        assert isinstance(node, ExternalCall)
        assert function.external
        if function.external.library is None:
            return
        results = function.external.library.call(
            function, [self(argument) for argument in node.arguments]
        )
        for k, value in results.items():
            target = node.result if k < 0 else node.arguments[k]
            assert isinstance(target, Name)
            self._store(target, value)

    def _declare(self, local: FunctionVariable) -> None:
        shape = tuple(int(self(d)) for d in local.dimensions if d is not None)
        self.values[local.name] = convert_to_type(
            self(local.default) if local.default is not None else 0, local.type, shape
        )

    def _builtin(self, node: Builtin) -> Any:
        evaluate = BUILTIN_FUNCTIONS[node.name].evaluate
        if evaluate is None:
            raise KeyError(node.name)
        return evaluate(*map(self, node.arguments))
