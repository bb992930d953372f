"""Data model of the components of a scenario; see `schema`."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ConfigDict, model_validator

from ..components.fmi.settings import Method
from .schema_types import Period, Spec, Value, key

#: keys of the sources of a component
SOURCES = ("fmu", "python", "modelica", "system")


def _has_text(key: str) -> dict[str, Any]:
    """Return the JSON Schema of objects with a text under `key`."""
    return {"required": [key], "properties": {key: {"type": "string"}}}


#: the rules of the validators below that JSON Schema can express
_COMPONENT_RULES: dict[str, Any] = {
    "oneOf": [_has_text(source) for source in SOURCES],
    "allOf": [
        {
            "if": {"required": ["arguments"], "properties": {"arguments": {"minProperties": 1}}},
            "then": _has_text("python"),
        },
        {
            "if": _has_text("isolation"),
            "then": {"anyOf": [_has_text("fmu"), _has_text("modelica")]},
        },
        {
            "if": {"required": ["libraries"], "properties": {"libraries": {"minItems": 1}}},
            "then": _has_text("modelica"),
        },
        *(
            {
                "if": {"required": [key], "properties": {key: {"not": {"type": "null"}}}},
                "then": _has_text("fmu"),
            }
            for key in ("solver", "tolerance")
        ),
    ],
}


class SolverSpec(Spec):
    """Integration of a Model Exchange FMU."""

    method: Method = key(
        (
            '"euler", "rk4": explicit methods with fixed step size; "cvode": BDF with variable '
            "step size and root finding"
        ),
        "euler",
    )
    step_size: Period | None = key(
        "largest step size of a method with fixed step size; default: that of the FMU's default "
        "experiment, "
        "or else the time between two steps of the component",
        0.001,
        unit="s",
        default=None,
    )

    @model_validator(mode="after")
    def _check_step_size(self) -> SolverSpec:
        if self.step_size is not None and self.method == "cvode":
            raise ValueError(
                '"step_size" is for methods with fixed step size; "cvode" has a "tolerance"'
            )
        return self


class ComponentSpec(Spec):
    """A component with exactly one source: fmu, python, modelica or system.

    Paths start from the folder of this file.
    """

    model_config = ConfigDict(json_schema_extra=_COMPONENT_RULES)

    fmu: str | None = key("path of an FMU", "../fmus/strider_autopilot.fmu", default=None)
    python: str | None = key(
        '"file.py:Class": a PythonFMU class or a component class of cosim',
        "my_autopilot.py:Autopilot",
        default=None,
    )
    modelica: str | None = key(
        '"file.mo:Model"; built when needed (requires the extra "build")',
        "MyAutopilot.mo:MyAutopilot",
        default=None,
    )
    libraries: list[str] = key(
        (
            "folders of Modelica libraries, searched before those of MODELICAPATH; only for "
            "Modelica models"
        ),
        ["../modelica"],
        default=[],
    )
    system: str | None = key(
        "path of the JSON file of a nested system", "systems/strider_autopilot.json", default=None
    )
    arguments: dict[str, Any] = key(
        "arguments of the constructor; only for Python components",
        {"environment": {"seed": 1}},
        default={},
    )
    parameters: dict[str, Value] = key(
        "values of parameters and start values, by variable name; a list sets an array, nested "
        "lists one of several dimensions; "
        "a Binary is a text of hexadecimal digits",
        {"speed_command": 1.0, "waypoint_x": [3.0, 3.0, -3.0]},
        default={},
    )
    period: Period | None = key(
        "time between two steps; default: every macro step", 0.02, unit="s", default=None
    )
    isolation: Literal["fmu"] | None = key("run the FMU in a separate process", "fmu", default=None)
    solver: SolverSpec | None = key(
        (
            "simulate by Model Exchange with this solver; default: by Co-Simulation if the FMU has "
            "it, else cvode"
        ),
        {"method": "euler", "step_size": 0.001},
        default=None,
    )
    tolerance: float | None = key(
        (
            "relative tolerance of the FMU and of its solver; default: that of the FMU's default "
            "experiment"
        ),
        1e-6,
        default=None,
        gt=0,
        allow_inf_nan=False,
    )

    @model_validator(mode="after")
    def _one_source(self) -> ComponentSpec:
        given = [source for source in SOURCES if getattr(self, source) is not None]
        if len(given) != 1:
            raise ValueError(
                f"expected exactly one of {', '.join(SOURCES)}; found "
                f"{' and '.join(given) or 'none'}"
            )
        if self.arguments and self.python is None:
            raise ValueError(
                '"arguments" are for components with "python"; variables are set with "parameters"'
            )
        if self.libraries and self.modelica is None:
            raise ValueError('"libraries" are for components with "modelica"')
        if self.isolation and self.fmu is None and self.modelica is None:
            raise ValueError('"isolation" is for components with "fmu" or "modelica"')
        for name in ("solver", "tolerance"):
            if getattr(self, name) is not None and self.fmu is None:
                raise ValueError(f'"{name}" is for components with "fmu"')
        return self
