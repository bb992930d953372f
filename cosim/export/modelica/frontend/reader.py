"""Conversion of rumoca's JSON to the flat model.

Unknown elements are errors, they are never ignored.

The front end unrolls some for-equations only in part. For these, its document contains the
equations of the first iterations and a template for all iterations. The equations of the other
iterations are placeholders such as `der(x[3]) = 0.0`, in which only the left side is correct.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain, product
from typing import Any

from ..model.flat_model import Equation, Model, Variable
from ..model.syntax_tree import (
    Assert,
    Assign,
    Body,
    Call,
    Expression,
    IfStatement,
    Index,
    Literal,
    Name,
    Reinit,
    SourceLocation,
    Statement,
    When,
    raise_model_error,
)
from .expression_reader import Json, split_tagged
from .statement_reader import StatementReader, message_parts


class ModelReader(StatementReader):
    """Reader of a flat model."""

    def read_model(self, name: str) -> Model:
        """Convert the whole document.

        Args:
            name: The name of the model.

        Raises:
            InputError: The model contains an element that is not supported.
        """
        self._check_document(self.sources.locate_class(name))
        names = self.json["variables"]
        return Model(
            name=name,
            description=self.json["model_description"] or "",
            variables={key: _with_default(self.read_variable(key)) for key in names},
            equations=(*self._unrolled_equations(), *self._declaration_equations()),
            whens=tuple(self.read_when_chain(chain) for chain in self.json["when_chains"]),
            algorithms=tuple(
                self.read_body(algorithm["statements"]) for algorithm in self.json["algorithms"]
            ),
            asserts=tuple(self._assert(node) for node in self.json["assert_equations"]),
            initial_equations=self.read_initial_equations(),
            initial_algorithms=tuple(
                self.read_body(algorithm["statements"])
                for algorithm in self.json["initial_algorithms"]
            ),
            functions={
                key: self.read_function(node)
                for key, node in self.json["functions"].items()
                if not node["is_constructor"]
            },
            enumerations=self._enumerations(),
            structural=frozenset(self._parameters_of_branches()),
        )

    def _parameters_of_branches(self) -> Iterator[str]:
        """Yield the parameters with which rumoca has selected branches."""
        for node in self.json.get("parameter_branch_selections", ()):
            yield from map(self._resolve_name, node["references"])

    def _check_document(self, where: SourceLocation) -> None:
        if self.json["is_partial"]:
            raise_model_error("the model is partial", where)
        for kind in (
            "initial_assert_equations",
            "definite_roots",
            "branches",
            "optional_edges",
            "potential_roots",
        ):
            if self.json.get(kind):
                raise_model_error(f"{kind.replace('_', ' ')} are not supported", where)

        if next(unroll_equations(self.json, "initial_structured_equations"), None):
            raise_model_error(
                "a for-equation among the initial equations was not unrolled by the front end",
                where,
            )

    def _resolve_name(self, candidates: list[str]) -> str:
        """Return the first of the candidate names (innermost scope first) that is a variable."""
        return next((name for name in candidates if name in self.json["variables"]), candidates[0])

    # variables

    def read_variable(self, name: str) -> Variable:
        """Convert the declaration of a variable."""
        node = self.json["variables"][name]
        type_name = self.json["variable_type_names"][name]
        kind = self._type(self.json["effective_types"][str(node["type_id"])]["canonical_type"])
        parts = name.split(".")
        # the model itself, its records and connectors own the top-level variables
        owners = (".".join(parts[:depth]) for depth in range(1, len(parts)))
        return Variable(
            name=name,
            type=kind,
            shape=tuple(node["dims"]),
            variability=_word(
                node["variability"], "discrete" if node["is_discrete_type"] else "continuous"
            ),
            causality=_word(node["causality"], "local"),
            start=self._optional(node["start"]),
            binding=self._optional(node["binding"]),
            bound_by_modifier=node["binding_from_modification"],
            final=bool(self.json["variable_final_flags"].get(name)),
            fixed=_is_fixed(node["fixed"]),
            protected=node["is_protected"],
            top_level=(
                parts[0] in self.json["top_level_connectors"]
                or all(owner in self.json["record_instances"] for owner in owners)
            ),
            unit=self._text(node["unit"]),
            quantity=self._text(node["quantity"]),
            description=self._text(node["description"]),
            minimum=self._optional(node["min"]),
            maximum=self._optional(node["max"]),
            enumeration=type_name if kind == "Enumeration" else "",
            where=self.locate(node),
        )

    def _text(self, node: Any) -> str:
        if node is None or isinstance(node, str):
            return node or ""
        literal = self.read_expression(node)
        return (
            str(literal.value)
            if isinstance(literal, Literal)
            else raise_model_error("a String literal is expected", self.locate(node))
        )

    def _enumerations(self) -> dict[str, tuple[str, ...]]:
        types: dict[str, dict[int, str]] = {}
        for key, ordinal in self.json["enum_literal_ordinals"].items():
            type_name, _, literal = key.rpartition(".")
            if not literal.startswith("'"):
                types.setdefault(type_name, {})[ordinal] = literal
        enumerations = {}
        for type_name, literals in types.items():
            enumerations[type_name] = tuple(literals[k] for k in sorted(literals))
        return enumerations

    # equations

    def read_initial_equations(self) -> tuple[Equation, ...]:
        """Convert the initial equations."""
        return tuple(chain.from_iterable(map(self._equation, self.json["initial_equations"])))

    def _unrolled_equations(self) -> Iterator[Equation]:
        """Yield all equations, with the placeholders of for-equations replaced."""
        replacements = dict(unroll_equations(self.json, "structured_equations"))
        for index, node in enumerate(self.json["equations"]):
            equations = self._equation(
                {**node, "residual": replacements.get(index, node["residual"])}
            )
            if [e.left for e in equations] != [e.left for e in self._equation(node)]:
                raise_model_error(
                    "this for-equation was not unrolled by the front end; write its equations "
                    "one by one",
                    self.locate(node),
                )
            yield from equations

    def _equation(self, node: Json) -> list[Equation]:
        kind, residual = split_tagged(node["residual"])
        where = self.locate(node)
        if kind != "Binary" or residual["op"] != "Sub":
            return [Equation(self.read_expression(node["residual"]), Literal(0.0, "Real"), where)]
        if "Tuple" in residual["lhs"]:
            return self._split_tuple(
                residual["lhs"]["Tuple"]["elements"], self.read_expression(residual["rhs"]), where
            )
        left, call = self.read_expression(residual["lhs"]), residual["rhs"].get("FunctionCall")
        if call and isinstance(left, Name) and left.name in self.json["record_instances"]:
            fields = self._fields_of(left.name)
            return [
                Equation(Name(left.name + f, where), self.read_field(call, f[1:]), where)
                for f in fields
            ]
        right = self.read_expression(residual["rhs"])
        return [Equation(a, b, where) for a, b in self._split_records(left, right)]

    def _split_tuple(
        self, targets: list[Json], call: Expression, where: SourceLocation | None
    ) -> list[Equation]:
        """Return one equation for each result of a function with several results.

        Omitted results have no name.
        """
        if not isinstance(call, Call):
            raise_model_error(
                "the right side of an equation with a tuple must be a function call", where
            )
        return [
            Equation(self.read_expression(target), replace(call, result=k), where)
            for k, target in enumerate(targets)
            if "Empty" not in target
        ]

    def _split_records(
        self, left: Expression, right: Expression
    ) -> list[tuple[Expression, Expression]]:
        """Return the pairs of fields of an equation between records, else the pair itself."""
        records = self.json["record_instances"]
        if not (isinstance(left, Name) and left.name in records):
            return [(left, right)]
        if not (isinstance(right, Name) and right.name in records):
            raise_model_error(
                "a record can only be equated with a record variable; write one equation for "
                "each field",
                left.where,
            )
        return [
            (
                Name(left.name + field, left.where),
                Name(right.name + field, right.where),
            )
            for field in self._fields_of(left.name)
        ]

    def _fields_of(self, record: str) -> list[str]:
        """Return the fields of a record variable, with a dot before each."""
        return [
            name.removeprefix(record)
            for name in self.json["variables"]
            if name.startswith(f"{record}.")
        ]

    def _declaration_equations(self) -> list[Equation]:
        """Return the declaration equations (`Real y = 2*u;`) of variables.

        Parameters and constants have bindings instead.
        """
        variables = [self.read_variable(name) for name in self.json["variables"]]
        return [
            Equation(Name(v.name, v.where), v.binding, v.where)
            for v in variables
            if v.binding is not None
            and v.variability not in ("constant", "parameter")
            and not _is_default(v)
        ]

    def read_when_chain(self, chain: Json) -> When:
        """Convert a when-clause of an equation section, with its `elsewhen` branches."""
        blocks = [chain["first"], *chain["else_when"]]
        branches = tuple(
            (self.read_expression(block["condition"]), self._when_body(block["equations"]))
            for block in blocks
        )
        return When(branches, self.locate(chain))

    def _when_body(self, nodes: list[Json]) -> Body:
        return tuple(self._when_equation(*split_tagged(node)) for node in nodes)

    def _when_equation(self, kind: str, node: Json) -> Statement:
        if kind == "Conditional":
            branches = tuple(
                (self.read_expression(condition), self._when_body(body))
                for condition, body in node["branches"]
            )
            return IfStatement(
                branches, self._when_body(node["else_branch"] or []), self.locate(node)
            )
        if kind == "Assert":
            return self._assert(node)
        where = self.locate(node)
        if kind == "Terminate":
            message = tuple(message_parts(self.read_expression(node["message"])))
            return Assert(Literal(False, "Boolean"), message, where, terminates=True)
        if kind not in ("Assign", "Reinit"):
            raise_model_error(f"{kind} in a when-equation is not supported", where)
        target = self._parse_target(node["target" if kind == "Assign" else "state"], where)
        statement = Assign if kind == "Assign" else Reinit
        return statement(target, self.read_expression(node["value"]), where)

    def _parse_target(self, target: str, where: SourceLocation | None) -> Name | Index:
        """Parse the target of a when-equation, given as text.

        A name, perhaps with constant subscripts.
        """
        if target in self.json["variables"]:
            return Name(target, where)
        base, bracket, subscripts = target.rpartition("[")
        if not bracket or base not in self.json["variables"]:
            raise_model_error(
                f'cannot assign "{target}" in a when-equation; write one equation for each '
                "variable",
                where,
            )
        numbers = subscripts.rstrip("]").split(",")
        return Index(
            Name(base, where),
            tuple(Literal(int(k), "Integer") for k in numbers),
            where,
        )


def _word(kind: Any, default: str) -> Any:
    """Return the name of a kind in rumoca's document, or the default if it is empty."""
    word = (kind if isinstance(kind, str) else split_tagged(kind)[0]).lower()
    return default if word == "empty" else word


def _is_default(variable: Variable) -> bool:
    """Return whether the binding is the value of an input that nothing sets."""
    is_input = variable.causality == "input" and variable.top_level and not variable.protected
    return is_input and isinstance(variable.binding, Literal)


def _with_default(variable: Variable) -> Variable:
    """Return an input of the model with its declared value as start value."""
    return (
        replace(variable, start=variable.binding, binding=None)
        if _is_default(variable)
        else variable
    )


def _is_fixed(flags: list[bool] | bool | None) -> bool | None:
    """Return the attribute `fixed`, or None if it is not given.

    An array is fixed if all its elements are.
    """
    return all(flags) if isinstance(flags, list) else flags


def unroll_equations(json: Json, section: str) -> Iterator[tuple[int, Json]]:
    """Generate the equations of all for-equations that may have placeholders.

    Args:
        json: rumoca's document of the flat model.
        section: The key of the for-equations.

    Yields:
        The index in the list of equations, and the equation that belongs there.
    """
    for family in json[section]:
        if not family["interiors_materialized"]:
            yield from _unroll(family)


def _unroll(family: Json) -> Iterator[tuple[int, Json]]:
    """Generate the equations for all combinations of the loop indices.

    The last index varies fastest.
    """
    binders = family["domain"]["binders"]
    ranges = [
        range(b["lower"], b["upper"] + (1 if b["step"] > 0 else -1), b["step"]) for b in binders
    ]
    bodies = family["template"]["body"]
    for number, (indices, body) in enumerate(product(product(*ranges), bodies)):
        yield (
            family["first_equation_index"] + number,
            _substitute_indices(
                body,
                dict(zip([binder["display_name"] for binder in binders], indices, strict=True)),
            ),
        )


def _substitute_indices(node: Any, indices: Mapping[str, int]) -> Any:
    """Return the tree with the loop indices replaced by numbers."""
    if isinstance(node, list):
        return [_substitute_indices(item, indices) for item in node]
    if not isinstance(node, dict):
        return node
    if "VarRef" in node and (number := indices.get(node["VarRef"]["name"]["name"])) is not None:
        return {"Literal": {"value": {"Integer": number}}}
    return {key: _substitute_indices(value, indices) for key, value in node.items()}
