"""Code generation for events: the iteration of all equations, and the values before an event."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ..causality.event_limits import MAX_PASSES
from ..causality.hybrid_interpreter import SAME_TIME
from ..causality.matching import is_input
from ..model.flat_model import Model, previous_name
from .c_values import CValue
from .formatting import function_definition

#: the value of a variable before an event, and the present one
ValuePair = tuple[CValue, CValue]


def copy_values(variables: Iterable[ValuePair]) -> list[str]:
    """Generate the assignments `target = source` of scalars and arrays."""
    return [
        f"memcpy({target.pointer}, {source.pointer}, sizeof {target.pointer});"
        if target.shape
        else f"{target.text.code} = {source.text.code};"
        for target, source in variables
    ]


def _differs(a: CValue, b: CValue) -> str:
    return (
        f"memcmp({a.pointer}, {b.pointer}, sizeof {a.pointer}) != 0"
        if a.shape
        else f"{a.text.code} != {b.text.code}"
    )


def memory_functions(inputs: Sequence[ValuePair], others: Sequence[ValuePair]) -> list[str]:
    """Generate `remember`, `remember_inputs` and `inputs_changed`.

    Args:
        inputs: The values before the event and the present values of inputs.
        others: Those of all other remembered variables.
    """
    return [
        "/* Stores the values before an event, or before another evaluation in the same event. */",
        function_definition("static void remember(Model *m)", copy_values(others) or ["(void)m;"]),
        function_definition(
            "static void remember_inputs(Model *m)", copy_values(inputs) or ["(void)m;"]
        ),
        function_definition(
            "static bool inputs_changed(const Model *m)",
            ["(void)m;", f"return {_any_differs(inputs)};"],
        ),
    ]


def event_functions(
    model: Model,
    values: Mapping[str, CValue],
    evaluation: list[str],
    endless: Mapping[str, str],
    initial: list[str],
    limits: list[str],
) -> list[str]:
    """Generate `evaluate`, `initialize` and `event`, and the functions that they use.

    Args:
        model: The flat model.
        values: The C values of the variables.
        evaluation: The statements of an evaluation of all equations.
        endless: The failure code of an event iteration that does not end by the variable that
            changes.
        initial: The statements of the initialization.
        limits: The statements that compute the values of continuous variables before an event.

    Returns:
        The function definitions.
    """
    assert model.hybrid
    pairs = {name: (values[previous_name(name)], values[name]) for name in model.hybrid.remembered}
    inputs = [name for name in pairs if is_input(model.variables[name])]
    changes = _any_differs(pairs[name] for name in model.hybrid.iterated)
    relations = _any_differs(pairs[relation.name] for relation in model.hybrid.relations)
    causes = [f"if ({_differs(*pairs[name])}) return {code};" for name, code in endless.items()]
    return [
        *memory_functions(
            [pairs[name] for name in inputs],
            [pair for name, pair in pairs.items() if name not in {*inputs, *model.hybrid.sampled}],
        ),
        (
            "/* Returns the failure of an event iteration in which a value changes in each "
            "evaluation. */"
        ),
        function_definition(
            "static int32_t endless(const Model *m)", ["(void)m;", *causes, "return 0;"]
        ),
        (
            "/* Evaluates all equations; returns whether they must be evaluated again, since "
            "values have changed. */"
        ),
        function_definition(
            "static bool evaluate(Model *m, double time, const bool *due)",
            ["(void)time;", "(void)due;", *evaluation, f"return m->failure == 0 && ({changes});"],
        ),
        function_definition(
            "static void event(Model *m, double time, const bool *due)",
            [
                *limits,
                *_sampled_lines(pairs[name] for name in model.hybrid.sampled),
                *_event_lines(),
            ],
        ),
        function_definition(
            "static bool initialize(Model *m, double time)",
            ["(void)time;", *initial, f"return m->failure == 0 && ({relations});"],
        ),
    ]


def _any_differs(pairs: Iterable[ValuePair]) -> str:
    return " || ".join(_differs(*pair) for pair in pairs) or "false"


def _sampled_lines(pairs: Iterable[ValuePair]) -> list[str]:
    copies = copy_values(pairs)
    guarded = [
        "if (time > m->event_time) {",
        *(f"    {line}" for line in copies),
        "}",
        f"m->event_time = time + {SAME_TIME};",
    ]
    return guarded if copies else []


def _event_lines() -> list[str]:
    return [
        "remember(m);",
        "/* flags of ticks are true in the first evaluation only */",
        (
            "for (int pass = 0; (evaluate(m, time, due) || due != NO_TICK) && m->failure == 0; "
            "pass++) {"
        ),
        f"    if (pass == {MAX_PASSES}) fail(m, endless(m));",
        "    remember(m);",
        "    remember_inputs(m);",
        "    due = NO_TICK;",
        "}",
        "remember_inputs(m);",
        "m->changed = false;",
        "record(m, time);",
    ]
