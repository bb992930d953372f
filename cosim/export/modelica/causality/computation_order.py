"""Causality analysis: the order of computation of a flat model.

The result is three lists of statements: for the initialization, for an event (a clock tick or the
end of a step), and for the derivatives of the continuous states between events. Equations have
become assignments, sorted topologically so that every value is computed before it is read.
When-clauses have become if-statements on event flags (see `when_conditions`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from ..model.builtin_functions import PRE_OPERATORS
from ..model.flat_model import Model, derivative_name, is_input
from ..model.scalars import ScalarKey, scalars_of, scalars_read
from ..model.syntax_tree import (
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
    Statement,
    When,
    referenced_variable,
)
from ..model.traversal import (
    assigned_names,
    has_builtin,
    is_call,
    rewrite,
    rewrite_outermost,
    variable_names,
    walk,
)
from .continuous_equations import solve_equations, solve_initial_equations
from .dependency_graph import (
    Node,
    algorithm_nodes,
    filter_statements,
    make_node,
    merge_statements,
    required_nodes,
    sort_topologically,
    split_by_target,
)
from .hybrid import delay_number
from .when_conditions import Clock, WhenConditions, tick_flag


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
    between: BetweenEvents


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
    for body in model.algorithms:
        nodes += algorithm_nodes(model, body, lambda _: ())
    for node in nodes:
        node.reads -= held
    required = scalars_of(model, map(derivative_name, model.states))
    order = sort_topologically(nodes)
    if not model.hybrid:
        return BetweenEvents(
            merge_statements(required_nodes(order, required)), (), merge_statements(order)
        )
    required |= {(delay.name, 0) for delay in model.hybrid.delays}
    conditions = tuple(relation.condition for relation in model.hybrid.relations)
    operands = scalars_read(model, conditions)
    varying = _varying(model, order, model.states)
    inputs = [v.name for v in model.variables.values() if is_input(v)]
    others = {*model.states, *inputs, *model.hybrid.iterated}
    remembered = scalars_of(
        model,
        [
            name
            for name in model.hybrid.remembered
            if model.variables[name].type == "Real" and name not in others
        ],
    )
    return BetweenEvents(
        merge_statements(required_nodes(varying, required)),
        merge_statements(required_nodes(varying, operands)),
        merge_statements(_varying(model, order, [*model.states, *inputs])),
        merge_statements(required_nodes(varying, remembered)),
    )


def _varying(model: Model, order: Iterable[Node], sources: Iterable[str]) -> list[Node]:
    """Return the sorted nodes that depend on the variables `sources` or on the time.

    Their values change between events.
    """
    changing = scalars_of(model, sources)
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
        return Literal(False, "Boolean") if is_call(node, "due") else node

    result: Statement = rewrite(statement, change)
    return result


def _is_discrete(model: Model, statement: Statement) -> bool:
    return isinstance(statement, Assign) and model.variables[statement.name].type != "Real"


_TRUE, _FALSE = Literal(True, "Boolean"), Literal(False, "Boolean")
_ZERO = {
    "Real": Literal(0.0, "Real"),
    "Integer": Literal(0, "Integer"),
    "Boolean": Literal(False, "Boolean"),
}


def start_value(model: Model, name: str) -> Expression:
    """Return the start expression of a variable.

    The default is zero, false or the first enumeration literal.
    """
    variable = model.variables[name]
    return variable.start or _ZERO.get(variable.type, Literal(1, "Enumeration"))


def declared_value(model: Model, name: str) -> Expression:
    """Return the binding of a parameter, or its start expression without one."""
    binding = model.variables[name].binding
    return start_value(model, name) if binding is None else binding


def pre_variables(model: Model, body: Body) -> list[str]:
    """Return the variables whose value before the event is used, as they are declared."""
    used = {
        referenced_variable(item.arguments[0])
        for item in walk(body)
        if is_call(item, *PRE_OPERATORS)
    }
    return [name for name in model.variables if name in used]


def finite_variables(model: Model, schedule: Schedule) -> list[str]:
    """Return the Real variables that must remain finite.

    Outputs, continuous states and arguments of pre().
    """
    stored = {*pre_variables(model, schedule.event), *model.states}
    return [
        v.name
        for v in model.variables.values()
        if v.type == "Real"
        and (v.name in stored or (v.causality == "output" and v.top_level))
        and v.variability != "parameter"
    ]


def build_schedule(model: Model) -> Schedule:
    """Determine the order of computation of a model.

    Raises:
        InputError: The equations do not determine the variables, or a variable is defined twice.
    """
    conditions = WhenConditions(model)
    model = _with_tick_flags(model, conditions)
    assigned = assigned_names((model.whens, model.algorithms))
    assigned |= {*model.states, *model.initialized}
    continuous, held = solve_equations(model, assigned)
    events = [
        *_event_nodes(model, conditions),
        *(make_node(model, (statement,)) for statement in continuous),
    ]
    initial: list[Node] = []
    for when in model.whens:
        initial += split_by_target(model, conditions.at_initialization(when))
    for body in (*model.algorithms, *model.initial_algorithms):
        initial += algorithm_nodes(model, body, conditions.at_initialization)
    initial += [make_node(model, (statement,)) for statement in model.asserts]
    solved, initially_held = solve_initial_equations(
        model, assigned, continuous, set[ScalarKey]().union(*(node.writes for node in initial))
    )
    initial += [make_node(model, (statement,)) for statement in solved]
    for nodes, constant in ((events, held), (initial, initially_held)):
        separate = [
            d
            for d in conditions.edge_detectors
            if nodes is initial or d.index not in conditions.in_place
        ]
        nodes += [make_node(model, (detector,)) for detector in separate]
        for node in nodes:
            node.reads -= constant
    event_body = merge_statements(sort_topologically(events))
    if len(conditions.clocks) == 1 and not model.states and not model.hybrid:
        event_body = _remove_clock_condition(event_body)
    between = statements_between_events(model, continuous, held)
    event_body = (*event_body, *_reinits(model, conditions))
    # edge detectors whose flag is not read are left out
    read = {item.arguments[0] for item in walk(event_body) if is_call(item, "risen")}
    event_body = tuple(
        s
        for s in event_body
        if not (isinstance(s, EdgeDetector) and Literal(s.index, "Integer") not in read)
    )
    return Schedule(
        conditions.clocks,
        len(conditions.edge_detectors),
        _at_initialization(model, merge_statements(sort_topologically(initial))),
        _substitute_initial(event_body, False),
        BetweenEvents(*(_substitute_initial(body, False) for body in between)),
    )


def _with_tick_flags(model: Model, conditions: WhenConditions) -> Model:
    """Replace sample() outside conditions of when-clauses by event flags."""
    if not model.hybrid:
        return model

    def change(node: Any) -> Any:
        return node if isinstance(node, When) else conditions.as_tick_flag(node)

    sections = ("equations", "algorithms", "asserts")
    return replace(
        model,
        **{section: rewrite_outermost(getattr(model, section), change) for section in sections},
    )


def _at_initialization(model: Model, body: Body) -> Body:
    """Replace initial() by true, tick flags by false, and delayed values by the present ones."""

    def change(node: Any) -> Any:
        if is_call(node, "due"):
            return _FALSE
        if is_call(node, "past"):
            assert model.hybrid
            return Name(model.hybrid.delays[delay_number(node)].name)
        return node

    result: Body = _substitute_initial(rewrite(body, change) if model.hybrid else body, True)
    return result


def _reinits(model: Model, conditions: WhenConditions) -> Body:
    """Return the assignments of reinit(), which follow all others."""
    whens = list(model.whens)
    for body in model.algorithms:
        whens += [statement for statement in body if isinstance(statement, When)]
    selected: list[Statement] = []
    for when in whens:
        selected += filter_statements(
            conditions.at_event(when), lambda statement: isinstance(statement, Reinit)
        )
    result: Body = rewrite_outermost(tuple(selected), _as_assignment)
    return result


def _as_assignment(node: Any) -> Any:
    return Assign(node.target, node.value, node.where) if isinstance(node, Reinit) else None


def _event_nodes(model: Model, conditions: WhenConditions) -> Iterator[Node]:
    for when in model.whens:
        yield from split_by_target(model, conditions.at_event(when))
    for body in model.algorithms:
        yield from algorithm_nodes(model, body, conditions.at_event, conditions)
    yield from (make_node(model, (statement,)) for statement in model.asserts)


def _remove_clock_condition(body: Body) -> Body:
    """Remove the flag of the only clock: without continuous states, it ticks in every event."""
    simplified = rewrite(body, lambda node: _TRUE if node == tick_flag(0) else node)
    result: list[Statement] = []
    for statement in simplified:
        if isinstance(statement, IfStatement) and _is_always_true(statement.branches[0][0]):
            result += statement.branches[0][1]
        else:
            result.append(statement)
    return tuple(result)


def _is_always_true(condition: Expression) -> bool:
    if isinstance(condition, Binary) and condition.operator == "or":
        return _is_always_true(condition.left) or _is_always_true(condition.right)
    return condition == _TRUE


def _substitute_initial(body: Body, value: bool) -> Body:
    """Replace initial() by a constant."""
    result: Body = rewrite(
        body, lambda node: Literal(value, "Boolean") if node == Builtin("initial", ()) else node
    )
    return result
