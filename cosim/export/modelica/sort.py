"""Causality: in which order everything is computed.

The result is two ordered lists of statements over the flat model, one for the initialization and one for an event (a tick of
a clock). Equations have become assignments, sorted so that every value is computed before it is read; when-clauses have
become `if` on flags (see triggers.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from .flat import (
    Assert,
    Assign,
    Binary,
    Body,
    Builtin,
    Expression,
    IfStatement,
    Literal,
    Model,
    Name,
    Place,
    Statement,
    Watch,
    When,
    base_name,
    refuse,
)
from .matching import Key, keys, match, match_initial
from .triggers import Clock, Triggers, due
from .visit import has_builtin, reads, remembered, rewrite, targets, walk

_TRUE = Literal(True, "Boolean")
_ZERO = {"Real": Literal(0.0, "Real"), "Integer": Literal(0, "Integer"), "Boolean": Literal(False, "Boolean")}


@dataclass(frozen=True)
class Plan:
    """What is computed, in order. `watches` counts the conditions behind the flags risen(k)."""

    clocks: Sequence[Clock]
    watches: int
    initialization: Body
    event: Body


@dataclass(eq=False)
class _Node:
    """Statements that stay together."""

    statements: Body
    reads: set[Key]
    writes: set[Key]

    @property
    def where(self) -> Place | None:
        return self.statements[0].where


def start_value(model: Model, name: str) -> Expression:
    """The start expression of a variable; without one zero, false or the first literal."""
    variable = model.variables[name]
    return variable.start or _ZERO.get(variable.type, Literal(1, "Enumeration"))


def memory(model: Model, body: Body) -> list[str]:
    """The variables whose value before the event the statements need, in order of declaration."""
    wanted = {name for name, _ in remembered(body)}
    return [name for name in model.variables if name in wanted]


def finite(model: Model, plan: Plan) -> list[str]:
    """The Real variables that must stay finite: outputs, and what is remembered from event to event."""
    kept = set(memory(model, plan.event))
    return [
        v.name
        for v in model.variables.values()
        if v.type == "Real" and (v.name in kept or (v.causality == "output" and v.top_level)) and v.variability != "parameter"
    ]


def plan(model: Model) -> Plan:
    """Sort the model. Raises InputError for algebraic loops, variables defined twice or never, and pre() in wrong places."""
    _check_memory(model)
    triggers = Triggers(model)
    assigned = {base_name(target) for target in targets((model.whens, model.algorithms))}
    continuous = match(model, assigned)
    event = [*_event_nodes(model, triggers), *(_node(model, (assign,)) for assign in continuous)]
    event += [_node(model, (watch,)) for watch in triggers.watches]
    start = [*_initial_nodes(model, triggers), *(_node(model, (a,)) for a in (*continuous, *match_initial(model, assigned)))]
    start += [_node(model, (watch,)) for watch in triggers.watches]
    ticks = _statements(_sorted(event))
    if len(triggers.clocks) == 1:
        ticks = _unconditional(ticks)
    return Plan(
        triggers.clocks,
        len(triggers.watches),
        _with_initial(_statements(_sorted(start)), True),
        _with_initial(_without_idle_watches(ticks), False),
    )


def _check_memory(model: Model) -> None:
    """Outside when-clauses pre() would ask for event iteration."""
    outside = [s for body in model.algorithms for s in body if not isinstance(s, When)]
    for name, call in remembered((model.equations, tuple(outside), model.asserts)):
        refuse(f"{call.name}({name}) outside a when-clause is not supported; move the equation into `when sample`", call.where)


def _node(model: Model, statements: Body, own: Iterable[str] = ()) -> _Node:
    """`own` are variables that the statements read as they assign them, in order."""
    written = {key for target in targets(statements) for key in keys(model.variables, Name(base_name(target)))}
    if len(statements) == 1 and isinstance(statements[0], Assign):
        written = keys(model.variables, statements[0].target)
    read = {key for reference in reads(statements) for key in keys(model.variables, reference)}
    flags = {_flag(item.arguments[0]) for item in walk(statements) if isinstance(item, Builtin) and item.name == "risen"}
    watched = {_flag(Literal(s.index, "Integer")) for s in statements if isinstance(s, Watch)}
    return _Node(statements, {key for key in read if key[0] not in own} | flags, written | watched)


def _flag(index: Expression) -> Key:
    """The flag risen(index) as something that is written and read like a variable."""
    return "risen", int(index.value) if isinstance(index, Literal) else 0


def _event_nodes(model: Model, triggers: Triggers) -> Iterator[_Node]:
    for when in model.whens:
        yield from _split(model, triggers.at_event(when))
    for body in model.algorithms:
        yield from _algorithm(model, body, triggers.at_event)
    yield from (_node(model, (statement,)) for statement in model.asserts)


def _initial_nodes(model: Model, triggers: Triggers) -> Iterator[_Node]:
    for when in model.whens:
        yield from _split(model, triggers.at_initialization(when))
    for body in (*model.algorithms, *model.initial_algorithms):
        yield from _algorithm(model, body, triggers.at_initialization)
    yield from (_node(model, (statement,)) for statement in model.asserts)


def _algorithm(model: Model, body: Body, active: Callable[[When], Body]) -> Iterator[_Node]:
    """One node, with what is active of its when-clauses; none if nothing is."""
    statements = tuple(item for s in body for item in (active(s) if isinstance(s, When) else (s,)))
    if statements:
        yield _node(model, statements, {base_name(target) for target in targets(statements)})


def _split(model: Model, statements: Body) -> Iterator[_Node]:
    """One node for each variable that equations assign, since they have no order; and one for the assertions."""
    for name in dict.fromkeys(base_name(target) for target in targets(statements)):
        yield _node(model, _keep(statements, lambda s, name=name: isinstance(s, Assign) and s.name == name))  # type: ignore[misc]
    asserts = _keep(statements, lambda s: isinstance(s, Assert))
    if asserts:
        yield _node(model, asserts)


def _keep(statements: Body, wanted: Callable[[Statement], bool]) -> Body:
    """The wanted statements, with the `if` around them."""
    kept: list[Statement] = []
    for statement in statements:
        if isinstance(statement, IfStatement):
            branches = [(condition, _keep(body, wanted)) for condition, body in statement.branches]
            otherwise = _keep(statement.otherwise, wanted)
            while branches and not otherwise and not branches[-1][1]:
                branches.pop()
            if branches:
                kept.append(IfStatement(tuple(branches), otherwise, statement.where))
        elif wanted(statement):
            kept.append(statement)
    return tuple(kept)


def _sorted(nodes: list[_Node]) -> list[_Node]:
    """Every node after those that define what it reads; else in the given order, but when-clauses kept together."""
    definer: dict[Key, _Node] = {}
    for node in nodes:
        for key in sorted(node.writes):
            if key in definer:
                refuse(f"{key[0]} is defined twice, first at {definer[key].where}", node.where)
            definer[key] = node
    needs = {node: {definer[key] for key in node.reads if key in definer} for node in nodes}
    left, done, order = list(nodes), set[_Node](), list[_Node]()
    while left:
        ready = [node for node in left if needs[node] <= done]
        if not ready:
            _refuse_loop(left, needs)
        node = min(ready, key=lambda n: _distance(order[-1], n)) if order else ready[0]
        order.append(node)
        done.add(node)
        left.remove(node)
    return order


def _distance(last: _Node, node: _Node) -> int:
    """How little a node fits behind the last one; the order of equals is that in which they were given."""
    if _mergeable(last.statements, node.statements):
        return 0
    return 1 if _owner(last) == _owner(node) else 2


def _owner(node: _Node) -> str:
    return min(node.writes, default=("", 0))[0].rpartition(".")[0]


def _refuse_loop(left: list[_Node], needs: dict[_Node, set[_Node]]) -> None:
    chain = [left[0]]
    while chain[-1] not in chain[:-1]:
        chain.append(next(node for node in left if node in needs[chain[-1]]))
    loop = chain[chain.index(chain[-1]) :]
    steps = " -> ".join(f"{min(node.writes)[0]} ({node.where.short if node.where else '?'})" for node in reversed(loop))
    refuse(f"algebraic loop: {steps}; break it with pre()", loop[0].where)


def _mergeable(first: Body, second: Body) -> bool:
    """Whether both are an `if` on the same flags, which nothing in between can change."""
    a, b = first[-1], second[0]
    if not (isinstance(a, IfStatement) and isinstance(b, IfStatement) and len(first) == len(second) == 1):
        return False
    same = [x for x, _ in a.branches] == [y for y, _ in b.branches]
    return same and all(has_builtin(x, "due", "risen") for x, _ in a.branches)


def _statements(nodes: list[_Node]) -> Body:
    """All statements; neighbours under the same flags share one `if`."""
    merged: list[Statement] = []
    for node in nodes:
        last, first = merged[-1:], node.statements[0]
        if isinstance(first, IfStatement) and last and isinstance(last[0], IfStatement) and _mergeable((*last,), node.statements):
            bodies = zip(last[0].branches, first.branches, strict=True)
            merged[-1] = replace(first, branches=tuple((flag, (*body, *more)) for (flag, body), (_, more) in bodies))
        else:
            merged += node.statements
    return tuple(merged)


def _unconditional(body: Body) -> Body:
    """Where there is a single clock it ticks in every event."""
    known = rewrite(body, lambda node: _TRUE if node == due(0) else node)
    inner = (s.branches[0][1] if isinstance(s, IfStatement) and _is_certain(s.branches[0][0]) else (s,) for s in known)
    return tuple(statement for statements in inner for statement in statements)


def _without_idle_watches(body: Body) -> Body:
    """Nobody asks for a condition that stands beside a clock that always ticks."""
    asked = {item.arguments[0] for item in walk(body) if isinstance(item, Builtin) and item.name == "risen"}
    return tuple(s for s in body if not (isinstance(s, Watch) and Literal(s.index, "Integer") not in asked))


def _is_certain(condition: Expression) -> bool:
    if isinstance(condition, Binary) and condition.operator == "or":
        return _is_certain(condition.left) or _is_certain(condition.right)
    return condition == _TRUE


def _with_initial(body: Body, value: bool) -> Body:
    """initial() has become a constant."""
    return rewrite(body, lambda node: Literal(value, "Boolean") if node == Builtin("initial", ()) else node)
