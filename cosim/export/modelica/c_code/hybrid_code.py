"""Code generation for models with event iteration: the functions that hybrid.h and the communication step call."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ..causality.matching import is_input
from ..model.flat_model import Model, Relation, Variable, previous_name
from ..model.syntax_tree import Name
from .c_values import CValue
from .formatting import function_definition
from .statements import StatementLowering

#: largest numbers of evaluations in one event, and of located events in one communication step
MAX_PASSES, MAX_EVENTS = 100, 100_000


def copy_values(variables: Iterable[tuple[CValue, CValue]]) -> list[str]:
    """Generate the assignments `target = source` of scalars and arrays."""
    return [
        f"memcpy({target.pointer}, {source.pointer}, sizeof {target.pointer});" if target.shape else f"{target.text.code} = {source.text.code};"
        for target, source in variables
    ]


def is_integrated(model: Model) -> bool:
    """Return whether a model with event iteration has states, or relations that change with time."""
    return model.hybrid is not None and bool(model.states or model.hybrid.relations)


def _differs(a: CValue, b: CValue) -> str:
    return f"memcmp({a.pointer}, {b.pointer}, sizeof {a.pointer}) != 0" if a.shape else f"{a.text.code} != {b.text.code}"


def event_functions(model: Model, values: Mapping[str, CValue], evaluation: list[str], endless: str, initial: list[str]) -> list[str]:
    """Generate `evaluate`, `initialize` and `event`.

    Args:
        model: The flat model.
        values: The C values of the variables.
        evaluation: The statements of an evaluation of all equations.
        endless: The failure code of an event iteration that does not end.
        initial: The statements of the initialization.

    Returns:
        The function definitions.
    """
    assert model.hybrid
    pairs = {name: (values[previous_name(name)], values[name]) for name in model.hybrid.remembered}
    inputs = [name for name in pairs if is_input(model.variables[name])]
    others = copy_values(pair for name, pair in pairs.items() if name not in inputs)
    changes = " || ".join(_differs(*pairs[name]) for name in model.hybrid.iterated) or "false"
    relations = " || ".join(_differs(*pairs[relation.name]) for relation in model.hybrid.relations) or "false"
    return [
        "/* Stores the values before an event, or before another evaluation in the same event. */",
        function_definition("static void remember(Model *m)", others or ["(void)m;"]),
        function_definition("static void remember_inputs(Model *m)", copy_values(pairs[name] for name in inputs) or ["(void)m;"]),
        function_definition(
            "static bool inputs_changed(const Model *m)",
            ["(void)m;", f"return {' || '.join(_differs(*pairs[name]) for name in inputs) or 'false'};"],
        ),
        "/* Evaluates all equations; returns whether they must be evaluated again, since values have changed. */",
        function_definition(
            "static bool evaluate(Model *m, double time, const bool *due)",
            ["(void)time;", "(void)due;", *evaluation, f"return m->failure == 0 && ({changes});"],
        ),
        function_definition(
            "static void event(Model *m, double time, const bool *due)",
            [
                "remember(m);",
                "/* flags of ticks are true in the first evaluation only */",
                "for (int pass = 0; (evaluate(m, time, due) || due != NO_TICK) && m->failure == 0; pass++) {",
                f"    if (pass == {MAX_PASSES}) fail(m, {endless});",
                "    remember(m);",
                "    remember_inputs(m);",
                "    due = NO_TICK;",
                "}",
                "remember_inputs(m);",
                "record(m, time);",
            ],
        ),
        function_definition(
            "static bool initialize(Model *m, double time)", ["(void)time;", *initial, f"return m->failure == 0 && ({relations});"]
        ),
    ]


def record_function(model: Model, values: Mapping[str, CValue], lowering: StatementLowering, capacity: int) -> str:
    """Generate `record`, which stores the arguments of delay()."""
    assert model.hybrid
    lines = ["(void)m;", "(void)time;"]
    for k, delay in enumerate(model.hybrid.delays):
        duration = lowering.scalar_of(delay.duration).parenthesized(11)
        lines += [*lowering.lines, f"record_value(&m->past[{k}], time, {values[delay.name].text.code}, {duration} / {capacity // 2});"]
        lowering.lines = []
    return function_definition("static void record(Model *m, double time)", lines)


def crossing_function(relations: Iterable[Relation], values: Mapping[str, CValue], lowering: StatementLowering) -> str:
    """Generate `crossed`, which compares the relations with their stored values."""
    lines = ["bool changed = false;", "(void)m;", "(void)time;", "z[0] = 0;"]
    for k, relation in enumerate(relations):
        left, right = (lowering.evaluated_once(lowering.lower(side)).text for side in (relation.condition.left, relation.condition.right))
        lowering.lines += [
            f"z[{k}] = {left.parenthesized(9)} - {right.parenthesized(10)};",
            f"if (({left.parenthesized(9)} {relation.condition.operator} {right.parenthesized(9)}) != {values[relation.name].text.code}) changed = true;",
        ]
    return function_definition(
        "static bool crossed(Model *m, double time, double *z)", [*lines, *lowering.lines, "return changed;"]
    )


def hybrid_step_body(clocks: int, continuous: bool, too_many: str) -> list[str]:
    """Generate the body of model_step."""
    lines = ["const double end = time + step_size;", "m->failure = 0;"]
    tick = ["const bool tick = false;", *["const double target = end;"] * continuous]
    if clocks:
        tick = [
            f"bool due[{clocks}];",
            f"const double next = next_event(m->clock, {clocks}, due);",
            f"const bool tick = next < end - TOLERANCE * shortest_period(m->clock, {clocks});",
            "const double target = tick ? next : end;",
        ]
    loop, at_start = [*tick], "count == 0"
    if clocks:
        loop.append(f"const bool at_start = tick && next <= time + TOLERANCE * shortest_period(m->clock, {clocks});")
        at_start += " && !at_start"
    loop.append(f"if ({at_start} && inputs_changed(m)) event(m, time, NO_TICK);")
    if continuous:
        lines.append("double reached = time;")
        loop += [
            f"const bool crossing = {'!at_start && ' * bool(clocks)}advance(m, reached, target, &reached);",
            "if (m->failure != 0) break;",
            "if (crossing) {",
            "    event(m, reached, NO_TICK);",
            f"    if (count == {MAX_EVENTS}) fail(m, {too_many});",
            "    continue;",
            "}",
        ]
    loop += ["if (!tick) break;"]
    if clocks:
        loop += ["event(m, target, due);", f"for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];"]
    lines += ["for (int count = 0; m->failure == 0; count++) {", *("    " + line for line in loop), "}"]
    return [*lines, "if (m->failure == 0) event(m, end, NO_TICK);", "return REASONS[m->failure];"]
