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
    EdgeDetector,
    Expression,
    IfStatement,
    Literal,
    Model,
    Name,
    Statement,
    When,
    derivative_name,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import assigned_references, pre_references, read_references, rewrite, walk
from .matching import ScalarKey, match_equations, match_initial_equations, scalar_keys
from .topological_sort import Node, merge_statements, required_nodes, sort_topologically
from .when_conditions import Clock, WhenConditions, tick_flag

_TRUE = Literal(True, "Boolean")
_ZERO = {"Real": Literal(0.0, "Real"), "Integer": Literal(0, "Integer"), "Boolean": Literal(False, "Boolean")}


@dataclass(frozen=True)
class Schedule:
    """What is computed, in order. `watches` counts the conditions behind the flags risen(k)."""

    clocks: Sequence[Clock]
    edge_detector_count: int
    initialization: Body
    event: Body
    derivatives: Body


def start_value(model: Model, name: str) -> Expression:
    """The start expression of a variable; without one zero, false or the first literal."""
    variable = model.variables[name]
    return variable.start or _ZERO.get(variable.type, Literal(1, "Enumeration"))


def pre_variables(model: Model, body: Body) -> list[str]:
    """The variables whose value before the event the statements need, in order of declaration."""
    wanted = {name for name, _ in pre_references(body)}
    return [name for name in model.variables if name in wanted]


def finite_variables(model: Model, plan: Schedule) -> list[str]:
    """The Real variables that must stay finite: outputs, states, and what is remembered from event to event."""
    kept = {*pre_variables(model, plan.event), *model.states}
    return [
        v.name
        for v in model.variables.values()
        if v.type == "Real" and (v.name in kept or (v.causality == "output" and v.top_level)) and v.variability != "parameter"
    ]


def build_schedule(model: Model) -> Schedule:
    """Sort the model. Raises InputError for algebraic loops, variables defined twice or never, and pre() in wrong places."""
    _check_pre_usage(model)
    triggers = WhenConditions(model)
    given = {referenced_variable(target) for target in assigned_references((model.whens, model.algorithms))} | set(model.states)
    continuous = match_equations(model, given)
    event = [*_event_nodes(model, triggers), *(_make_node(model, (assign,)) for assign in continuous)]
    event += [_make_node(model, (_with_states_before_reinit(model, watch),)) for watch in triggers.edge_detectors]
    start = [
        *_initial_nodes(model, triggers),
        *(_make_node(model, (a,)) for a in (*continuous, *match_initial_equations(model, given))),
    ]
    start += [_make_node(model, (watch,)) for watch in triggers.edge_detectors]
    ticks = merge_statements(sort_topologically(event))
    if len(triggers.clocks) == 1 and not model.states:
        ticks = _remove_clock_condition(ticks)
    return Schedule(
        triggers.clocks,
        len(triggers.edge_detectors),
        _substitute_initial(merge_statements(sort_topologically(start)), True),
        _substitute_initial(_remove_unused_detectors(ticks), False),
        _substitute_initial(_derivatives(model, continuous), False),
    )


def _with_states_before_reinit(model: Model, watch: EdgeDetector) -> EdgeDetector:
    """The condition on states as they were before a reinit(), which may itself depend on the condition."""
    jumping = {referenced_variable(target) for target in assigned_references(model.whens)} & set(model.states)
    return rewrite(watch, lambda node: Builtin("pre", (node,)) if isinstance(node, Name) and node.name in jumping else node)


def _derivatives(model: Model, continuous: Iterable[Assign]) -> Body:
    """The equations and algorithms from which the derivatives of the states follow while no when-clause is active."""
    nodes = [_make_node(model, (assign,)) for assign in continuous]
    nodes += [node for body in model.algorithms for node in _algorithm_nodes(model, body, lambda _: ())]
    wanted = {key for name in model.states for key in scalar_keys(model.variables, Name(derivative_name(name)))}
    return merge_statements(required_nodes(sort_topologically(nodes), wanted))


def _check_pre_usage(model: Model) -> None:
    """Outside when-clauses pre() would ask for event iteration."""
    outside = [s for body in model.algorithms for s in body if not isinstance(s, When)]
    for name, call in pre_references((model.equations, tuple(outside), model.asserts)):
        raise_model_error(
            f"{call.name}({name}) outside a when-clause is not supported; move the equation into `when sample`", call.where
        )


def _make_node(model: Model, statements: Body, own: Iterable[str] = ()) -> Node:
    """`own` are variables that the statements read as they assign them, in order."""
    written = {
        key
        for target in assigned_references(statements)
        for key in scalar_keys(model.variables, Name(referenced_variable(target)))
    }
    if len(statements) == 1 and isinstance(statements[0], Assign):
        written = scalar_keys(model.variables, statements[0].target)
    read = {key for reference in read_references(statements) for key in scalar_keys(model.variables, reference)}
    flags = {_edge_flag(item.arguments[0]) for item in walk(statements) if isinstance(item, Builtin) and item.name == "risen"}
    watched = {_edge_flag(Literal(s.index, "Integer")) for s in statements if isinstance(s, EdgeDetector)}
    return Node(statements, {key for key in read if key[0] not in own} | flags, written | watched)


def _edge_flag(index: Expression) -> ScalarKey:
    """The flag risen(index) as something that is written and read like a variable."""
    return "risen", int(index.value) if isinstance(index, Literal) else 0


def _event_nodes(model: Model, triggers: WhenConditions) -> Iterator[Node]:
    for when in model.whens:
        yield from _split_by_target(model, triggers.at_event(when))
    for body in model.algorithms:
        yield from _algorithm_nodes(model, body, triggers.at_event)
    yield from (_make_node(model, (statement,)) for statement in model.asserts)


def _initial_nodes(model: Model, triggers: WhenConditions) -> Iterator[Node]:
    for when in model.whens:
        yield from _split_by_target(model, triggers.at_initialization(when))
    for body in (*model.algorithms, *model.initial_algorithms):
        yield from _algorithm_nodes(model, body, triggers.at_initialization)
    yield from (_make_node(model, (statement,)) for statement in model.asserts)


def _algorithm_nodes(model: Model, body: Body, active: Callable[[When], Body]) -> Iterator[Node]:
    """One node, with what is active of its when-clauses; none if nothing is."""
    statements = tuple(item for s in body for item in (active(s) if isinstance(s, When) else (s,)))
    if statements:
        yield _make_node(model, statements, {referenced_variable(target) for target in assigned_references(statements)})


def _split_by_target(model: Model, statements: Body) -> Iterator[Node]:
    """One node for each variable that equations assign, since they have no order; and one for the assertions."""
    for name in dict.fromkeys(referenced_variable(target) for target in assigned_references(statements)):
        yield _make_node(model, _filter_statements(statements, lambda s, name=name: isinstance(s, Assign) and s.name == name))  # type: ignore[misc]
    asserts = _filter_statements(statements, lambda s: isinstance(s, Assert))
    if asserts:
        yield _make_node(model, asserts)


def _filter_statements(statements: Body, wanted: Callable[[Statement], bool]) -> Body:
    """The wanted statements, with the `if` around them."""
    kept: list[Statement] = []
    for statement in statements:
        if isinstance(statement, IfStatement):
            branches = [(condition, _filter_statements(body, wanted)) for condition, body in statement.branches]
            otherwise = _filter_statements(statement.otherwise, wanted)
            while branches and not otherwise and not branches[-1][1]:
                branches.pop()
            if branches:
                kept.append(IfStatement(tuple(branches), otherwise, statement.where))
        elif wanted(statement):
            kept.append(statement)
    return tuple(kept)


def _remove_clock_condition(body: Body) -> Body:
    """Where there is a single clock it ticks in every event."""
    known = rewrite(body, lambda node: _TRUE if node == tick_flag(0) else node)
    inner = (s.branches[0][1] if isinstance(s, IfStatement) and _is_always_true(s.branches[0][0]) else (s,) for s in known)
    return tuple(statement for statements in inner for statement in statements)


def _remove_unused_detectors(body: Body) -> Body:
    """Nobody asks for a condition that stands beside a clock that always ticks."""
    asked = {item.arguments[0] for item in walk(body) if isinstance(item, Builtin) and item.name == "risen"}
    return tuple(s for s in body if not (isinstance(s, EdgeDetector) and Literal(s.index, "Integer") not in asked))


def _is_always_true(condition: Expression) -> bool:
    if isinstance(condition, Binary) and condition.operator == "or":
        return _is_always_true(condition.left) or _is_always_true(condition.right)
    return condition == _TRUE


def _substitute_initial(body: Body, value: bool) -> Body:
    """initial() has become a constant."""
    return rewrite(body, lambda node: Literal(value, "Boolean") if node == Builtin("initial", ()) else node)
