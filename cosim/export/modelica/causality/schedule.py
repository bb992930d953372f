"""Causality analysis: the order of computation of a flat model.

The result is three lists of statements: for the initialization, for an event (a clock tick or the end of a step), and for the
derivatives of the continuous states between events. Equations have become assignments, sorted topologically so that every value
is computed before it is read. When-clauses have become if-statements on event flags (see `when_conditions`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from ..model.flat_model import Model, derivative_name
from ..model.syntax_tree import (
    Assert,
    Assign,
    Binary,
    Body,
    Builtin,
    EdgeDetector,
    Expression,
    IfStatement,
    Literal,
    Name,
    Reinit,
    Solve,
    Statement,
    When,
    referenced_variable,
)
from ..model.traversal import (
    assigned_references,
    has_builtin,
    pre_references,
    read_references,
    rewrite,
    rewrite_outermost,
    variable_names,
    walk,
)
from .continuous_equations import solve_equations, solve_initial_equations
from .hybrid import delay_number
from .matching import ScalarKey, scalar_keys
from .topological_sort import Node, merge_statements, required_nodes, sort_topologically
from .when_conditions import Clock, WhenConditions, tick_flag

_TRUE, _FALSE = Literal(True, "Boolean"), Literal(False, "Boolean")
_ZERO = {"Real": Literal(0.0, "Real"), "Integer": Literal(0, "Integer"), "Boolean": Literal(False, "Boolean")}


@dataclass(frozen=True)
class Schedule:
    """The order of computation of a model."""

    clocks: Sequence[Clock]
    #: number of the flags risen(k)
    edge_detector_count: int
    #: statements for the initialization
    initialization: Body
    #: statements for a clock tick or the end of a step
    event: Body
    #: statements that compute the derivatives of the continuous states between events
    derivatives: Body
    #: statements that compute the operands of relations between events
    indicators: Body


def start_value(model: Model, name: str) -> Expression:
    """Return the start expression of a variable; the default is zero, false or the first enumeration literal."""
    variable = model.variables[name]
    return variable.start or _ZERO.get(variable.type, Literal(1, "Enumeration"))


def pre_variables(model: Model, body: Body) -> list[str]:
    """Return the variables of which the statements use the value before the event, in order of declaration."""
    used = {name for name, _ in pre_references(body)}
    return [name for name in model.variables if name in used]


def finite_variables(model: Model, schedule: Schedule) -> list[str]:
    """Return the Real variables that must remain finite: outputs, continuous states and arguments of pre()."""
    stored = {*pre_variables(model, schedule.event), *model.states}
    return [
        v.name
        for v in model.variables.values()
        if v.type == "Real" and (v.name in stored or (v.causality == "output" and v.top_level)) and v.variability != "parameter"
    ]


def build_schedule(model: Model) -> Schedule:
    """Determine the order of computation of a model.

    Raises:
        InputError: The equations do not determine the variables, or a variable is defined twice.
    """
    conditions = WhenConditions(model)
    model = _with_tick_flags(model, conditions)
    assigned = {referenced_variable(target) for target in assigned_references((model.whens, model.algorithms))}
    assigned |= {*model.states, *model.initialized}
    continuous, held = solve_equations(model, assigned)
    events = [*_event_nodes(model, conditions), *(_make_node(model, (statement,)) for statement in continuous)]
    initial = _initial_nodes(model, conditions)
    solved, initially_held = solve_initial_equations(model, assigned, continuous, _written(initial))
    initial += [_make_node(model, (statement,)) for statement in solved]
    for nodes, constant in ((events, held), (initial, initially_held)):
        separate = [d for d in conditions.edge_detectors if nodes is initial or d.index not in conditions.in_place]
        nodes += [_make_node(model, (detector,)) for detector in separate]
        for node in nodes:
            node.reads -= constant
    event_body = merge_statements(sort_topologically(events))
    if len(conditions.clocks) == 1 and not model.states and not model.hybrid:
        event_body = _remove_clock_condition(event_body)
    derivatives, indicators = _between_events(model, continuous, held)
    return Schedule(
        conditions.clocks,
        len(conditions.edge_detectors),
        _at_initialization(model, merge_statements(sort_topologically(initial))),
        _substitute_initial(_remove_unused_detectors((*event_body, *_reinits(model, conditions))), False),
        _substitute_initial(derivatives, False),
        _substitute_initial(indicators, False),
    )


def _with_tick_flags(model: Model, conditions: WhenConditions) -> Model:
    """Replace sample() outside conditions of when-clauses by event flags."""
    if not model.hybrid:
        return model

    def change(node: Any) -> Any:
        return node if isinstance(node, When) else conditions.as_tick_flag(node)

    sections = ("equations", "algorithms", "asserts")
    return replace(model, **{section: rewrite_outermost(getattr(model, section), change) for section in sections})


def _at_initialization(model: Model, body: Body) -> Body:
    """Replace initial() by true, tick flags by false, and delayed values by the present ones."""

    def change(node: Any) -> Any:
        if isinstance(node, Builtin) and node.name == "due":
            return _FALSE
        if isinstance(node, Builtin) and node.name == "past":
            assert model.hybrid
            return Name(model.hybrid.delays[delay_number(node)].name)
        return node

    result: Body = _substitute_initial(rewrite(body, change) if model.hybrid else body, True)
    return result


def _reinits(model: Model, conditions: WhenConditions) -> Body:
    """Return the assignments of reinit(), which follow all others."""
    bodies = [
        conditions.at_event(when) for when in (*model.whens, *(s for b in model.algorithms for s in b if isinstance(s, When)))
    ]
    selected = (_filter_statements(body, lambda s: isinstance(s, Reinit)) for body in bodies)
    return tuple(rewrite_outermost(tuple(s for body in selected for s in body), _as_assignment))


def _as_assignment(node: Any) -> Any:
    return Assign(node.target, node.value, node.where) if isinstance(node, Reinit) else None


def _between_events(model: Model, continuous: Iterable[Assign | Solve], held: set[ScalarKey]) -> tuple[Body, Body]:
    """Return the statements for the derivatives of the states, and those for the operands of relations."""
    statements = [s for s in continuous if not (model.hybrid and _is_discrete(model, s))]
    nodes = [_make_node(model, (_without_ticks(statement),)) for statement in statements]
    nodes += [node for body in model.algorithms for node in _algorithm_nodes(model, body, lambda _: ())]
    for node in nodes:
        node.reads -= held
    required = {key for name in model.states for key in scalar_keys(model.variables, Name(derivative_name(name)))}
    order = sort_topologically(nodes)
    if not model.hybrid:
        return merge_statements(required_nodes(order, required)), ()
    required |= {(delay.name, 0) for delay in model.hybrid.delays}
    operands = {
        key
        for reference in read_references(tuple(relation.condition for relation in model.hybrid.relations))
        for key in scalar_keys(model.variables, reference)
    }
    order = _varying(model, order)
    return merge_statements(required_nodes(order, required)), merge_statements(required_nodes(order, operands))


def _varying(model: Model, order: Iterable[Node]) -> list[Node]:
    """Return the sorted nodes whose values change between events, because they depend on states or on the time."""
    changing = {key for name in model.states for key in scalar_keys(model.variables, Name(name))}
    nodes = []
    for node in order:
        if node.reads & changing or "time" in variable_names(node.statements) or has_builtin(node.statements, "past"):
            changing |= node.writes
            nodes.append(node)
    return nodes


def _without_ticks(statement: Statement) -> Statement:
    def change(node: Any) -> Any:
        return _FALSE if isinstance(node, Builtin) and node.name == "due" else node

    result: Statement = rewrite(statement, change)
    return result


def _is_discrete(model: Model, statement: Assign | Solve) -> bool:
    return isinstance(statement, Assign) and model.variables[statement.name].type != "Real"


def _written(nodes: Iterable[Node]) -> set[ScalarKey]:
    return {key for node in nodes for key in node.writes}


def _make_node(model: Model, statements: Body, assigned: Iterable[str] = ()) -> Node:
    """Create the node of some statements; reading the variables `assigned`, of an algorithm, creates no dependency."""
    written = {
        key
        for target in assigned_references(statements)
        for key in scalar_keys(model.variables, Name(referenced_variable(target)))
    }
    if len(statements) == 1 and isinstance(statements[0], Assign):
        written = scalar_keys(model.variables, statements[0].target)
    if len(statements) == 1 and isinstance(statements[0], Solve):
        written = {key for target in statements[0].unknowns for key in scalar_keys(model.variables, target)}
    read = {key for reference in read_references(statements) for key in scalar_keys(model.variables, reference)}
    flags_read = {_flag_key(item.arguments[0]) for item in walk(statements) if isinstance(item, Builtin) and item.name == "risen"}
    flags_written = {_flag_key(Literal(s.index, "Integer")) for s in statements if isinstance(s, EdgeDetector)}
    return Node(
        statements, {key for key in read if key[0] not in assigned} | (flags_read - flags_written), written | flags_written
    )


def _flag_key(index: Expression) -> ScalarKey:
    """Return the key of the flag risen(index), which is sorted like a variable."""
    return "risen", int(index.number) if isinstance(index, Literal) else 0


def _event_nodes(model: Model, conditions: WhenConditions) -> Iterator[Node]:
    for when in model.whens:
        yield from _split_by_target(model, conditions.at_event(when))
    for body in model.algorithms:
        yield from _algorithm_nodes(model, body, conditions.at_event, conditions)
    yield from (_make_node(model, (statement,)) for statement in model.asserts)


def _initial_nodes(model: Model, conditions: WhenConditions) -> list[Node]:
    nodes = [node for when in model.whens for node in _split_by_target(model, conditions.at_initialization(when))]
    for body in (*model.algorithms, *model.initial_algorithms):
        nodes += _algorithm_nodes(model, body, conditions.at_initialization)
    return nodes + [_make_node(model, (statement,)) for statement in model.asserts]


def _algorithm_nodes(
    model: Model, body: Body, translate_when: Callable[[When], Body], conditions: WhenConditions | None = None
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
        yield _make_node(model, tuple(statements), {referenced_variable(t) for t in assigned_references(tuple(statements))})


def _split_by_target(model: Model, statements: Body) -> Iterator[Node]:
    """Yield one node for each variable that when-equations assign, since they have no order, and one for the assertions."""
    for name in dict.fromkeys(referenced_variable(target) for target in assigned_references(statements)):
        yield _make_node(model, _filter_statements(statements, partial(_assigns, name)))
    asserts = _filter_statements(statements, lambda s: isinstance(s, Assert))
    if asserts:
        yield _make_node(model, asserts)


def _assigns(name: str, statement: Statement) -> bool:
    return isinstance(statement, Assign) and statement.name == name


def _filter_statements(statements: Body, accepts: Callable[[Statement], bool]) -> Body:
    """Return the accepted statements, inside the if-statements that contain them."""
    result: list[Statement] = []
    for statement in statements:
        if isinstance(statement, IfStatement):
            branches = [(condition, _filter_statements(body, accepts)) for condition, body in statement.branches]
            otherwise = _filter_statements(statement.otherwise, accepts)
            while branches and not otherwise and not branches[-1][1]:
                branches.pop()
            if branches:
                result.append(IfStatement(tuple(branches), otherwise, statement.where))
        elif accepts(statement):
            result.append(statement)
    return tuple(result)


def _remove_clock_condition(body: Body) -> Body:
    """Remove the flag of the only clock: without continuous states, it ticks in every event."""
    simplified = rewrite(body, lambda node: _TRUE if node == tick_flag(0) else node)
    inner = (s.branches[0][1] if isinstance(s, IfStatement) and _is_always_true(s.branches[0][0]) else (s,) for s in simplified)
    return tuple(statement for statements in inner for statement in statements)


def _remove_unused_detectors(body: Body) -> Body:
    """Remove the edge detectors whose flag is not read."""
    read = {item.arguments[0] for item in walk(body) if isinstance(item, Builtin) and item.name == "risen"}
    return tuple(s for s in body if not (isinstance(s, EdgeDetector) and Literal(s.index, "Integer") not in read))


def _is_always_true(condition: Expression) -> bool:
    if isinstance(condition, Binary) and condition.operator == "or":
        return _is_always_true(condition.left) or _is_always_true(condition.right)
    return condition == _TRUE


def _substitute_initial(body: Body, value: bool) -> Body:
    """Replace initial() by a constant."""
    result: Body = rewrite(body, lambda node: Literal(value, "Boolean") if node == Builtin("initial", ()) else node)
    return result
