"""Dependency graph of statements: nodes with the scalars that they read and write.

A statement follows all statements that write what it reads. The topological order (Kahn 1962)
prefers nodes that continue the previous one, so that the C code keeps components together.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

from ..model.flat_model import Model, owning_component
from ..model.scalars import ScalarKey, scalar_keys, scalars_in, scalars_of, scalars_read
from ..model.syntax_tree import (
    Assert,
    Assign,
    Body,
    EdgeDetector,
    Expression,
    IfStatement,
    Literal,
    Solve,
    SourceLocation,
    Statement,
    When,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import assigned_names, assigned_references, has_builtin, is_call, walk
from .when_conditions import WhenConditions


@dataclass(eq=False)
class Node:
    """Node of the dependency graph.

    Statements that are not separated, with the scalars that they read and write.
    """

    statements: Body
    reads: set[ScalarKey]
    writes: set[ScalarKey]

    @property
    def where(self) -> SourceLocation | None:
        """Location of the first statement."""
        return self.statements[0].where


def sort_topologically(nodes: list[Node]) -> list[Node]:
    """Sort nodes so that every node follows the nodes that write the variables that it reads.

    Among the nodes that could be next, one that can be merged with the previous node comes first,
    then one of the same component; otherwise the given order is preserved.

    Raises:
        InputError: A scalar is written by two nodes, or there is an algebraic loop.
    """
    writers: dict[ScalarKey, Node] = {}
    for node in nodes:
        for key in sorted(node.writes):
            if key in writers:
                raise_model_error(
                    f"{key[0]} is defined twice, first at {writers[key].where}", node.where
                )
            writers[key] = node
    dependencies = {}
    for node in nodes:
        dependencies[node] = {writers[key] for key in node.reads if key in writers}
    remaining, done, order = list(nodes), set[Node](), list[Node]()
    while remaining:
        ready = [node for node in remaining if dependencies[node] <= done]
        if not ready:
            _raise_algebraic_loop(remaining, dependencies)
        node = min(ready, key=lambda n: _placement_cost(order[-1], n)) if order else ready[0]
        order.append(node)
        done.add(node)
        remaining.remove(node)
    return order


def required_nodes(order: list[Node], results: set[ScalarKey]) -> list[Node]:
    """Return the sorted nodes that are needed to compute the results."""
    required, needed_keys = list[Node](), set(results)
    for node in reversed(order):
        if node.writes & needed_keys:
            required.append(node)
            needed_keys |= node.reads
    return required[::-1]


def merge_statements(nodes: list[Node]) -> Body:
    """Return all statements; adjacent if-statements on the same event flags are merged."""
    result: list[Statement] = []
    for node in nodes:
        last, first = result[-1] if result else None, node.statements[0]
        if (
            isinstance(first, IfStatement)
            and isinstance(last, IfStatement)
            and _mergeable((last,), node.statements)
        ):
            bodies = zip(last.branches, first.branches, strict=True)
            result[-1] = replace(
                first,
                branches=tuple((flag, (*body, *added)) for (flag, body), (_, added) in bodies),
            )
        else:
            result += node.statements
    return tuple(result)


def _placement_cost(last: Node, node: Node) -> int:
    """Return the priority of a node after the last one.

    0 if both can be merged, 1 for the same component, else 2.
    """
    if _mergeable(last.statements, node.statements):
        return 0
    return 1 if _owning_component(last) == _owning_component(node) else 2


def _owning_component(node: Node) -> str:
    return owning_component(min(node.writes, default=("", 0))[0])


def _raise_algebraic_loop(remaining: list[Node], dependencies: dict[Node, set[Node]]) -> None:
    chain = [remaining[0]]
    while chain[-1] not in chain[:-1]:
        chain.append(next(node for node in remaining if node in dependencies[chain[-1]]))
    loop = chain[chain.index(chain[-1]) :]
    steps = " -> ".join(
        f"{min(node.writes)[0]} ({node.where.file_and_line if node.where else '?'})"
        for node in reversed(loop)
    )
    raise_model_error(f"algebraic loop: {steps}; break it with pre()", loop[0].where)


def _mergeable(first: Body, second: Body) -> bool:
    """Return whether both are single if-statements on the same event flags.

    These flags are constant during an event.
    """
    a, b = first[-1], second[0]
    if not (
        isinstance(a, IfStatement) and isinstance(b, IfStatement) and len(first) == len(second) == 1
    ):
        return False
    same_conditions = [x for x, _ in a.branches] == [y for y, _ in b.branches]
    return same_conditions and all(has_builtin(x, "due", "risen") for x, _ in a.branches)


def make_node(model: Model, statements: Body, assigned: Iterable[str] = ()) -> Node:
    """Create the node of some statements.

    Reading the variables `assigned`, of an algorithm, creates no dependency.
    """
    if len(statements) == 1 and isinstance(statements[0], Assign):
        written = scalar_keys(model.variables, statements[0].target)
    else:
        solved = [item.unknowns for item in walk(statements) if isinstance(item, Solve)]
        targets = assigned_references(statements)
        written = scalars_in(model, chain.from_iterable(solved)) or scalars_of(
            model, map(referenced_variable, targets)
        )
    read = scalars_read(model, statements)
    flags_read = {
        _flag_key(item.arguments[0]) for item in walk(statements) if is_call(item, "risen")
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
    """Yield the node of an algorithm with translated when-clauses, if a statement remains.

    With `conditions`, edge detectors that depend on the algorithm itself become part of it.
    """
    assigned = assigned_names(body)
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
            assigned_names(tuple(statements)),
        )


def split_by_target(model: Model, statements: Body) -> Iterator[Node]:
    """Yield one node for each variable that when-equations assign, and one for assertions.

    When-equations have no order.
    """
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
