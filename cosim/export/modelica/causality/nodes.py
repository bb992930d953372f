"""Nodes of the dependency graph: statements with the scalars that they read and write."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from ..model.flat_model import Model
from ..model.syntax_tree import (
    Assert,
    Assign,
    Body,
    Builtin,
    EdgeDetector,
    Expression,
    IfStatement,
    Literal,
    Name,
    Solve,
    Statement,
    When,
    referenced_variable,
)
from ..model.traversal import assigned_references, read_references, walk
from .matching import ScalarKey, scalar_keys
from .topological_sort import Node
from .when_conditions import WhenConditions


def make_node(model: Model, statements: Body, assigned: Iterable[str] = ()) -> Node:
    """Create the node of some statements.

    Reading the variables `assigned`, of an algorithm, creates no dependency.
    """
    written = {
        key
        for target in assigned_references(statements)
        for key in scalar_keys(model.variables, Name(referenced_variable(target)))
    }
    if len(statements) == 1 and isinstance(statements[0], Assign):
        written = scalar_keys(model.variables, statements[0].target)
    if unknowns := [
        target for item in walk(statements) if isinstance(item, Solve) for target in item.unknowns
    ]:
        written = {key for target in unknowns for key in scalar_keys(model.variables, target)}
    read = {
        key
        for reference in read_references(statements)
        for key in scalar_keys(model.variables, reference)
    }
    flags_read = {
        _flag_key(item.arguments[0])
        for item in walk(statements)
        if isinstance(item, Builtin) and item.name == "risen"
    }
    flags_written = {
        _flag_key(Literal(s.index, "Integer")) for s in statements if isinstance(s, EdgeDetector)
    }
    return Node(
        statements,
        {key for key in read if key[0] not in assigned} | (flags_read - flags_written),
        written | flags_written,
    )


def _flag_key(index: Expression) -> ScalarKey:
    """Return the key of the flag risen(index), which is sorted like a variable."""
    return "risen", int(index.number) if isinstance(index, Literal) else 0


def algorithm_nodes(
    model: Model,
    body: Body,
    translate_when: Callable[[When], Body],
    conditions: WhenConditions | None = None,
) -> Iterator[Node]:
    """Yield one node for an algorithm with its when-clauses translated, or none if no statement remains.

    With `conditions`, edge detectors that depend on the algorithm itself become part of it.
    """
    assigned = {referenced_variable(target) for target in assigned_references(body)}
    statements: list[Statement] = []
    for statement in body:
        translated = translate_when(statement) if isinstance(statement, When) else (statement,)
        if conditions and isinstance(statement, When):
            statements += conditions.detectors_in(translated, assigned)
        statements += translated
    if statements:
        yield make_node(
            model,
            tuple(statements),
            {referenced_variable(t) for t in assigned_references(tuple(statements))},
        )


def split_by_target(model: Model, statements: Body) -> Iterator[Node]:
    """Yield one node for each variable that when-equations assign, since they have no order, and one for the assertions."""
    for name in dict.fromkeys(
        referenced_variable(target) for target in assigned_references(statements)
    ):
        yield make_node(model, filter_statements(statements, partial(_assigns, name)))
    asserts = filter_statements(statements, lambda s: isinstance(s, Assert))
    if asserts:
        yield make_node(model, asserts)


def _assigns(name: str, statement: Statement) -> bool:
    return isinstance(statement, Assign) and statement.name == name


def filter_statements(statements: Body, accepts: Callable[[Statement], bool]) -> Body:
    """Return the accepted statements, inside the if-statements that contain them."""
    result: list[Statement] = []
    for statement in statements:
        if isinstance(statement, IfStatement):
            branches = [
                (condition, filter_statements(body, accepts))
                for condition, body in statement.branches
            ]
            otherwise = filter_statements(statement.otherwise, accepts)
            while branches and not otherwise and not branches[-1][1]:
                branches.pop()
            if branches:
                result.append(IfStatement(tuple(branches), otherwise, statement.where))
        elif accepts(statement):
            result.append(statement)
    return tuple(result)
