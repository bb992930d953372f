"""Reads rumoca's JSON of a flat model into `flat.Model`. What is not known here is refused, never dropped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..model import flat_model
from ..model.flat_model import Body, Expression, Place, Statement, refuse
from .expression_reader import Json, only
from .statement_reader import StatementReader
from .unrolling import rolled_up


class Reader(StatementReader):
    """Reads one flat model; `json` is the whole document."""

    def model(self, name: str) -> flat_model.Model:
        self._check_document()
        names = self.json["variables"]
        return flat_model.Model(
            name=name,
            description=self.json["model_description"] or "",
            variables={key: self.variable(key) for key in names},
            equations=(*self._unrolled_equations(), *self._declaration_equations()),
            whens=tuple(self.when_chain(chain) for chain in self.json["when_chains"]),
            algorithms=tuple(self.body(algorithm["statements"]) for algorithm in self.json["algorithms"]),
            asserts=tuple(self._assert(node) for node in self.json["assert_equations"]),
            initial_equations=self.equations("initial_equations"),
            initial_algorithms=tuple(self.body(algorithm["statements"]) for algorithm in self.json["initial_algorithms"]),
            functions={key: self.function(node) for key, node in self.json["functions"].items() if not node["is_constructor"]},
            enumerations=self._enumerations(),
            structural=tuple(
                flat_model.Structural(node["kind"], tuple(map(self._first_known, node["references"])), self.place(node))
                for node in self.json.get("parameter_branch_selections", ())
            ),
        )

    def _check_document(self) -> None:
        if self.json["is_partial"]:
            refuse("the model is partial", None)
        for kind in ("initial_assert_equations", "definite_roots", "branches", "optional_edges", "potential_roots"):
            if self.json.get(kind):
                refuse(f"{kind.replace('_', ' ')} are not supported", None)

        if next(rolled_up(self.json, "initial_structured_equations"), None):
            refuse("a for-equation among the initial equations was not unrolled by the front end", None)

    def _first_known(self, candidates: list[str]) -> str:
        """Of the names by which a parameter may be meant, from the inside out, the one that exists."""
        return next((name for name in candidates if name in self.json["variables"]), candidates[0])

    # variables

    def variable(self, name: str) -> flat_model.Variable:
        node = self.json["variables"][name]
        type_name = self.json["variable_type_names"][name]
        kind = self._type(self.json["effective_types"][str(node["type_id"])]["canonical_type"])
        return flat_model.Variable(
            name=name,
            type=kind,
            shape=tuple(node["dims"]),
            variability=self._variability(node),
            causality=self._causality(node),
            start=self._optional(node["start"]),
            binding=self._optional(node["binding"]),
            bound_by_modifier=node["binding_from_modification"],
            final=bool(self.json["variable_final_flags"].get(name)),
            protected=node["is_protected"],
            top_level=self._is_top_level(name),
            unit=self._text(node["unit"]),
            description=self._text(node["description"]),
            minimum=self._optional(node["min"]),
            maximum=self._optional(node["max"]),
            enumeration=type_name if kind == "Enumeration" else "",
            where=self.place(node),
        )

    def _variability(self, node: Json) -> Any:
        kind = node["variability"]
        word = (kind if isinstance(kind, str) else only(kind)[0]).lower()
        if word == "empty":
            return "discrete" if node["is_discrete_type"] else "continuous"
        return word

    def _causality(self, node: Json) -> Any:
        kind = node["causality"]
        word = (kind if isinstance(kind, str) else only(kind)[0]).lower()
        return "local" if word == "empty" else word

    def _is_top_level(self, name: str) -> bool:
        """Whether a name is the model's own, if need be as a field of its own records or connectors."""
        parts = name.split(".")
        owners = (".".join(parts[:depth]) for depth in range(1, len(parts)))
        return parts[0] in self.json["top_level_connectors"] or all(owner in self.json["record_instances"] for owner in owners)

    def _text(self, node: Any) -> str:
        if node is None or isinstance(node, str):
            return node or ""
        literal = self.expression(node)
        return (
            str(literal.value)
            if isinstance(literal, flat_model.Literal)
            else refuse("a text literal is expected", self.place(node))
        )

    def _enumerations(self) -> dict[str, tuple[str, ...]]:
        types: dict[str, dict[int, str]] = {}
        for key, ordinal in self.json["enum_literal_ordinals"].items():
            owner, _, literal = key.rpartition(".")
            if not literal.startswith("'"):
                types.setdefault(owner, {})[ordinal] = literal
        return {owner: tuple(literals[k] for k in sorted(literals)) for owner, literals in types.items()}

    # equations

    def equations(self, section: str) -> tuple[flat_model.Equation, ...]:
        return tuple(pair for node in self.json[section] for pair in self._equation(node))

    def _unrolled_equations(self) -> Iterator[flat_model.Equation]:
        """The equations with the for-equations that the front end has left rolled up."""
        true = dict(rolled_up(self.json, "structured_equations"))
        for place, node in enumerate(self.json["equations"]):
            written = self._equation({**node, "residual": true.get(place, node["residual"])})
            if [e.left for e in written] != [e.left for e in self._equation(node)]:
                refuse("this for-equation was not unrolled by the front end; write its equations one by one", self.place(node))
            yield from written

    def _equation(self, node: Json) -> list[flat_model.Equation]:
        kind, residual = only(node["residual"])
        if kind != "Binary" or residual["op"] != "Sub":
            refuse("an equation that is not of the form a = b", self.place(node))
        left, right, where = self.expression(residual["lhs"]), self.expression(residual["rhs"]), self.place(node)
        return [flat_model.Equation(a, b, where) for a, b in self._fields(left, right)]

    def _fields(self, left: Expression, right: Expression) -> list[tuple[Expression, Expression]]:
        """The pairs of fields when two records are equated, else the pair itself."""
        records = self.json["record_instances"]
        if not (isinstance(left, flat_model.Name) and left.name in records):
            return [(left, right)]
        if not (isinstance(right, flat_model.Name) and right.name in records):
            refuse("a record can only be equated with a record variable; write one equation for each field", left.where)
        names = [name for name in self.json["variables"] if name.startswith(left.name + ".")]
        return [
            (flat_model.Name(n, left.where), flat_model.Name(right.name + n.removeprefix(left.name), right.where)) for n in names
        ]

    def _declaration_equations(self) -> list[flat_model.Equation]:
        """`Real y = 2*u;` of a variable that is no parameter."""
        variables = [self.variable(name) for name in self.json["variables"]]
        return [
            flat_model.Equation(flat_model.Name(v.name, v.where), v.binding, v.where)
            for v in variables
            if v.binding is not None and v.variability not in ("constant", "parameter")
        ]

    def when_chain(self, chain: Json) -> flat_model.When:
        blocks = [chain["first"], *chain["else_when"]]
        branches = tuple((self.expression(block["condition"]), self._when_body(block["equations"])) for block in blocks)
        return flat_model.When(branches, self.place(chain))

    def _when_body(self, nodes: list[Json]) -> Body:
        return tuple(self._when_equation(*only(node)) for node in nodes)

    def _when_equation(self, kind: str, node: Json) -> Statement:
        if kind == "Assign":
            where = self.place(node)
            return flat_model.Assign(self._target_text(node["target"], where), self.expression(node["value"]), where)
        if kind == "Reinit":
            where = self.place(node)
            return flat_model.Assign(self._target_text(node["state"], where), self.expression(node["value"]), where)
        if kind == "Conditional":
            branches = tuple((self.expression(condition), self._when_body(body)) for condition, body in node["branches"])
            return flat_model.IfStatement(branches, self._when_body(node["else_branch"] or []), self.place(node))
        if kind == "Assert":
            return self._assert(node)
        refuse(f"{kind} in a when-equation is not supported", self.place(node))

    def _target_text(self, target: str, where: Place | None) -> flat_model.Name | flat_model.Index:
        """A target of a when-equation comes as text: a name, perhaps with constant subscripts."""
        if target in self.json["variables"]:
            return flat_model.Name(target, where)
        base, bracket, subscripts = target.rpartition("[")
        if not bracket or base not in self.json["variables"]:
            refuse(f'cannot assign "{target}" in a when-equation; write one equation for each variable', where)
        numbers = subscripts.rstrip("]").split(",")
        return flat_model.Index(
            flat_model.Name(base, where), tuple(flat_model.Literal(int(k), "Integer") for k in numbers), where
        )
