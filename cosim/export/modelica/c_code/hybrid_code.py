"""Code generation for models with event iteration.

The functions that hybrid.h and the communication step call.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ..causality.event_limits import (
    MAX_EVENTS,
    MAX_PASSES,
    chattering_reason,
    endless_reason,
    iterated_names,
)
from ..causality.matching import is_input
from ..causality.past_values import PAST_VALUES
from ..model.flat_model import Model, Relation, derivative_name, is_integrated, previous_name
from ..model.syntax_tree import Assign, Name
from .c_values import C_TYPES, CExpression, CValue, scalar_value
from .event_code import copy_values, event_functions
from .formatting import function_definition
from .model_code import ModelCode
from .statements import StatementLowering


@dataclass
class HybridCode(ModelCode):
    """Code generator of model.c for a model with event iteration."""

    def headers(self) -> list[str]:
        """Return the names of the C headers that model.c includes besides model.h and runtime.h."""
        assert self.model.hybrid
        others = [name for name in super().headers() if name != "runge_kutta.h"]
        return [
            *others,
            *["past.h"] * bool(self.model.hybrid.delays),
            *["hybrid.h"] * is_integrated(self.model),
        ]

    def definitions(self) -> list[str]:
        """Generate the functions of model.c."""
        model, clocks = self.model, len(self.schedule.clocks)
        assert model.hybrid
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
        step = hybrid_step_body(clocks, is_integrated(model), bool(model.hybrid.sampled))
        return [
            *definitions,
            function_definition(
                "const char *model_step(Model *m, double time, double step_size)", step
            ),
            *self._exchange(
                f"event(m, time, {'tick ? due : ' * bool(clocks)}NO_TICK);",
                record=bool(model.hybrid.delays),
            ),
        ]

    def _endless_codes(self) -> dict[str, str]:
        """Return the failure code of an event iteration that does not end by the variable that changes."""
        hybrid, variables = self.model.hybrid, self.model.variables
        assert hybrid
        names = iterated_names(hybrid)
        return {
            name: self._failure_code(endless_reason(hybrid, name), variables[name].where)
            for name in names
        }

    def _initialize_hybrid(self) -> list[str]:
        """Generate the body of model_initialize.

        The initial equations, repeated until relations are consistent, and an event.
        """
        past = (
            ["memset(m->past, 0, sizeof m->past);"]
            if self.model.hybrid and self.model.hybrid.delays
            else []
        )
        return [
            "m->failure = 0;",
            *(["m->step = 0;"] if is_integrated(self.model) else []),
            *past,
            "start_variables(m);",
            *self._clock_lines(),
            *(
                ["m->event_time = -INFINITY;"]
                if self.model.hybrid and self.model.hybrid.sampled
                else []
            ),
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
        assert self.model.hybrid
        stored = {
            *self.model.hybrid.remembered,
            *(delay.name for delay in self.model.hybrid.delays),
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
        assert self.model.hybrid
        names = [relation.name for relation in self.model.hybrid.relations]
        return copy_values((values[previous_name(name)], values[name]) for name in names)

    def _chattering_codes(self) -> list[str]:
        relations = self.model.hybrid.relations if self.model.hybrid else ()
        return [
            self._failure_code(chattering_reason(each), each.condition.where) for each in relations
        ]

    def _hybrid_system(self, values: Mapping[str, CValue]) -> list[str]:
        """Generate the functions for the integration between events."""
        assert self.model.hybrid
        lowering = self._make_lowering()
        lowering.body(self.schedule.between.indicators)
        states, rates = (
            self._element_pointers(self.model.states),
            self._element_pointers(map(derivative_name, self.model.states)),
        )
        if not self.model.states:
            states, rates = ["&m->no_state[0]"], ["&m->no_state[1]"]
        return [
            function_definition(
                "static void derivatives(Model *m, double time)",
                self._derivatives(),
            ),
            crossing_function(self.model.hybrid.relations, values, lowering),
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


def hybrid_step_body(clocks: int, continuous: bool, inputs_first: bool) -> list[str]:
    """Generate the body of model_step.

    `inputs_first`: changes of inputs are an event before a tick at the same time.
    """
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
        loop += [
            (
                "const bool at_start = tick && next <= time + TOLERANCE * "
                f"shortest_period(m->clock, {clocks});"
            )
        ] * (continuous or not inputs_first)
        at_start += " && !at_start" * (not inputs_first)
    input_event = f"if ({at_start} && (m->changed || inputs_changed(m)))"
    loop += (
        [f"{input_event} {{", "    event(m, time, NO_TICK);", "    m->event_time = -INFINITY;", "}"]
        if inputs_first
        else [f"{input_event} event(m, time, NO_TICK);"]
    )
    if continuous:
        lines.append("double reached = time;")
        loop += [
            (
                f"const bool crossing = {'!at_start && ' * bool(clocks)}advance(m, reached, "
                "target, &reached);"
            ),
            "if (m->failure != 0) break;",
            "if (crossing) {",
            "    double z[RELATIONS];",
            f"    if (count == {MAX_EVENTS}) fail(m, CHATTERING[crossed(m, reached, z)]);",
            "    else event(m, reached, NO_TICK);",
            "    continue;",
            "}",
        ]
    loop += ["if (!tick) break;"]
    if clocks:
        loop += [
            "event(m, target, due);",
            f"for (int k = 0; k < {clocks}; k++) m->clock[k].ticks += due[k];",
        ]
    lines += [
        "for (int count = 0; m->failure == 0; count++) {",
        *("    " + line for line in loop),
        "}",
    ]
    return [*lines, "if (m->failure == 0) event(m, end, NO_TICK);", "return REASONS[m->failure];"]
