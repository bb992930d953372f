"""Conversion of expressions from rumoca's JSON to the flat model.

Unknown elements are errors, they are never ignored.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any

from ..model.builtin_functions import SPELLINGS
from ..model.syntax_tree import (
    Array,
    Binary,
    Builtin,
    Call,
    Colon,
    Comprehension,
    Expression,
    If,
    Index,
    Literal,
    Name,
    Range,
    SourceLocation,
    Unary,
    raise_model_error,
)
from ..model.traversal import is_call
from .model_files import ModelicaSources

Json = Mapping[str, Any]

_OPERATORS = {
    "Add": "+", "Sub": "-", "Mul": "*", "Div": "/", "Exp": "^",
    "AddElem": ".+", "SubElem": ".-", "MulElem": ".*", "DivElem": "./", "ExpElem": ".^",
    "Lt": "<", "Le": "<=", "Gt": ">", "Ge": ">=", "Eq": "==", "Neq": "<>", "And": "and", "Or": "or",
}  # fmt: skip
_INTEGER_OPERATORS = {"+": operator.add, "-": operator.sub, "*": operator.mul}


def is_object_constructor(function: Json) -> bool:
    """Return whether a function constructs an external object.

    It has the name of the object's class.
    """
    return any(output["type_class"] == "Class" for output in function["outputs"])


def split_tagged(node: Json) -> tuple[str, Any]:
    """Return the kind and the payload of a node `{kind: payload}`."""
    ((kind, payload),) = node.items()
    return kind, payload


def _fold_constants(node: Expression) -> Expression:
    """Evaluate sums, differences and products of Integer literals.

    They occur in the subscripts of an unrolled loop.
    """
    if not (isinstance(node, Binary) and node.operator in _INTEGER_OPERATORS):
        return node
    left, right = _fold_constants(node.left), _fold_constants(node.right)
    if (
        isinstance(left, Literal)
        and isinstance(right, Literal)
        and left.type == right.type == "Integer"
    ):
        return Literal(_INTEGER_OPERATORS[node.operator](left.number, right.number), "Integer")
    return node


@dataclass(frozen=True)
class ExpressionReader:
    """Reader of expressions."""

    #: rumoca's document of the flat model
    json: Json
    sources: ModelicaSources

    def locate(self, node: Json) -> SourceLocation | None:
        """Return the source location of a node, None if the front end has generated it."""
        return self.sources.locate(node.get("span") or node.get("source_span"))

    def _type(self, canonical: int) -> str:
        predefined: dict[int, str] = {
            number: name.capitalize() for name, number in self.json["predefined_types"].items()
        }
        return predefined.get(canonical) or (
            "ExternalObject" if canonical in self._object_types else "Enumeration"
        )

    @cached_property
    def _object_types(self) -> set[int]:
        """Numbers of the types of external objects."""
        types: set[int] = set()
        for function in self.json["functions"].values():
            for local in (*function["inputs"], *function["outputs"], *function["locals"]):
                if local["type_class"] == "Class":
                    types.add(local["effective_type"]["canonical_type"])
        return types

    def _optional(self, node: Json | None) -> Expression | None:
        return None if node is None else self.read_expression(node)

    def read_expression(self, node: Json) -> Expression:
        """Convert an expression.

        Raises:
            InputError: The expression is not supported.
        """
        kind, payload = split_tagged(node)
        readers: Mapping[str, Callable[[Json], Expression]] = {
            "Literal": self._literal,
            "VarRef": self._reference,
            "Index": lambda n: Index(
                self.read_expression(n["base"]), self._subscripts(n["subscripts"]), self.locate(n)
            ),
            "Unary": self._unary,
            "Binary": self._binary,
            "If": self._if,
            "Array": self._array,
            "Range": lambda n: Range(
                self.read_expression(n["start"]),
                self._optional(n["step"]),
                self.read_expression(n["end"]),
            ),
            "BuiltinCall": self._builtin,
            "FunctionCall": self._call,
            "StringConversion": lambda n: Builtin(
                "String", (self.read_expression(n["value"]),), self.locate(n)
            ),
            "ArrayComprehension": self._comprehension,
            "FieldAccess": self._field_access,
        }
        if kind not in readers:
            raise_model_error(f"the expression {kind} is not supported", self.locate(payload))
        return readers[kind](payload)

    def _literal(self, node: Json) -> Literal:
        kind, value = split_tagged(node["value"])
        return Literal(value, kind)

    def _reference(self, node: Json) -> Expression:
        name, where = node["name"]["name"], self.locate(node)
        if (ordinal := self.json["enum_literal_ordinals"].get(name)) is not None:
            return Literal(ordinal, "Enumeration")
        base = Name(name, where)
        return (
            Index(base, self._subscripts(node["subscripts"]), where) if node["subscripts"] else base
        )

    def _subscripts(self, nodes: list[Json]) -> tuple[Expression | Colon, ...]:
        return tuple(self._subscript(*split_tagged(node)) for node in nodes)

    def _subscript(self, kind: str, node: Json) -> Expression | Colon:
        if kind == "Colon":
            return Colon()
        return (
            Literal(node["value"], "Integer")
            if kind == "Index"
            else _fold_constants(self.read_expression(node["expr"]))
        )

    def _unary(self, node: Json) -> Expression:
        operand = self.read_expression(node["rhs"])
        if node["op"] == "Plus":
            return operand
        if node["op"] not in ("Minus", "Not"):
            raise_model_error(f"the operator {node['op']} is not supported", self.locate(node))
        return Unary("-" if node["op"] == "Minus" else "not", operand)

    def _binary(self, node: Json) -> Binary:
        operator = _OPERATORS.get(node["op"]) or raise_model_error(
            f"the operator {node['op']} is not supported", self.locate(node)
        )
        return Binary(
            operator,
            self.read_expression(node["lhs"]),
            self.read_expression(node["rhs"]),
            self.locate(node),
        )

    def _if(self, node: Json) -> If:
        branches = tuple(
            (self.read_expression(condition), self.read_expression(value))
            for condition, value in node["branches"]
        )
        return If(branches, self.read_expression(node["else_branch"]))

    def _array(self, node: Json) -> Expression:
        """Convert an array constructor, or a concatenation `[a, b; c, d]` of scalars or arrays."""
        elements = tuple(map(self.read_expression, node["elements"]))
        kind = node.get("kind")
        if kind not in ("Horizontal", "Vertical"):
            return Array(elements)
        if kind == "Vertical" and (rows := self._scalar_rows(elements)):
            return Array(rows)
        return Builtin("rows" if kind == "Vertical" else "columns", elements, self.locate(node))

    def _scalar_rows(self, rows: tuple[Expression, ...]) -> tuple[Array, ...]:
        """Return the rows of a matrix if all elements are certainly scalars, else no rows."""
        columns = [row.arguments for row in rows if is_call(row, "columns")]
        elements = chain.from_iterable(columns)
        if len(columns) != len(rows) or not all(map(self._is_scalar, elements)):
            return ()
        return tuple(map(Array, columns))

    def _is_scalar(self, node: Expression) -> bool:
        """Return whether an expression is certainly a scalar."""
        if isinstance(node, Name):
            variable = self.json["variables"].get(node.name)
            return variable is not None and not variable["dims"]
        if isinstance(node, Index):
            return isinstance(node.base, Name) and all(
                isinstance(s, Literal) for s in node.subscripts
            )
        if isinstance(node, Binary):
            return self._is_scalar(node.left) and self._is_scalar(node.right)
        return isinstance(node, Literal) or (
            isinstance(node, Unary) and self._is_scalar(node.operand)
        )

    def _comprehension(self, node: Json) -> Expression:
        """Convert an array constructor with iterators.

        The last iterator varies fastest in Modelica's nesting order.
        """
        where = self.locate(node)
        if node.get("filter") is not None:
            raise_model_error("an array constructor with a condition is not supported", where)
        value = self.read_expression(node["expr"])
        for index in node["indices"]:
            value = Comprehension(value, index["name"], self.read_expression(index["range"]), where)
        return value

    def _builtin(self, node: Json) -> Expression:
        name = node["function"].lower()
        if name == "terminal":  # an FMU computes nothing after the last step
            return Literal(False, "Boolean")
        if name == "terminate":
            raise_model_error("terminate() is supported in when-equations only", self.locate(node))
        return Builtin(
            SPELLINGS.get(name, name),
            tuple(map(self.read_expression, node["args"])),
            self.locate(node),
        )

    def _field_access(self, node: Json) -> Expression:
        kind, record = split_tagged(node["base"])
        if kind != "FunctionCall":
            raise_model_error(
                "a field can only be taken from a record variable or a function call",
                self.locate(node),
            )
        return self.read_field(record, node["field"])

    def read_field(self, call: Json, field: str) -> Expression:
        """Convert the field of a record that a record constructor or another function returns."""
        function, where = self.json["functions"][call["name"]["name"]], self.locate(call)
        if call["is_constructor"]:
            names = [local["name"] for local in function["inputs"]]
            if field in names and len(call["args"]) == len(names):
                return self.read_expression(call["args"][names.index(field)])
        else:
            names = list(chain.from_iterable(map(self.scalar_names, function["outputs"])))
            if (name := f"{function['outputs'][0]['name']}.{field}") in names:
                return replace(self._call(call), result=names.index(name))
        reason = (
            f"the record of {function['name']}() has no field {field}; records in records are not "
            "supported"
        )
        return raise_model_error(reason, where)

    def scalar_names(self, local: Json) -> list[str]:
        """Return the names of a record's fields, or the name of any other variable.

        The variable is one of a function.
        """
        return [f"{local['name']}.{field['name']}" for field in self.fields(local)] or [
            local["name"]
        ]

    def fields(self, local: Json) -> list[Json]:
        """Return the fields of a record in a function, none for other variables."""
        if local["type_class"] != "Record":
            return []
        for function in self.json["functions"].values():
            if function["is_constructor"] and function["def_id"] == local["type_def_id"]:
                return list(function["inputs"])
        reason = f"the record {local['name']} inside a function is not supported; pass its fields"
        return raise_model_error(reason, self.locate(local))

    def _call(self, node: Json) -> Call:
        if node["is_constructor"]:
            raise_model_error(
                "a record constructor is not supported here; write one for a record variable",
                self.locate(node),
            )
        return self._function_call(node["name"], node["args"], self.locate(node))

    def _function_call(
        self, reference: Json, arguments: list[Json], where: SourceLocation | None
    ) -> Call:
        """Convert a function call.

        rumoca identifies functions by their short names and would silently use a function of
        another package with the same name. Such calls are rejected.
        """
        name = reference["name"]
        function = self.json["functions"].get(name) or raise_model_error(
            f"unknown function {name}", where
        )
        if (
            not is_object_constructor(function)
            and reference["component_ref"]["parts"][-1]["def_id"] != function["def_id"]
        ):
            raise_model_error(
                f'the model uses several functions named "{name}"; give them different names', where
            )
        return Call(name, tuple(map(self.read_expression, arguments)), where)
