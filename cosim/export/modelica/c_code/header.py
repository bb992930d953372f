"""model.h: the struct that holds everything a model remembers, one member for each variable."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from ..causality.matching import is_input
from ..causality.parameter_roles import ParameterRoles
from ..causality.schedule import Schedule
from ..model.flat_model import Model, Variable, derivative_name
from .c_values import C_TYPES, CValue, c_identifier, variable_value


def struct_members(model: Model) -> dict[str, str]:
    """The member of the struct for each variable: its name as a C identifier, made unique."""
    result: dict[str, str] = {}
    taken = {"clock", "held", "failure"}
    for name in model.variables:
        member = c_identifier(name)
        while member in taken:
            member += "_"
        result[name] = member
        taken.add(member)
    return result


def struct_member(variable: Variable, name: str) -> CValue:
    """The C variable or array of this name for a variable."""
    return variable_value(variable.type, variable.shape, name)


@dataclass(frozen=True)
class HeaderWriter:
    """Writes model.h."""

    model: Model
    plan: Schedule
    roles: ParameterRoles
    sources: Sequence[str]

    def text(self) -> str:
        lines = [
            f"/* {escape_comment(f'{self.model.name}: {self.model.description}'.rstrip(': '))}",
            f" * Made by cosim from {', '.join(self.sources)}; change those instead. */",
            "#ifndef MODEL_H",
            "#define MODEL_H",
            "",
            "#include <stdbool.h>",
            "#include <stdint.h>",
            "",
            "/* Ticks at start + ticks*period, in seconds; `ticks` counts those that are over. */",
            "typedef struct {",
            "    double start, period;",
            "    int64_t ticks;",
            "} Clock;",
            "",
            *self._states(),
            "typedef struct {",
            *(f"    {line}" for line in self._struct()),
            "} Model;",
            "",
            "void model_start(Model *m);",
            "void model_parameters(Model *m);",
            "const char *model_initialize(Model *m, double time);",
            "const char *model_step(Model *m, double time, double step_size);",
            "",
            "#endif",
        ]
        return "\n".join(lines) + "\n"

    def _states(self) -> list[str]:
        count = sum(struct_member(self.model.variables[name], name).size for name in self.model.states)
        return [f"enum {{ STATES = {count} }};", ""] if count else []

    def _struct(self) -> Iterator[str]:
        sections: dict[str, Callable[[Variable], bool]] = {
            "parameters": lambda v: v.name in self.roles.settable,
            "parameters that follow from others": lambda v: v.name in self.roles.dependent,
            "constants": lambda v: v.name in self.roles.fixed,
            "inputs": is_input,
            "outputs": lambda v: v.causality == "output" and v.top_level,
            "continuous states": lambda v: v.name in self.model.states,
            "derivatives of the states": lambda v: v.name in rates,
            "inner variables": lambda v: True,
        }
        names, left = struct_members(self.model), list(self.model.variables.values())
        rates = set(map(derivative_name, self.model.states))
        for title, belongs in sections.items():
            chosen = [variable for variable in left if belongs(variable)]
            left = [variable for variable in left if variable not in chosen]
            yield from [f"/* {title} */"] * bool(chosen)
            yield from (_member_declaration(variable, names[variable.name]) + _member_comment(variable) for variable in chosen)
        yield "/* bookkeeping */"
        yield from [f"Clock clock[{len(self.plan.clocks)}];"] * bool(self.plan.clocks)
        yield from [f"bool held[{self.plan.edge_detector_count}];"] * bool(self.plan.edge_detector_count)
        yield "int32_t failure;"


def _member_declaration(variable: Variable, name: str) -> str:
    size = f"[{struct_member(variable, name).size}]" if variable.shape else ""
    return f"{C_TYPES[variable.type]} {name}{size};"


def _member_comment(variable: Variable) -> str:
    parts = [variable.description, f"[{variable.unit}]" if variable.unit else ""]
    text = escape_comment(" ".join(filter(None, parts)))
    return f" /* {text} */" if text else ""


def escape_comment(text: str) -> str:
    """Text that cannot end a C comment, on one line."""
    return " ".join(text.replace("*/", "* /").replace("/*", "/ *").split())
