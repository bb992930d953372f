"""model.h: the struct that holds everything a model remembers, one member for each variable."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from ..causality.matching import is_input
from ..causality.parameter_roles import Roles
from ..causality.schedule import Plan
from ..model.flat_model import Model, Variable, derivative
from .c_values import C_TYPES, Value, identifier, stored


def members(model: Model) -> dict[str, str]:
    """The member of the struct for each variable: its name as a C identifier, made unique."""
    result: dict[str, str] = {}
    taken = {"clock", "held", "failure"}
    for name in model.variables:
        member = identifier(name)
        while member in taken:
            member += "_"
        result[name] = member
        taken.add(member)
    return result


def member(variable: Variable, name: str) -> Value:
    """The C variable or array of this name for a variable."""
    return stored(variable.type, variable.shape, name)


@dataclass(frozen=True)
class Header:
    """Writes model.h."""

    model: Model
    plan: Plan
    roles: Roles
    sources: Sequence[str]

    def text(self) -> str:
        lines = [
            f"/* {comment(f'{self.model.name}: {self.model.description}'.rstrip(': '))}",
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
        count = sum(member(self.model.variables[name], name).size for name in self.model.states)
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
        names, left = members(self.model), list(self.model.variables.values())
        rates = set(map(derivative, self.model.states))
        for title, belongs in sections.items():
            chosen = [variable for variable in left if belongs(variable)]
            left = [variable for variable in left if variable not in chosen]
            yield from [f"/* {title} */"] * bool(chosen)
            yield from (_declared(variable, names[variable.name]) + _note(variable) for variable in chosen)
        yield "/* bookkeeping */"
        yield from [f"Clock clock[{len(self.plan.clocks)}];"] * bool(self.plan.clocks)
        yield from [f"bool held[{self.plan.watches}];"] * bool(self.plan.watches)
        yield "int32_t failure;"


def _declared(variable: Variable, name: str) -> str:
    size = f"[{member(variable, name).size}]" if variable.shape else ""
    return f"{C_TYPES[variable.type]} {name}{size};"


def _note(variable: Variable) -> str:
    parts = [variable.description, f"[{variable.unit}]" if variable.unit else ""]
    text = comment(" ".join(filter(None, parts)))
    return f" /* {text} */" if text else ""


def comment(text: str) -> str:
    """Text that cannot end a C comment, on one line."""
    return " ".join(text.replace("*/", "* /").replace("/*", "/ *").split())
