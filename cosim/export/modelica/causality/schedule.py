"""Causality: in which order everything is computed.

The result is ordered lists of statements over the flat model: one for the initialization, one for an event (a tick of a clock,
or the end of a step), and one for the derivatives of continuous states between events. Equations have become assignments,
sorted so that every value is computed before it is read; when-clauses have become `if` on flags (see triggers.py).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from ..model.flat_model import (
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
    Statement,
    Watch,
    When,
    base_name,
    derivative,
    refuse,
)
from ..model.traversal import reads, remembered, rewrite, targets, walk
from .clocks import Clock, Triggers, due
from .dependencies import Node, in_order, merged, needed
from .matching import Key, keys, match, match_initial

_TRUE = Literal(True, "Boolean")
_ZERO = {"Real": Literal(0.0, "Real"), "Integer": Literal(0, "Integer"), "Boolean": Literal(False, "Boolean")}


@dataclass(frozen=True)
class Plan:
    """What is computed, in order. `watches` counts the conditions behind the flags risen(k)."""

    clocks: Sequence[Clock]
    watches: int
    initialization: Body
    event: Body
    derivatives: Body


def start_value(model: Model, name: str) -> Expression:
    """The start expression of a variable; without one zero, false or the first literal."""
    variable = model.variables[name]
    return variable.start or _ZERO.get(variable.type, Literal(1, "Enumeration"))


def memory(model: Model, body: Body) -> list[str]:
    """The variables whose value before the event the statements need, in order of declaration."""
    wanted = {name for name, _ in remembered(body)}
    return [name for name in model.variables if name in wanted]


def finite(model: Model, plan: Plan) -> list[str]:
    """The Real variables that must stay finite: outputs, states, and what is remembered from event to event."""
    kept = {*memory(model, plan.event), *model.states}
    return [
        v.name
        for v in model.variables.values()
        if v.type == "Real" and (v.name in kept or (v.causality == "output" and v.top_level)) and v.variability != "parameter"
    ]


def plan(model: Model) -> Plan:
    """Sort the model. Raises InputError for algebraic loops, variables defined twice or never, and pre() in wrong places."""
    _check_memory(model)
    triggers = Triggers(model)
    given = {base_name(target) for target in targets((model.whens, model.algorithms))} | set(model.states)
    continuous = match(model, given)
    event = [*_event_nodes(model, triggers), *(_node(model, (assign,)) for assign in continuous)]
    event += [_node(model, (_before_jumps(model, watch),)) for watch in triggers.watches]
    start = [*_initial_nodes(model, triggers), *(_node(model, (a,)) for a in (*continuous, *match_initial(model, given)))]
    start += [_node(model, (watch,)) for watch in triggers.watches]
    ticks = merged(in_order(event))
    if len(triggers.clocks) == 1 and not model.states:
        ticks = _unconditional(ticks)
    return Plan(
        triggers.clocks,
        len(triggers.watches),
        _with_initial(merged(in_order(start)), True),
        _with_initial(_without_idle_watches(ticks), False),
        _with_initial(_derivatives(model, continuous), False),
    )


def _before_jumps(model: Model, watch: Watch) -> Watch:
    """The condition on states as they were before a reinit(), which may itself depend on the condition."""
    jumping = {base_name(target) for target in targets(model.whens)} & set(model.states)
    return rewrite(watch, lambda node: Builtin("pre", (node,)) if isinstance(node, Name) and node.name in jumping else node)


def _derivatives(model: Model, continuous: Iterable[Assign]) -> Body:
    """The equations and algorithms from which the derivatives of the states follow while no when-clause is active."""
    nodes = [_node(model, (assign,)) for assign in continuous]
    nodes += [node for body in model.algorithms for node in _algorithm(model, body, lambda _: ())]
    wanted = {key for name in model.states for key in keys(model.variables, Name(derivative(name)))}
    return merged(needed(in_order(nodes), wanted))


def _check_memory(model: Model) -> None:
    """Outside when-clauses pre() would ask for event iteration."""
    outside = [s for body in model.algorithms for s in body if not isinstance(s, When)]
    for name, call in remembered((model.equations, tuple(outside), model.asserts)):
        refuse(f"{call.name}({name}) outside a when-clause is not supported; move the equation into `when sample`", call.where)


def _node(model: Model, statements: Body, own: Iterable[str] = ()) -> Node:
    """`own` are variables that the statements read as they assign them, in order."""
    written = {key for target in targets(statements) for key in keys(model.variables, Name(base_name(target)))}
    if len(statements) == 1 and isinstance(statements[0], Assign):
        written = keys(model.variables, statements[0].target)
    read = {key for reference in reads(statements) for key in keys(model.variables, reference)}
    flags = {_flag(item.arguments[0]) for item in walk(statements) if isinstance(item, Builtin) and item.name == "risen"}
    watched = {_flag(Literal(s.index, "Integer")) for s in statements if isinstance(s, Watch)}
    return Node(statements, {key for key in read if key[0] not in own} | flags, written | watched)


def _flag(index: Expression) -> Key:
    """The flag risen(index) as something that is written and read like a variable."""
    return "risen", int(index.value) if isinstance(index, Literal) else 0


def _event_nodes(model: Model, triggers: Triggers) -> Iterator[Node]:
    for when in model.whens:
        yield from _split(model, triggers.at_event(when))
    for body in model.algorithms:
        yield from _algorithm(model, body, triggers.at_event)
    yield from (_node(model, (statement,)) for statement in model.asserts)


def _initial_nodes(model: Model, triggers: Triggers) -> Iterator[Node]:
    for when in model.whens:
        yield from _split(model, triggers.at_initialization(when))
    for body in (*model.algorithms, *model.initial_algorithms):
        yield from _algorithm(model, body, triggers.at_initialization)
    yield from (_node(model, (statement,)) for statement in model.asserts)


def _algorithm(model: Model, body: Body, active: Callable[[When], Body]) -> Iterator[Node]:
    """One node, with what is active of its when-clauses; none if nothing is."""
    statements = tuple(item for s in body for item in (active(s) if isinstance(s, When) else (s,)))
    if statements:
        yield _node(model, statements, {base_name(target) for target in targets(statements)})


def _split(model: Model, statements: Body) -> Iterator[Node]:
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
