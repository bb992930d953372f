"""Nodes of statements that read and write variables, and the order in which they can be computed."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ..model.flat_model import Body, IfStatement, SourceLocation, Statement, owning_component, raise_model_error
from ..model.traversal import has_builtin
from .matching import ScalarKey


@dataclass(eq=False)
class Node:
    """Statements that stay together."""

    statements: Body
    reads: set[ScalarKey]
    writes: set[ScalarKey]

    @property
    def where(self) -> SourceLocation | None:
        return self.statements[0].where


def sort_topologically(nodes: list[Node]) -> list[Node]:
    """Every node after those that define what it reads; else in the given order, but when-clauses kept together."""
    definer: dict[ScalarKey, Node] = {}
    for node in nodes:
        for key in sorted(node.writes):
            if key in definer:
                raise_model_error(f"{key[0]} is defined twice, first at {definer[key].where}", node.where)
            definer[key] = node
    needs = {node: {definer[key] for key in node.reads if key in definer} for node in nodes}
    left, done, order = list(nodes), set[Node](), list[Node]()
    while left:
        ready = [node for node in left if needs[node] <= done]
        if not ready:
            _raise_algebraic_loop(left, needs)
        node = min(ready, key=lambda n: _placement_cost(order[-1], n)) if order else ready[0]
        order.append(node)
        done.add(node)
        left.remove(node)
    return order


def required_nodes(order: list[Node], wanted: set[ScalarKey]) -> list[Node]:
    """Of nodes in order, those without which the wanted values cannot be computed."""
    kept, open_keys = list[Node](), set(wanted)
    for node in reversed(order):
        if node.writes & open_keys:
            kept.append(node)
            open_keys |= node.reads
    return kept[::-1]


def merge_statements(nodes: list[Node]) -> Body:
    """All statements; neighbours under the same flags share one `if`."""
    result: list[Statement] = []
    for node in nodes:
        last, first = result[-1:], node.statements[0]
        if isinstance(first, IfStatement) and last and isinstance(last[0], IfStatement) and _mergeable((*last,), node.statements):
            bodies = zip(last[0].branches, first.branches, strict=True)
            result[-1] = replace(first, branches=tuple((flag, (*body, *more)) for (flag, body), (_, more) in bodies))
        else:
            result += node.statements
    return tuple(result)


def _placement_cost(last: Node, node: Node) -> int:
    """How little a node fits behind the last one; the order of equals is that in which they were given."""
    if _mergeable(last.statements, node.statements):
        return 0
    return 1 if _owning_component(last) == _owning_component(node) else 2


def _owning_component(node: Node) -> str:
    return owning_component(min(node.writes, default=("", 0))[0])


def _raise_algebraic_loop(left: list[Node], needs: dict[Node, set[Node]]) -> None:
    chain = [left[0]]
    while chain[-1] not in chain[:-1]:
        chain.append(next(node for node in left if node in needs[chain[-1]]))
    loop = chain[chain.index(chain[-1]) :]
    steps = " -> ".join(f"{min(node.writes)[0]} ({node.where.file_and_line if node.where else '?'})" for node in reversed(loop))
    raise_model_error(f"algebraic loop: {steps}; break it with pre()", loop[0].where)


def _mergeable(first: Body, second: Body) -> bool:
    """Whether both are an `if` on the same flags, which nothing in between can change."""
    a, b = first[-1], second[0]
    if not (isinstance(a, IfStatement) and isinstance(b, IfStatement) and len(first) == len(second) == 1):
        return False
    same = [x for x, _ in a.branches] == [y for y, _ in b.branches]
    return same and all(has_builtin(x, "due", "risen") for x, _ in a.branches)
