"""Code generation of model.c: readable C code of a flat model."""

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..causality.analysed_model import AnalysedModel
from ..causality.computation_order import finite_variables, pre_variables, start_value
from ..model.flat_model import Variable, derivative_name, is_input, owning_component
from ..model.syntax_tree import Body, Name, Solve, SourceLocation, Statement, referenced_variable
from ..model.traversal import assigned_references, walk
from .c_values import (
    C_TYPES,
    CExpression,
    CValue,
    c_literal,
    function_definition,
    scalar_value,
    uses_variable,
)
from .exchange_code import exchange_functions, has_exchange, indicator_lines
from .function_lowering import FunctionTranslator
from .header import has_messages, struct_member, struct_members
from .model_step import continuous_step_body, sampled_step_body
from .statement_lowering import StatementLowering

#: failure reasons of runtime.h, in the order of its enumeration (from 1)
_STANDARD_REASONS = (
    "Integer overflow",
    "division by zero in div(), mod() or rem()",
    "the period of sample() must be positive",
)
_HYBRID_REASONS = (*_STANDARD_REASONS, "the integration step has become too small")


#: function that returns an external object, which is constructed again if a state of another
#: instance was restored
_OBJECTS = """static void *object(Model *m, uint64_t identifier)
{
    static _Thread_local bool constructing;
    void *found = external_object(m, identifier);
    if (found != NULL || constructing) return found;
    constructing = true;
    model_parameters(m);
    constructing = false;
    return external_object(m, identifier);
}

void model_free(Model *m) { external_delete(m); }"""


@dataclass
class ModelCode:
    """Code generator of model.c.

    Collects the failure reasons and the functions of the model while it generates code.
    """

    analysed: AnalysedModel
    reasons: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.reasons += _HYBRID_REASONS if self.analysed.model.hybrid else _STANDARD_REASONS
        self.model, self.schedule, self.roles = (
            self.analysed.model,
            self.analysed.schedule,
            self.analysed.parameter_roles,
        )
        self.members = struct_members(self.model)
        self.functions = FunctionTranslator(dict(self.model.functions), self._failure_code)

    def model_c(self) -> str:
        """Return the text of model.c."""
        includes = "\n".join(
            f'#include "{name}"' for name in ("model.h", *(self.headers() or ["runtime.h"]))
        )
        definitions = self.definitions()
        objects = [_OBJECTS] * self._has_objects
        text = (
            "\n\n".join(
                [includes, self._reasons(), *objects, *self.functions.definitions, *definitions]
            )
            + "\n"
        )
        reason = (
            "m->failure == COMPOSED_REASON ? m->reason : REASONS[m->failure]"
            if has_messages(self.model)
            else "REASONS[m->failure]"
        )
        if not self.functions.external_functions:
            return text.replace("return REASONS[m->failure];", f"return {reason};")
        text = text.replace(
            "return REASONS[m->failure];",
            f"return external_reason({reason}, m->warning, sizeof m->warning);",
        )
        return f'#include "external_calls.h"\n{text}'

    def headers(self) -> list[str]:
        """Return the names of the C headers that model.c includes besides model.h and runtime.h."""
        bodies = (
            self.schedule.initialization,
            self.schedule.event,
            self.schedule.between.continuous,
        )
        solved = any(isinstance(item, Solve) for item in walk(bodies))
        return [
            *["messages.h"] * has_messages(self.model),
            *["newton.h"] * solved,
            *["runge_kutta.h"] * bool(self.model.states),
        ]

    def definitions(self) -> list[str]:
        """Generate the functions of model.c."""
        event = self._event()
        optional = {"time": "double time", "due": "const bool *due"}
        parameters = {"m": "Model *m"} | {
            name: code for name, code in optional.items() if uses_variable(name, event)
        }
        call = f"event({', '.join(parameters).replace('time', 'now')});"
        step = continuous_step_body if self.model.states else sampled_step_body
        return [
            *self._common_definitions(),
            function_definition(f"static void event({', '.join(parameters.values())})", event),
            function_definition(
                "const char *model_initialize(Model *m, double time)", self._model_initialize()
            ),
            *self._continuous(),
            function_definition(
                "const char *model_step(Model *m, double time, double step_size)",
                step(len(self.schedule.clocks), call),
            ),
            *self._exchange(call.replace("now", "time"), record=False),
        ]

    def _common_definitions(self) -> list[str]:
        return [
            function_definition("static void start_variables(Model *m)", self._start_variables()),
            function_definition("void model_parameters(Model *m)", self._model_parameters()),
            function_definition("void model_start(Model *m)", self._model_start()),
        ]

    def _reasons(self) -> str:
        texts = ",\n    ".join(
            ["NULL", *(json.dumps(reason, ensure_ascii=False) for reason in self.reasons)]
        )
        comment = "/* Reasons for failures; m->failure is an index in this array. */"
        return f"{comment}\nstatic const char *const REASONS[] = {{\n    {texts},\n}};"

    def _failure_code(self, reason: str, where: SourceLocation | None) -> str:
        text = f"{reason} ({where.file_and_line})" if where else reason
        if text not in self.reasons:
            self.reasons.append(text)
        return str(self.reasons.index(text) + 1)

    def _make_lowering(self, initial: bool = False) -> StatementLowering:
        """Create a lowering with the scope of the model.

        Struct members, and local variables `pre_...` for pre().
        """
        scope = {
            v.name: struct_member(v, f"m->{self.members[v.name]}")
            for v in self.model.variables.values()
        }
        scope["time"] = scalar_value("Real", CExpression("time"), reusable=True)
        pre_scope = {
            v.name: struct_member(v, f"pre_{self.members[v.name]}")
            for v in self.model.variables.values()
        }
        return StatementLowering(self.functions, scope, pre_scope, initial=initial)

    # start values and parameters

    def _model_start(self) -> list[str]:
        lines = [*["external_delete(m);"] * self._has_objects, "memset(m, 0, sizeof *m);"]
        constants = [
            self.model.variables[name] for name in (*self.roles.settable, *self.roles.fixed)
        ]
        for variable in [*constants, *filter(is_input, self.model.variables.values())]:
            lines += _assign_constant(
                struct_member(variable, f"m->{self.members[variable.name]}"),
                self.analysed.values[variable.name],
            )
        return [*lines, "model_parameters(m);", "start_variables(m);"]

    def _start_variables(self) -> list[str]:
        lowering = self._make_lowering()
        for variable in self.model.variables.values():
            if variable.variability not in ("parameter", "constant") and not is_input(variable):
                lowering.store(
                    lowering.scope[variable.name],
                    start_value(self.model, variable.name),
                    Name(variable.name),
                )
        return lowering.lines or ["(void)m;"]

    def _model_parameters(self) -> list[str]:
        lowering = self._make_lowering()
        for name in self.roles.dependent:
            binding = self.model.variables[name].binding
            lowering.store(
                lowering.scope[name],
                binding if binding is not None else start_value(self.model, name),
                Name(name),
            )
        begin = ["external_begin();"] * self._has_objects
        changed = ["m->changed = true;"] * bool(self.model.hybrid)
        return [*begin, *lowering.lines, *changed] or ["(void)m;"]

    @property
    def _has_objects(self) -> bool:
        return any(v.type == "ExternalObject" for v in self.model.variables.values())

    # events

    def _body(self, body: Body, initial: bool) -> list[str]:
        """Generate statements, preceded by copies of the arguments of pre().

        A comment marks the statements of a component.
        """
        lowering = self._make_lowering(initial)
        for name in pre_variables(self.model, body):
            lowering.lines += _save_pre_value(self.model.variables[name], self.members[name])
        previous_component = None
        for statement in body:
            if (component := _owning_component(statement)) != previous_component:
                lowering.lines += [
                    *[""] * bool(lowering.lines),
                    f"/* {component or 'the model itself'} */",
                ]
                previous_component = component
            lowering.statement(statement)
        return lowering.lines

    def _event(self) -> list[str]:
        lines = self._body(self.schedule.event, initial=False)
        lines += [""] * bool(finite_variables(self.model, self.schedule))
        for name in finite_variables(self.model, self.schedule):
            lines += self._finite_check(self.model.variables[name])
        if uses_variable("risen", lines):
            lines.insert(0, f"bool risen[{self.schedule.edge_detector_count}];")
        return lines or ["(void)m;"]

    def _finite_check(self, variable: Variable) -> list[str]:
        value = struct_member(variable, f"m->{self.members[variable.name]}")
        failure = self._failure_code(f"{variable.name} is not a finite number", None)
        test = f"if (!isfinite({value.element('each').code})) fail(m, {failure});"
        return (
            [f"for (int each = 0; each < {value.size}; each++) {test}"]
            if variable.shape
            else [test]
        )

    def _model_initialize(self) -> list[str]:
        lines = [*self._clock_lines(), *self._body(self.schedule.initialization, initial=True)]
        unused = [] if uses_variable("time", lines) else ["(void)time;"]
        return [
            *unused,
            "m->failure = 0;",
            "start_variables(m);",
            *lines,
            "return REASONS[m->failure];",
        ]

    def _clock_lines(self) -> list[str]:
        lowering = self._make_lowering()
        for k, clock in enumerate(self.schedule.clocks):
            start, period = (
                lowering.scalar_of(clock.start).code,
                lowering.scalar_of(clock.period).code,
            )
            lowering.lines.append(f"set_clock(m, &m->clock[{k}], {start}, {period}, time);")
        return lowering.lines

    # continuous states

    def _continuous(self) -> list[str]:
        """Generate `derivatives` and `advance`, the integration of a model with states."""
        if not self.model.states:
            return []
        lines = self._body(self.schedule.between.derivatives, initial=False)
        unused = [] if uses_variable("time", lines) else ["(void)time;"]
        states, rates = self._state_pointers()
        system = [
            "const System system = {",
            f"    {{{', '.join(states)}}},",
            f"    {{{', '.join(rates)}}},",
            "    derivatives,",
            "};",
        ]
        return [
            function_definition(
                "static void derivatives(Model *m, double time)", [*unused, *lines]
            ),
            function_definition(
                "static double advance(Model *m, double from, double to)",
                [*system, "return integrate(m, &system, from, to);"],
            ),
        ]

    def _exchange(self, event: str, record: bool) -> list[str]:
        """Generate the functions of Model Exchange, if the model offers it."""
        if not has_exchange(self.model):
            return []
        continuous = self._body(self.schedule.between.continuous, initial=False)
        if self.model.hybrid:
            continuous += [
                "{",
                *indicator_lines(self.model.hybrid.relations, self._make_lowering()),
                "}",
            ]
        states, rates = self._state_pointers()
        return exchange_functions(
            continuous, states, rates, len(self.schedule.clocks), event, record
        )

    def _state_pointers(self) -> tuple[list[str], list[str]]:
        """Return C pointers to all states and to their derivatives."""
        rates = map(derivative_name, self.model.states)
        return self._element_pointers(self.model.states), self._element_pointers(rates)

    def _element_pointers(self, names: Iterable[str]) -> list[str]:
        """Return C pointers to all elements of variables."""
        pointers = []
        for name in names:
            value = struct_member(self.model.variables[name], f"m->{self.members[name]}")
            pointers += [f"&{value.element(k).code}" for k in range(value.size)]
        return pointers


def _owning_component(statement: Statement) -> str:
    """Return the component whose variable a statement assigns first."""
    return next(
        (
            owning_component(referenced_variable(target))
            for target in assigned_references(statement)
        ),
        "",
    )


def _save_pre_value(variable: Variable, name: str) -> list[str]:
    """Generate the copy of a variable to a local variable, which pre() reads."""
    c_type = C_TYPES[variable.type]
    if not variable.shape:
        return [f"const {c_type} pre_{name} = m->{name};"]
    return [
        f"{c_type} pre_{name}[{struct_member(variable, name).size}];",
        f"memcpy(pre_{name}, m->{name}, sizeof pre_{name});",
    ]


def _assign_constant(target: CValue, value: Any) -> list[str]:
    """Generate the assignment of a constant value."""
    literals = [c_literal(x, target.type).code for x in np.asarray(value).flat]
    if target.size > 4:
        while len(literals) > 1 and literals[-1] in ("0.0", "0", "false"):
            literals.pop()  # C initializes the other elements to zero
        array = f"(const {C_TYPES[target.type]}[{target.size}]){{{', '.join(literals)}}}"
        return [f"memcpy({target.pointer}, {array}, sizeof {target.pointer});"]
    return [f"{target.element(k).code} = {literal};" for k, literal in enumerate(literals)]
