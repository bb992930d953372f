"""Statements that are executed between events.

Derivatives of states, operands of relations, and all continuous variables.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from ..model.flat_model import Model, derivative_name
from ..model.syntax_tree import Assign, Body, Builtin, Literal, Name, Statement
from ..model.traversal import has_builtin, read_references, rewrite, variable_names
from .matching import ScalarKey, is_input, scalar_keys
from .nodes import algorithm_nodes, make_node
from .topological_sort import Node, merge_statements, required_nodes, sort_topologically


class BetweenEvents(NamedTuple):
    """Statements that are executed between events.

    Attributes:
        derivatives: Those that compute the derivatives of the states and the arguments of delay(),
            with constant inputs.
        indicators: Those that compute the operands of relations, with constant inputs.
        continuous: All variables that change between events, with changing inputs (Model Exchange).
        limits: Those that compute the values of continuous variables before an event, for pre(),
            with constant inputs.
    """

    derivatives: Body
    indicators: Body
    continuous: Body
    limits: Body = ()


def statements_between_events(
    model: Model, continuous: Iterable[Statement], held: set[ScalarKey]
) -> BetweenEvents:
    """Return the statements between events.

    Args:
        model: The model.
        continuous: Its solved equations.
        held: The scalars that keep their values between events.
    """
    statements = [s for s in continuous if not (model.hybrid and _is_discrete(model, s))]
    nodes = [make_node(model, (_without_ticks(statement),)) for statement in statements]
    nodes += [
        node for body in model.algorithms for node in algorithm_nodes(model, body, lambda _: ())
    ]
    for node in nodes:
        node.reads -= held
    required = {
        key
        for name in model.states
        for key in scalar_keys(model.variables, Name(derivative_name(name)))
    }
    order = sort_topologically(nodes)
    if not model.hybrid:
        return BetweenEvents(
            merge_statements(required_nodes(order, required)), (), merge_statements(order)
        )
    required |= {(delay.name, 0) for delay in model.hybrid.delays}
    operands = {
        key
        for reference in read_references(
            tuple(relation.condition for relation in model.hybrid.relations)
        )
        for key in scalar_keys(model.variables, reference)
    }
    varying = _varying(model, order, model.states)
    inputs = [v.name for v in model.variables.values() if is_input(v)]
    remembered = {
        key
        for name in model.hybrid.remembered
        if model.variables[name].type == "Real"
        and name not in {*model.states, *inputs, *model.hybrid.iterated}
        for key in scalar_keys(model.variables, Name(name))
    }
    return BetweenEvents(
        merge_statements(required_nodes(varying, required)),
        merge_statements(required_nodes(varying, operands)),
        merge_statements(_varying(model, order, [*model.states, *inputs])),
        merge_statements(required_nodes(varying, remembered)),
    )


def _varying(model: Model, order: Iterable[Node], sources: Iterable[str]) -> list[Node]:
    """Return the sorted nodes whose values change between events, because they depend on the variables `sources` or on time."""
    changing = {key for name in sources for key in scalar_keys(model.variables, Name(name))}
    nodes = []
    for node in order:
        if (
            node.reads & changing
            or "time" in variable_names(node.statements)
            or has_builtin(node.statements, "past")
        ):
            changing |= node.writes
            nodes.append(node)
    return nodes


def _without_ticks(statement: Statement) -> Statement:
    def change(node: Any) -> Any:
        return (
            Literal(False, "Boolean") if isinstance(node, Builtin) and node.name == "due" else node
        )

    result: Statement = rewrite(statement, change)
    return result


def _is_discrete(model: Model, statement: Statement) -> bool:
    return isinstance(statement, Assign) and model.variables[statement.name].type != "Real"
