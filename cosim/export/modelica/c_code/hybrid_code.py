"""Code generation for models with event iteration.

The functions that hybrid.h and the communication step call.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ..causality.hybrid import (
    MAX_PASSES,
    PAST_VALUES,
    SAME_TIME,
    chattering_reason,
    endless_reason,
    iterated_names,
)
from ..model.flat_model import (
    Hybrid,
    Model,
    Relation,
    derivative_name,
    is_input,
    is_integrated,
    previous_name,
)
from ..model.syntax_tree import Assign, Name
from .c_values import C_TYPES, CExpression, CValue, function_definition, scalar_value
from .model_code import ModelCode
from .model_step import hybrid_step_body
from .statement_lowering import StatementLowering


@dataclass
class HybridCode(ModelCode):
    """Code generator of model.c for a model with event iteration."""

    @property
    def _hybrid(self) -> Hybrid:
        assert self.model.hybrid
        return self.model.hybrid

    def headers(self) -> list[str]:
        """Return the names of the C headers that model.c includes besides model.h and runtime.h."""
        others = [name for name in super().headers() if name != "runge_kutta.h"]
        return [
            *others,
            *["past.h"] * bool(self._hybrid.delays),
            *["hybrid.h"] * is_integrated(self.model),
        ]

    def definitions(self) -> list[str]:
        """Generate the functions of model.c."""
        model, clocks = self.model, len(self.schedule.clocks)
        values = self._make_lowering().scope
        initial = self._body(self.schedule.initialization, initial=True)
        definitions = [
            *self._common_definitions(),
            f"static const bool NO_TICK[{max(clocks, 1)}] = {{false}};",
            record_function(model, values, self._make_lowering(), PAST_VALUES),
            *event_functions(
                model, values, self._event(), self._endless_codes(), initial, self._limits()
            ),
            function_definition(
                "const char *model_initialize(Model *m, double time)", self._initialize_hybrid()
            ),
        ]
        if is_integrated(model):
            definitions += [*self._hybrid_system(values)]
        step = hybrid_step_body(clocks, is_integrated(model), bool(self._hybrid.sampled))
        return [
            *definitions,
            function_definition(
                "const char *model_step(Model *m, double time, double step_size)", step
            ),
            *self._exchange(
                f"event(m, time, {'tick ? due : ' * bool(clocks)}NO_TICK);",
                record=bool(self._hybrid.delays),
            ),
        ]

    def _endless_codes(self) -> dict[str, str]:
        """Return variable -> failure code of an event iteration that it does not let end."""
        hybrid, variables = self._hybrid, self.model.variables
        names = iterated_names(hybrid)
        return {
            name: self._failure_code(endless_reason(hybrid, name), variables[name].where)
            for name in names
        }

    def _initialize_hybrid(self) -> list[str]:
        """Generate the body of model_initialize.

        The initial equations, repeated until relations are consistent, and an event.
        """
        past = ["memset(m->past, 0, sizeof m->past);"] if self._hybrid.delays else []
        return [
            "m->failure = 0;",
            *(["m->step = 0;"] if is_integrated(self.model) else []),
            *past,
            "start_variables(m);",
            *self._clock_lines(),
            *(["m->event_time = -INFINITY;"] if self._hybrid.sampled else []),
            "for (int pass = 0; initialize(m, time); pass++) {",
            f"    if (pass == {MAX_PASSES}) fail(m, endless(m));",
            *(f"    {line}" for line in self._copy_relations()),
            "}",
            "if (m->failure == 0) remember_inputs(m);",
            *(["record(m, time);"] if past else []),
            "if (m->failure == 0) event(m, time, NO_TICK);",
            *self._first_ticks(),
            "return REASONS[m->failure];",
        ]

    def _derivatives(self) -> list[str]:
        """Generate the derivatives of the states.

        Values that are needed nowhere else are local variables.
        """
        stored = {
            *self._hybrid.remembered,
            *(delay.name for delay in self._hybrid.delays),
        }
        stored |= {derivative_name(name) for name in self.model.states}
        body = self.schedule.between.derivatives
        targets = [
            s.target.name for s in body if isinstance(s, Assign) and isinstance(s.target, Name)
        ]
        names = [
            name for name in targets if name not in stored and not self.model.variables[name].shape
        ]
        lowering = self._make_lowering()
        for name in names:
            local = f"local_{self.members[name]}"
            lowering.scope[name] = scalar_value(
                self.model.variables[name].type, CExpression(local), reusable=True
            )
            lowering.lines.append(f"{C_TYPES[self.model.variables[name].type]} {local};")
        lowering.body(body)
        return ["(void)m;", "(void)time;", *lowering.lines]

    def _limits(self) -> list[str]:
        lowering = self._make_lowering()
        lowering.body(self.schedule.between.limits)
        return lowering.lines

    def _first_ticks(self) -> list[str]:
        """Generate the event of the clocks that tick at the start time.

        With inputs, it belongs to the first step.
        """
        clocks = len(self.schedule.clocks)
        if not clocks or any(map(is_input, self.model.variables.values())):
            return []
        return [
            f"bool due[{clocks}];",
            f"const double next = next_event(m->clock, {clocks}, due);",
            (
                "if (m->failure == 0 && next <= time + TOLERANCE * shortest_period(m->clock, "
                f"{clocks})) {{"
            ),
            "    event(m, time, due);",
            f"    for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];",
            "}",
        ]

    def _copy_relations(self) -> list[str]:
        values = self._make_lowering().scope
        names = [relation.name for relation in self._hybrid.relations]
        return copy_values((values[previous_name(name)], values[name]) for name in names)

    def _chattering_codes(self) -> list[str]:
        relations = self._hybrid.relations
        return [
            self._failure_code(chattering_reason(each), each.condition.where) for each in relations
        ]

    def _hybrid_system(self, values: Mapping[str, CValue]) -> list[str]:
        """Generate the functions for the integration between events."""
        lowering = self._make_lowering()
        lowering.body(self.schedule.between.indicators)
        states, rates = self._state_pointers()
        if not self.model.states:
            states, rates = ["&m->no_state[0]"], ["&m->no_state[1]"]
        return [
            function_definition(
                "static void derivatives(Model *m, double time)",
                self._derivatives(),
            ),
            crossing_function(self._hybrid.relations, values, lowering),
            (
                "static const int32_t CHATTERING[] = {0, "
                f"{', '.join(self._chattering_codes()) or 0}}};"
            ),
            function_definition(
                "static bool advance(Model *m, double from, double to, double *reached)",
                [
                    "const Hybrid system = {",
                    f"    {{{', '.join(states)}}},",
                    f"    {{{', '.join(rates)}}},",
                    "};",
                    "bool event;",
                    "*reached = advance_hybrid(m, &system, from, to, &event);",
                    "return event;",
                ],
            ),
        ]


def record_function(
    model: Model, values: Mapping[str, CValue], lowering: StatementLowering, capacity: int
) -> str:
    """Generate `record`, which stores the arguments of delay()."""
    assert model.hybrid
    lines = ["(void)m;", "(void)time;"]
    for k, delay in enumerate(model.hybrid.delays):
        duration = lowering.scalar_of(delay.duration).parenthesized(11)
        lines += [
            *lowering.lines,
            (
                f"record_value(&m->past[{k}], time, {values[delay.name].text.code}, {duration} / "
                f"{capacity // 2});"
            ),
        ]
        lowering.lines = []
    return function_definition("static void record(Model *m, double time)", lines)


def crossing_function(
    relations: Iterable[Relation], values: Mapping[str, CValue], lowering: StatementLowering
) -> str:
    """Generate `crossed`, which compares the relations with their stored values."""
    lines = ["int changed = 0;", "(void)m;", "(void)time;", "z[0] = 0;"]
    for k, relation in enumerate(relations):
        a, b = (
            lowering.evaluated_once(lowering.lower(s)).text
            for s in (relation.condition.left, relation.condition.right)
        )
        left, right, held = a.parenthesized(9), b.parenthesized(10), values[relation.name].text.code
        lowering.lines += [
            f"z[{k}] = {left} - {right};",
            f"if (({left} {relation.condition.operator} {right}) != {held}) changed = {k + 1};",
        ]
    return function_definition(
        "static int crossed(Model *m, double time, double *z)",
        [*lines, *lowering.lines, "return changed;"],
    )


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
