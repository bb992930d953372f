"""Data model of scenario and nested-system files.

`cosim schema` prints it as JSON Schema: the docstrings of the classes and the descriptions of the fields are user documentation.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, StringConstraints, model_validator

from ..engine.settings import NonFinitePolicy
from .schema_types import INVALID, AutoOrBool, BoolOrNumber, Integer, Name, NameList, Period, Seconds, Spec, Value

#: keys of the sources of a component
SOURCES = ("fmu", "python", "modelica", "system")


#: lists whose elements can be changed by an object in a file with "extends", and the key that names their elements
KEYED_LISTS = {("connections",): "to", ("kpis",): "name", ("figures",): "name", ("checks",): "kpi"}
#: keys that a file with "extends" does not inherit
NOT_INHERITED = ("$schema", "name", "description", "reference")


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
    ],
}
_CONNECTION_RULES: dict[str, Any] = {
    "anyOf": [
        {"properties": {end: {"pattern": pattern} for end in ("from", "to")}} for pattern in (r"^[^*]*$", r"^[^*]*\*[^*]*$")
    ]
}
_CHECK_RULES: dict[str, Any] = {
    "anyOf": [{"required": [bound], "properties": {bound: {"not": {"type": "null"}}}} for bound in ("min", "max", "equals")]
}


class ComponentSpec(Spec):
    """A component with exactly one source: fmu, python, modelica or system. Paths start from the folder of this file."""

    model_config = ConfigDict(json_schema_extra=_COMPONENT_RULES)

    fmu: str | None = Field(default=None, description="path of an FMU")
    python: str | None = Field(default=None, description='"file.py:Class": a PythonFMU class or a component class of cosim')
    modelica: str | None = Field(default=None, description='"file.mo:Model"; built when needed (requires the extra "build")')
    libraries: list[str] = Field(
        default=[], description="folders of Modelica libraries, searched before those of MODELICAPATH; only for Modelica models"
    )
    system: str | None = Field(default=None, description="path of the JSON file of a nested system")
    arguments: dict[str, Any] = Field(default={}, description="arguments of the constructor; only for Python components")
    parameters: dict[str, Value] = Field(default={}, description="values of parameters and start values, by variable name")
    period: Period | None = Field(default=None, description="time between two steps (s); default: every macro step")
    isolation: Literal["fmu"] | None = Field(default=None, description="run the FMU in a separate process")

    @model_validator(mode="after")
    def _one_source(self) -> ComponentSpec:
        given = [source for source in SOURCES if getattr(self, source) is not None]
        if len(given) != 1:
            raise ValueError(f"expected exactly one of {', '.join(SOURCES)}; found {' and '.join(given) or 'none'}")
        if self.arguments and self.python is None:
            raise ValueError('"arguments" are for components with "python"; variables are set with "parameters"')
        if self.libraries and self.modelica is None:
            raise ValueError('"libraries" are for components with "modelica"')
        if self.isolation and self.fmu is None and self.modelica is None:
            raise ValueError('"isolation" is for components with "fmu" or "modelica"')
        return self


class ConnectionSpec(Spec):
    """A connection of an output to an input, of two prefixes, or of two patterns with one "*" each.

    Variables below prefixes match if their names after the prefixes are equal; those of patterns, if the texts at "*" are equal.
    """

    model_config = ConfigDict(json_schema_extra=_CONNECTION_RULES)

    source: str = Field(alias="from", description='output "component.variable", a prefix of outputs, or a pattern')
    target: str = Field(alias="to", description='input "component.variable", a prefix of inputs, or a pattern')
    gain: float = Field(default=1.0, description="factor that is applied after the conversion of units")
    offset: float = Field(default=0.0, description="value that is added after the gain, in the unit of the input")
    delay: Integer = Field(
        default=0, ge=0, le=1_000_000, description="delay in macro steps; the input keeps the initial output until then"
    )

    @model_validator(mode="after")
    def _same_wildcards(self) -> ConnectionSpec:
        if self is not INVALID and (self.source.count("*"), self.target.count("*")) not in ((0, 0), (1, 1)):
            raise ValueError('expected one "*" in each of "from" and "to", or none')
        return self


class IterationSpec(Spec):
    """Fixed-point iteration: every macro step is repeated from the same state until the connected outputs converge."""

    tolerance: float = Field(
        default=1e-9, gt=0, description="an output y has converged if it changes by at most tolerance * (1 + |y|)"
    )
    limit: Integer = Field(default=50, ge=2, description="largest number of iterations in a macro step; more are an error")


class AlgorithmSpec(Spec):
    """The order of execution in a macro step.

    Stages step one after the other (Gauss-Seidel). The components of a stage step side by side (Jacobi).
    """

    kind: Literal["staged"] = "staged"
    stages: list[list[Name]] = Field(description="names of components, each in exactly one stage")
    parallel: AutoOrBool = Field(
        default="auto",
        description="run the FMUs of a stage in parallel threads, with identical results. true: always; false: never; auto: if "
        'their measured steps are long enough. With "auto", instances of the same FMU file never run in parallel',
    )
    iteration: IterationSpec | None = Field(
        default=None,
        description="repeat the stages in every macro step until they converge; all components must save and restore states",
    )


class RecordSpec(Spec):
    """The signals that are recorded, and the recording interval."""

    signals: list[str] = Field(default=["*"], description='patterns of signal names; "*" matches any characters, including dots')
    interval: Period | None = Field(default=None, description="time between two rows (s); default: the step size")


class EventSpec(Spec):
    """Values that variables are set to at a communication point, before the step that starts there."""

    time: Seconds = Field(description="a communication point (s)")
    values: dict[str, Value] = Field(alias="set", description="values of tunable parameters and unconnected inputs, by name")


class InputSpec(Spec):
    """An input profile over time from a CSV file."""

    file: str = Field(description='path of the CSV file; its first column is "time" (s)')
    to: dict[str, NameList] = Field(description="the inputs that each column is connected to")
    interpolation: Literal["linear", "hold"] = Field(
        default="linear", description="value between two rows; hold: that of the last row"
    )


class CallSpec(Spec):
    """A Python function that is called with the scenario as its first argument."""

    python: str = Field(description='"file.py:function" or "package.module:function"')
    arguments: dict[str, Any] = Field(
        default={},
        description='keyword arguments of the function; {"from": "usv.waypoint_x"} is the value of a parameter, and '
        '{"from": "/components/plant/arguments/platforms"} that of an entry of the scenario',
    )
    sources: NameList = Field(
        default=[],
        alias="from",
        description='components ("usv"), prefixes of variables ("plant.uav") or JSON pointers of objects, from which arguments '
        "that are not given are taken by name",
    )


class FunctionSpec(CallSpec):
    """A Python function that is called with the result: a KPI returns numbers, a figure returns a matplotlib Figure."""

    name: Name = Field(description="unique name; that of a KPI is the prefix of its values, that of a figure the file name")
    optional: bool = Field(
        default=False, description="leave it out with a warning if an argument names a signal or parameter that does not exist"
    )


class CheckSpec(Spec):
    """A requirement on a KPI value; a run passes if it meets all checks."""

    model_config = ConfigDict(json_schema_extra=_CHECK_RULES)

    kpi: str = Field(description='name of a KPI value, such as "landing.lateral_error"')
    min: float | None = Field(default=None, description="smallest value that passes")
    max: float | None = Field(default=None, description="largest value that passes")
    equals: BoolOrNumber | None = Field(default=None, description="the only value that passes")

    @model_validator(mode="after")
    def _bounded(self) -> CheckSpec:
        if self is not INVALID:
            self._check_bounds()
        return self

    def _check_bounds(self) -> None:
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError('expected "min" to be at most "max"')
        if self.min is None and self.max is None and self.equals is None:
            raise ValueError('expected at least one of "min", "max", "equals"')


class ToleranceSpec(Spec):
    """Half width of the tolerance tube around a reference signal."""

    absolute: float = Field(default=0.0, ge=0, description="in the unit of the signal")
    relative: float = Field(default=0.0, ge=0, description="fraction of the range (maximum - minimum) of the reference signal")
    time: float = Field(default=0.0, ge=0, description="along the time axis (s)")


class ReferenceSpec(Spec):
    """A recorded reference trajectory that `cosim compare` and `cosim regress` compare the result with."""

    file: str = Field(description="path of a CSV file with recorded signals")
    tolerances: dict[str, ToleranceSpec] = Field(description="tolerances by pattern; only matching signals are compared")


class PortsSpec(Spec):
    """The ports of a nested system: names for inner variables or prefixes that outer systems can connect and set."""

    inputs: dict[Name, NameList] = Field(default={}, description="one or more inner inputs or prefixes of inputs for each port")
    outputs: dict[Name, str] = Field(default={}, description="an inner output or prefix of outputs for each port")
    parameters: dict[Name, NameList] = Field(default={}, description="one or more inner parameters or prefixes for each port")


class DeadlinesSpec(Spec):
    """The longest time that one call of a component may take in a supervised run (s, wall time)."""

    load: float = Field(default=10.0, gt=0, description="to load and instantiate")
    initialization: float = Field(default=10.0, gt=0, description="until the end of initialization mode")
    step: float = Field(default=5.0, gt=0, description="while stepping")
    end: float = Field(default=5.0, gt=0, description="to terminate and free")


class SystemSpec(Spec):
    """Components and their connections."""

    schema_: str | None = Field(default=None, alias="$schema", description="path of the JSON Schema, for editors")
    name: str = Field(default="", description="name of the system")
    description: str = Field(default="", description="text for reports and people")
    components: dict[Name, ComponentSpec] = Field(description="components by name")
    connections: list[ConnectionSpec] = Field(default=[], description="connections of outputs to inputs")
    algorithm: AlgorithmSpec | None = Field(
        default=None, description="order of execution; default: the components step one after the other in the order of this file"
    )


class NestedSpec(SystemSpec):
    """A nested system: components and connections without times, used by a scenario or another nested system."""

    ports: PortsSpec = Field(default=PortsSpec(), description="inner variables that outer systems can connect and set")


class ScenarioSpec(SystemSpec):
    """A scenario: a system of components, its times, recorded signals, events, KPIs, checks and figures."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_. -]*$")] = Field(
        description="name of the scenario and of its results folder"
    )
    start_time: Seconds = Field(default=Fraction(0), description="s")
    stop_time: Seconds = Field(description="s; the duration is a multiple of the step size")
    step_size: Period = Field(description="macro step: time between two communication points (s)")
    record: RecordSpec = Field(
        default=RecordSpec(), description="recorded signals; default: all outputs at every communication point"
    )
    events: list[EventSpec] = Field(default=[], description="values that are set during the run")
    inputs: list[InputSpec] = Field(default=[], description="input profiles from CSV files")
    kpis: list[FunctionSpec] = Field(default=[], description="functions that compute numbers from the result")
    checks: list[CheckSpec] = Field(default=[], description="requirements on KPI values")
    figures: list[FunctionSpec] = Field(default=[], description="functions that draw figures from the result")
    scene: CallSpec | None = Field(default=None, description="function that returns the scene of the 3-D replay")
    reference: ReferenceSpec | None = Field(default=None, description="recorded trajectory for comparisons")
    deadlines: DeadlinesSpec = Field(default=DeadlinesSpec(), description="time limits of calls in supervised runs")
    non_finite: NonFinitePolicy = Field(
        default="error",
        description="treatment of NaN and infinity. error: on a connected output they end the run, on a recorded one they give a "
        "warning; fail: on a connected or recorded output they end the run; allow: neither",
    )


def ports_of(spec: SystemSpec) -> PortsSpec:
    """Return the ports of a nested system; a scenario has none."""
    return spec.ports if isinstance(spec, NestedSpec) else PortsSpec()


def json_schema(nested: bool = False) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of scenario files, or of nested-system files."""
    schema = (NestedSpec if nested else ScenarioSpec).model_json_schema(by_alias=True)
    return complete_schema(schema)


def complete_schema(schema: dict[str, Any]) -> dict[str, Any]:
    """Add the version to a JSON Schema, and refuse names that do not match the patterns of names."""
    _refuse_other_names(schema)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _refuse_other_names(schema: Any) -> None:
    if isinstance(schema, dict):
        if "patternProperties" in schema:
            schema["additionalProperties"] = False
        for value in schema.values():
            _refuse_other_names(value)
    elif isinstance(schema, list):
        for value in schema:
            _refuse_other_names(value)
