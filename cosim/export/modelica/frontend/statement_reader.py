"""Reads the statements and functions of rumoca's JSON."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import cast

from ..model import flat_model
from ..model.flat_model import Body, Expression, Place, Statement, refuse
from .expression_reader import ExpressionReader, Json, only


class StatementReader(ExpressionReader):
    """Adds statements and functions."""

    def body(self, nodes: list[Json]) -> Body:
        return tuple(self._statement(*only(node)) for node in nodes)

    def _statement(self, kind: str, node: Json) -> Statement:
        readers: Mapping[str, Callable[[Json], Statement]] = {
            "Assignment": lambda n: flat_model.Assign(self._target(n["comp"]), self.expression(n["value"]), self.place(n)),
            "FunctionCall": self._multi_assign,
            "If": self._if_statement,
            "For": self._for,
            "Assert": self._assert,
            "When": lambda n: flat_model.When(
                tuple((self.expression(block["cond"]), self.body(block["stmts"])) for block in n["blocks"]), self.place(n)
            ),
        }
        if kind not in readers:
            refuse(f"the statement {kind} is not supported", self.place(node))
        return readers[kind](node)

    def _target(self, component: Json) -> flat_model.Name | flat_model.Index:
        where, parts = self.place(component), component["parts"]
        owners = "".join(part["ident"] + self._constant_subscripts(part["subs"], where) + "." for part in parts[:-1])
        name = flat_model.Name(owners + parts[-1]["ident"], where)
        subscripts = self._subscripts(parts[-1]["subs"])
        return flat_model.Index(name, subscripts, where) if subscripts else name

    def _constant_subscripts(self, nodes: list[Json], where: Place | None) -> str:
        """Subscripts of a component array are part of the flat name: "b[1]"."""
        numbers = [payload["value"] for kind, payload in map(only, nodes) if kind == "Index"]
        if len(numbers) != len(nodes):
            refuse("a component of an array can only be assigned with a constant subscript", where)
        return f"[{','.join(map(str, numbers))}]" if numbers else ""

    def _multi_assign(self, node: Json) -> flat_model.MultiAssign:
        where = self.place(node)
        return flat_model.MultiAssign(
            tuple(map(self._target, node["outputs"])), self._function_call(node["comp"], node["args"], where), where
        )

    def _if_statement(self, node: Json) -> flat_model.IfStatement:
        branches = tuple((self.expression(block["cond"]), self.body(block["stmts"])) for block in node["cond_blocks"])
        return flat_model.IfStatement(branches, self.body(node["else_block"] or []), self.place(node))

    def _for(self, node: Json) -> flat_model.For:
        body = self.body(node["equations"])
        where = self.place(node)
        for index in reversed(node["indices"]):
            steps = self.expression(index["range"])
            if not isinstance(steps, flat_model.Range):
                refuse("a for-loop needs a range such as 1:n", where)
            body = (flat_model.For(index["ident"], steps, body, where),)
        return cast(flat_model.For, body[0])

    def _assert(self, node: Json) -> flat_model.Assert:
        message, where = self.expression(node["message"]), self.place(only(node["condition"])[1])
        if node["level"] is not None and self.expression(node["level"]) != flat_model.Literal(2, "Integer"):
            refuse("assert() with a level below error is not supported", where)
        return flat_model.Assert(self.expression(node["condition"]), self._joined(message, where), where)

    def _joined(self, message: Expression, where: Place | None) -> str:
        if isinstance(message, flat_model.Literal) and message.type == "String":
            return str(message.value)
        if isinstance(message, flat_model.Binary) and message.operator == "+":
            return self._joined(message.left, where) + self._joined(message.right, where)
        refuse("the message of an assert() must be a literal text", where)

    def function(self, node: Json) -> flat_model.Function:
        if node["external"]:
            refuse(f"the external function {node['name']} is not supported", self.place(node))
        inputs, outputs, inner = (tuple(map(self._local, node[kind])) for kind in ("inputs", "outputs", "locals"))
        return flat_model.Function(node["name"], inputs, outputs, inner, self.body(node["body"]), self.place(node))

    def _local(self, node: Json) -> flat_model.Local:
        where = self.place(node)
        if node["type_class"] == "Record":
            refuse(f"the record {node['name']} inside a function is not supported; pass its fields", where)
        dimensions = tuple(None if isinstance(d, flat_model.Colon) else d for d in self._subscripts(node["shape_expr"]))
        kind = self._type(node["effective_type"]["canonical_type"])
        return flat_model.Local(node["name"], kind, dimensions, self._optional(node["default"]), where)
