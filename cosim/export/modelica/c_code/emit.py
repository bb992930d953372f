"""model.c: a flat model in C that is meant to be read; together with model.h and runtime.h a complete Block."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import numpy as np

from ..causality.interpreter import Interpreter
from ..causality.matching import is_input
from ..causality.schedule import finite_variables, pre_variables, start_value
from ..model.flat_model import (
    Body,
    Name,
    SourceLocation,
    Statement,
    Variable,
    derivative_name,
    owning_component,
    referenced_variable,
)
from ..model.traversal import assigned_references
from .c_values import C_TYPES, CExpression, CValue, c_literal, scalar_value
from .formatting import function_definition, uses_variable
from .functions import FunctionTranslator
from .header import HeaderWriter, struct_member, struct_members
from .model_step import continuous_step_body, sampled_step_body
from .statements import StatementLowering

#: in the order of the enum in runtime.h, from 1
_STANDARD_REASONS = ("Integer overflow", "division by zero in div(), mod() or rem()", "the period of sample() must be positive")


def generate_c(defaults: Interpreter, sources: Sequence[str]) -> dict[str, str]:
    """The C files by name; `defaults` holds the model with its default values, `sources` are named in a comment.

    Raises InputError for what cannot be translated.
    """
    header = HeaderWriter(defaults.model, defaults.schedule, defaults.parameter_roles, sources).text()
    fixed = ("runtime.h", "runge_kutta.h") if defaults.model.states else ("runtime.h",)
    texts = {name: resources.files(__package__ or "").joinpath(name).read_text(encoding="utf-8") for name in fixed}
    return {"model.c": _Emitter(defaults).model_c(), "model.h": header, **texts}


@dataclass
class _Emitter:
    defaults: Interpreter
    reasons: list[str] = field(default_factory=lambda: list(_STANDARD_REASONS))

    def __post_init__(self) -> None:
        self.model, self.plan, self.roles = self.defaults.model, self.defaults.schedule, self.defaults.parameter_roles
        self.members = struct_members(self.model)
        self.functions = FunctionTranslator(dict(self.model.functions), self._failure_code)

    def model_c(self) -> str:
        event = self._event()
        wanted = {"m": "Model *m"} | {
            k: v for k, v in (("time", "double time"), ("due", "const bool *due")) if uses_variable(k, event)
        }
        call = f"event({', '.join(wanted).replace('time', 'now')});"
        step = continuous_step_body if self.model.states else sampled_step_body
        definitions = [
            function_definition("static void start_variables(Model *m)", self._start_variables()),
            function_definition("void model_parameters(Model *m)", self._model_parameters()),
            function_definition("void model_start(Model *m)", self._model_start()),
            function_definition(f"static void event({', '.join(wanted.values())})", event),
            function_definition("const char *model_initialize(Model *m, double time)", self._model_initialize()),
            *self._continuous(),
            function_definition(
                "const char *model_step(Model *m, double time, double step_size)", step(len(self.plan.clocks), call)
            ),
        ]
        includes = f'#include "model.h"\n#include "{"runge_kutta.h" if self.model.states else "runtime.h"}"'
        return "\n\n".join([includes, self._reasons(), *self.functions.definitions, *definitions]) + "\n"

    def _reasons(self) -> str:
        texts = ",\n    ".join(["NULL", *(json.dumps(reason, ensure_ascii=False) for reason in self.reasons)])
        comment = "/* Why a step can fail: m->failure is a place in this list. */"
        return f"{comment}\nstatic const char *const REASONS[] = {{\n    {texts},\n}};"

    def _failure_code(self, reason: str, where: SourceLocation | None) -> str:
        text = f"{reason} ({where.file_and_line})" if where else reason
        if text not in self.reasons:
            self.reasons.append(text)
        return str(self.reasons.index(text) + 1)

    def _make_lowering(self, initial: bool = False) -> StatementLowering:
        """The scope of the model: variables are members of the struct, their values before the event are locals `pre_...`."""
        scope = {v.name: struct_member(v, f"m->{self.members[v.name]}") for v in self.model.variables.values()}
        scope["time"] = scalar_value("Real", CExpression("time"), simple=True)
        before = {v.name: struct_member(v, f"pre_{self.members[v.name]}") for v in self.model.variables.values()}
        return StatementLowering(self.functions, scope, before, initial=initial)

    # start values and parameters

    def _model_start(self) -> list[str]:
        lines = ["memset(m, 0, sizeof *m);"]
        constants = [self.model.variables[name] for name in (*self.roles.settable, *self.roles.fixed)]
        for variable in [*constants, *filter(is_input, self.model.variables.values())]:
            lines += _assign_constant(
                struct_member(variable, f"m->{self.members[variable.name]}"), self.defaults.get(variable.name)
            )
        return [*lines, "model_parameters(m);", "start_variables(m);"]

    def _start_variables(self) -> list[str]:
        lowering = self._make_lowering()
        for variable in self.model.variables.values():
            if variable.variability not in ("parameter", "constant") and not is_input(variable):
                lowering.store(lowering.scope[variable.name], start_value(self.model, variable.name), Name(variable.name))
        return lowering.lines or ["(void)m;"]

    def _model_parameters(self) -> list[str]:
        lowering = self._make_lowering()
        for name in self.roles.dependent:
            binding = self.model.variables[name].binding
            lowering.store(lowering.scope[name], binding if binding is not None else start_value(self.model, name), Name(name))
        return lowering.lines or ["(void)m;"]

    # events

    def _body(self, body: Body, initial: bool) -> list[str]:
        """The statements with the values that pre() needs in front, and a comment where another component begins."""
        lowering = self._make_lowering(initial)
        for name in pre_variables(self.model, body):
            lowering.lines += _save_pre_value(self.model.variables[name], self.members[name])
        owner = None
        for statement in body:
            if (new := _owning_component(statement)) != owner:
                lowering.lines += [*[""] * bool(lowering.lines), f"/* {new or 'the model itself'} */"]
                owner = new
            lowering.statement(statement)
        return lowering.lines

    def _event(self) -> list[str]:
        lines = self._body(self.plan.event, initial=False)
        lines += [""] * bool(finite_variables(self.model, self.plan))
        for name in finite_variables(self.model, self.plan):
            lines += self._finite_check(self.model.variables[name])
        if uses_variable("risen", lines):
            lines.insert(0, f"bool risen[{self.plan.edge_detector_count}];")
        return lines or ["(void)m;"]

    def _finite_check(self, variable: Variable) -> list[str]:
        value = struct_member(variable, f"m->{self.members[variable.name]}")
        failure = self._failure_code(f"{variable.name} is not a finite number", None)
        test = f"if (!isfinite({value.element('each').code})) fail(m, {failure});"
        return [f"for (int each = 0; each < {value.size}; each++) {test}"] if variable.shape else [test]

    def _model_initialize(self) -> list[str]:
        lowering = self._make_lowering()
        for k, clock in enumerate(self.plan.clocks):
            start, period = lowering.scalar_of(clock.start).code, lowering.scalar_of(clock.period).code
            lowering.lines.append(f"set_clock(m, &m->clock[{k}], {start}, {period}, time);")
        lines = [*lowering.lines, *self._body(self.plan.initialization, initial=True)]
        unused = [] if uses_variable("time", lines) else ["(void)time;"]
        return [*unused, "m->failure = 0;", "start_variables(m);", *lines, "return REASONS[m->failure];"]

    # continuous states

    def _continuous(self) -> list[str]:
        """The derivatives as a function of the states and the time, and the integration of both."""
        if not self.model.states:
            return []
        lines = self._body(self.plan.derivatives, initial=False)
        unused = [] if uses_variable("time", lines) else ["(void)time;"]
        states, rates = self._element_pointers(self.model.states), self._element_pointers(map(derivative_name, self.model.states))
        system = ["const System system = {", f"    {{{states}}},", f"    {{{rates}}},", "    derivatives,", "};"]
        return [
            function_definition("static void derivatives(Model *m, double time)", [*unused, *lines]),
            function_definition(
                "static double advance(Model *m, double from, double to)", [*system, "return integrate(m, &system, from, to);"]
            ),
        ]

    def _element_pointers(self, names: Iterable[str]) -> str:
        """Pointers to all elements of variables."""
        values = (struct_member(self.model.variables[name], f"m->{self.members[name]}") for name in names)
        return ", ".join(f"&{value.element(k).code}" for value in values for k in range(value.size))


def _owning_component(statement: Statement) -> str:
    """The component whose variable a statement assigns first."""
    return next((owning_component(referenced_variable(target)) for target in assigned_references(statement)), "")


def _save_pre_value(variable: Variable, name: str) -> list[str]:
    """Copies a variable to a local, from which pre() reads."""
    kind = C_TYPES[variable.type]
    if not variable.shape:
        return [f"const {kind} pre_{name} = m->{name};"]
    return [f"{kind} pre_{name}[{struct_member(variable, name).size}];", f"memcpy(pre_{name}, m->{name}, sizeof pre_{name});"]


def _assign_constant(target: CValue, value: Any) -> list[str]:
    """Gives a variable a value that is known now."""
    numbers = [c_literal(x, target.type).code for x in np.asarray(value).flat]
    if target.size > 4:
        while len(numbers) > 1 and numbers[-1] in ("0.0", "0", "false"):
            numbers.pop()  # C fills up with zeros
        table = f"(const {C_TYPES[target.type]}[{target.size}]){{{', '.join(numbers)}}}"
        return [f"memcpy({target.pointer}, {table}, sizeof {target.pointer});"]
    return [f"{target.element(k).code} = {x};" for k, x in enumerate(numbers)]
