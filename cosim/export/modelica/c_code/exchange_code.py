"""Code generation for Model Exchange.

Addresses of the states, evaluation between events, and events.
"""

from collections.abc import Iterable, Sequence

from ..model.flat_model import Model, Relation, is_integrated
from .c_values import function_definition
from .statement_lowering import StatementLowering

#: distance from a crossing at which its indicator changes its sign, so that the relation has
#: changed when the event is executed
_HYSTERESIS = "1e-10"


def has_exchange(model: Model) -> bool:
    """Return whether a model is also exported for Model Exchange.

    It has states, or relations that change with time.
    """
    return bool(model.states) or is_integrated(model)


def indicator_count(model: Model) -> int:
    """Return the number of event indicators."""
    return len(model.hybrid.relations) if model.hybrid else 0


def exchange_declarations(model: Model, states: int) -> list[str]:
    """Generate the declarations in model.h."""
    if not has_exchange(model):
        return []
    return [
        "#define MODEL_EXCHANGE",
        f"#define MODEL_STATES {states}",
        f"#define MODEL_INDICATORS {indicator_count(model)}",
        "void model_states(Model *m, double **states, double **rates);",
        "const char *model_continuous(Model *m, double time);",
        "const char *model_update(Model *m, double time, double *next);",
        "void model_accept(Model *m, double time);",
    ]


def indicator_lines(relations: Iterable[Relation], lowering: StatementLowering) -> list[str]:
    """Generate the event indicators.

    The difference of the operands of each relation, with a hysteresis.
    """
    for k, relation in enumerate(relations):
        left, right = (
            lowering.evaluated_once(lowering.lower(s)).text
            for s in (relation.condition.left, relation.condition.right)
        )
        held = lowering.scope[relation.name].text.code
        signs = ("-1", "1") if relation.condition.operator in ("<", "<=") else ("1", "-1")
        shift = (
            f"({held} ? {signs[0]} : {signs[1]}) * {_HYSTERESIS} * (1 + "
            f"fabs((double)({right.code})))"
        )
        lowering.lines.append(
            f"m->indicator[{k}] = {left.parenthesized(9)} - {right.parenthesized(10)} + {shift};"
        )
    return lowering.lines


def exchange_functions(
    continuous: Sequence[str],
    states: Sequence[str],
    rates: Sequence[str],
    clocks: int,
    event: str,
    record: bool,
) -> list[str]:
    """Generate the functions of Model Exchange.

    Args:
        continuous: The statements that compute all continuous variables and the event indicators.
        states: C expressions of the addresses of the states.
        rates: Those of their derivatives.
        clocks: The number of clocks.
        event: The C statement that evaluates an event at `time`, in which clocks tick as in the
            array `due`.
        record: True if the model stores past values.

    Returns:
        The function definitions.
    """
    addresses = [f"states[{k}] = {address};" for k, address in enumerate(states)]
    addresses += [f"rates[{k}] = {address};" for k, address in enumerate(rates)]
    return [
        function_definition(
            "void model_states(Model *m, double **states, double **rates)",
            addresses or ["(void)m;", "(void)states;", "(void)rates;"],
        ),
        (
            "/* Computes all continuous variables and the event indicators from states, inputs and "
            "the time. */"
        ),
        function_definition(
            "const char *model_continuous(Model *m, double time)",
            ["(void)time;", "m->failure = 0;", *continuous, "return REASONS[m->failure];"],
        ),
        "/* Executes an event; `next` is the time of the next tick. */",
        function_definition(
            "const char *model_update(Model *m, double time, double *next)",
            _update_lines(clocks, event),
        ),
        "/* Accepts the states at a time as part of the solution. */",
        function_definition(
            "void model_accept(Model *m, double time)",
            ["record(m, time);"] if record else ["(void)m;", "(void)time;"],
        ),
    ]


def _update_lines(clocks: int, event: str) -> list[str]:
    if not clocks:
        due = ["const bool due[1] = {false};"] * ("due" in event)
        return [
            "(void)time;",
            "m->failure = 0;",
            "*next = INFINITY;",
            *due,
            event,
            "return REASONS[m->failure];",
        ]
    return [
        f"bool due[{clocks}], later[{clocks}];",
        "m->failure = 0;",
        (
            f"const bool tick = next_event(m->clock, {clocks}, due) <= time + TOLERANCE * "
            f"shortest_period(m->clock, {clocks});"
        ),
        f"for (int k = 0; k < {clocks}; k++) due[k] = due[k] && tick;",
        event,
        f"for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];",
        f"*next = next_event(m->clock, {clocks}, later);",
        "return REASONS[m->failure];",
    ]
