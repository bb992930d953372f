"""Conversion of statements and functions from rumoca's JSON to the flat model."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import chain
from typing import cast

from ..model.flat_model import ExternalCode, Function, FunctionVariable
from ..model.syntax_tree import (
    Array,
    Assert,
    Assign,
    Binary,
    Body,
    Colon,
    Expression,
    ExternalCall,
    For,
    IfStatement,
    Index,
    Literal,
    MultiAssign,
    Name,
    Range,
    Reinit,
    SourceLocation,
    Statement,
    When,
    While,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import is_call, variable_names
from .expression_reader import ExpressionReader, Json, is_object_constructor, split_tagged
from .model_files import MARK

_DESTRUCTOR = re.compile(
    r'\bfunction\s+destructor\b.*?\bexternal\s*(?:"C"\s*)?(\w+)\s*\(', re.DOTALL
)


class StatementReader(ExpressionReader):
    """Reader of statements and functions."""

    def read_body(self, nodes: list[Json]) -> Body:
        """Convert a list of statements."""
        statements: list[Statement] = []
        for node in nodes:
            statements += self._statements(*split_tagged(node))
        return tuple(statements)

    def _statements(self, kind: str, node: Json) -> list[Statement]:
        """Convert a statement.

        The assignment of a record constructor becomes one assignment for each field.
        """
        call = node["value"].get("FunctionCall") if kind == "Assignment" else None
        function = self.json["functions"].get(call["name"]["name"]) if call else None
        if (
            call is None
            or function is None
            or not (call["is_constructor"] or self.fields(function["outputs"][0]))
        ):
            return [self._statement(kind, node)]
        where, target = self.locate(node), referenced_variable(self._target(node["comp"]))
        if not call["is_constructor"]:
            results = [name.partition(".")[2] for name in self.scalar_names(function["outputs"][0])]
            targets = tuple(Name(f"{target}.{name}", where) for name in results)
            return [MultiAssign(targets, self._call(call), where)]
        names = [local["name"] for local in function["inputs"]]
        values = [self.read_field(call, name) for name in names]
        if any(name.startswith(f"{target}.") for name in variable_names(values)):
            raise_model_error(
                f"the new value of the record {target} reads its fields; assign to another "
                "record first",
                where,
            )
        return [
            Assign(Name(f"{target}.{name}", where), value, where)
            for name, value in zip(names, values, strict=True)
        ]

    def _statement(self, kind: str, node: Json) -> Statement:
        readers: Mapping[str, Callable[[Json], Statement]] = {
            "Assignment": lambda n: Assign(
                self._target(n["comp"]), self.read_expression(n["value"]), self.locate(n)
            ),
            "FunctionCall": self._multi_assign,
            "If": self._if_statement,
            "For": self._for,
            "While": lambda n: While(
                self.read_expression(n["block"]["cond"]),
                self.read_body(n["block"]["stmts"]),
                self.locate(n),
            ),
            "Reinit": lambda n: Reinit(
                self._target(n["variable"]), self.read_expression(n["value"]), self.locate(n)
            ),
            "Assert": self._assert,
            "When": lambda n: When(
                tuple(
                    (self.read_expression(block["cond"]), self.read_body(block["stmts"]))
                    for block in n["blocks"]
                ),
                self.locate(n),
            ),
        }
        if kind not in readers:
            raise_model_error(f"the statement {kind} is not supported", self.locate(node))
        return readers[kind](node)

    def _target(self, component: Json) -> Name | Index:
        where, parts = self.locate(component), component["parts"]
        owners = "".join(
            part["ident"] + self._constant_subscripts(part["subs"], where) + "."
            for part in parts[:-1]
        )
        name = Name(owners + parts[-1]["ident"], where)
        subscripts = self._subscripts(parts[-1]["subs"])
        return Index(name, subscripts, where) if subscripts else name

    def _constant_subscripts(self, nodes: list[Json], where: SourceLocation | None) -> str:
        """Return the constant subscripts of a component array as text.

        They are part of the flat name: "b[1]".
        """
        numbers = [
            payload["value"] for kind, payload in map(split_tagged, nodes) if kind == "Index"
        ]
        if len(numbers) != len(nodes):
            raise_model_error(
                "a component of an array can only be assigned with a constant subscript", where
            )
        return f"[{','.join(map(str, numbers))}]" if numbers else ""

    def _multi_assign(self, node: Json) -> MultiAssign:
        where = self.locate(node)
        return MultiAssign(
            tuple(map(self._target, node["outputs"])),
            self._function_call(node["comp"], node["args"], where),
            where,
        )

    def _if_statement(self, node: Json) -> IfStatement:
        branches = tuple(
            (self.read_expression(block["cond"]), self.read_body(block["stmts"]))
            for block in node["cond_blocks"]
        )
        return IfStatement(branches, self.read_body(node["else_block"] or []), self.locate(node))

    def _for(self, node: Json) -> For:
        body = self.read_body(node["equations"])
        where = self.locate(node)
        for index in reversed(node["indices"]):
            steps = self.read_expression(index["range"])
            if not isinstance(steps, Range):
                raise_model_error("a for-loop needs a range such as 1:n", where)
            body = (For(index["ident"], steps, body, where),)
        return cast(For, body[0])

    def _assert(self, node: Json) -> Assert:
        where = self.locate(split_tagged(node["condition"])[1])
        level = None if node["level"] is None else self.read_expression(node["level"])
        if level is not None and not isinstance(level, Literal):
            raise_model_error("the level of an assert() must be a literal of AssertionLevel", where)
        condition = self.read_expression(node["condition"])
        first, *others = message_parts(self.read_expression(node["message"]))
        if isinstance(first, Literal) and str(first.value).startswith(MARK):
            text = Literal(str(first.value).removeprefix(MARK), "String")
            return Assert(condition, (text, *others), where, terminates=True)
        return Assert(
            condition, (first, *others), where, warning=level is not None and level.value == 1
        )

    def read_function(self, node: Json) -> Function:
        """Convert a function.

        Raises:
            InputError: The function contains an unsupported element.
        """
        inputs, outputs, local = (
            tuple(chain.from_iterable(map(self._locals, node[kind])))
            for kind in ("inputs", "outputs", "locals")
        )
        body, external = self.read_body(node["body"]), None
        if node["external"]:
            body, external = (self._external_call(node),), self._external_code(node)
        return Function(node["name"], inputs, outputs, local, body, self.locate(node), external)

    def _external_call(self, node: Json) -> ExternalCall:
        external, where = node["external"], self.locate(node)
        if external["language"] not in ("C", "", None):
            raise_model_error(
                f"found the language {external['language']} of an external function, expected C",
                where,
            )
        name, result = external["function_name"], external["output_name"]
        arguments = tuple(map(self.read_expression, external["args"]))
        return ExternalCall(name, arguments, Name(result) if result else None, where)

    def _external_code(self, node: Json) -> ExternalCode:
        values = {
            item["name"][-1]: self.read_expression(item["value"])
            for item in node["external"]["annotations"]
        }
        include, directory, libraries = (
            _texts(values.get(key)) for key in ("Include", "IncludeDirectory", "LibraryDirectory")
        )
        library, destructor = (
            _texts(values.get("Library")),
            self._destructor(node) if is_object_constructor(node) else "",
        )
        return ExternalCode(
            "".join(include), "".join(directory), library, "".join(libraries), destructor
        )

    def _destructor(self, constructor: Json) -> str:
        """Return the C function of the destructor of an external object.

        The document does not contain it.
        """
        where = self.locate(constructor)
        text = where.path.read_bytes()[constructor["span"]["start"] :].decode() if where else ""
        match = _DESTRUCTOR.search(text)
        return match[1] if match else ""

    def _locals(self, node: Json) -> list[FunctionVariable]:
        """Convert a variable of a function; a record becomes one variable for each field."""
        fields = [self._local({**field, "default": None}) for field in self.fields(node)]
        names = self.scalar_names(node)
        return (
            [replace(each, name=name) for each, name in zip(fields, names, strict=True)]
            if fields
            else [self._local(node)]
        )

    def _local(self, node: Json) -> FunctionVariable:
        where = self.locate(node)
        dimensions = tuple(
            None if isinstance(d, Colon) else d for d in self._subscripts(node["shape_expr"])
        )
        kind = self._type(node["effective_type"]["canonical_type"])
        return FunctionVariable(
            node["name"], kind, dimensions, self._optional(node["default"]), where
        )


def message_parts(message: Expression) -> list[Expression]:
    """Return the terms of a concatenation of Strings; adjacent literals become one literal."""
    if is_call(message, "String"):
        return [message.arguments[0]]
    if not (isinstance(message, Binary) and message.operator == "+"):
        return [message]
    left, right = message_parts(message.left), message_parts(message.right)
    if isinstance(left[-1], Literal) and isinstance(right[0], Literal):
        joined = Literal(f"{left[-1].value}{right[0].value}", "String")
        return [*left[:-1], joined, *right[1:]]
    return left + right


def _texts(value: Expression | None) -> tuple[str, ...]:
    """Return the String literals of an annotation, which is one literal or an array of them."""
    items = value.elements if isinstance(value, Array) else (value,)
    return tuple(str(item.value) for item in items if isinstance(item, Literal))
