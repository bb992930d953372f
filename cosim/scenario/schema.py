"""The scenario format: what a scenario or nested-system JSON may contain. `cosim schema` prints it as JSON Schema."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    WithJsonSchema,
    model_validator,
)

from ..core.time_grid import exact_fraction

S = TypeVar("S")
SOURCES = ("fmu", "python", "modelica", "system")


def _parse_time(value: Any) -> Fraction:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError('expected seconds as a number or as a fraction in text such as "1/60"')
    try:
        return exact_fraction(value)
    except (ValueError, ZeroDivisionError):
        raise ValueError('expected seconds as a number or as a fraction in text such as "1/60"') from None


def _check_positive(value: Fraction) -> Fraction:
    if value <= 0:
        raise ValueError("expected a positive number of seconds")
    return value


def _check_value(value: Any) -> Any:
    values = value if isinstance(value, list) else [value]
    if not values or not all(isinstance(v, bool | int | float | str) for v in values):
        raise ValueError("expected a number, true, false, a text, or a list of these")
    return value


def _check_auto_or_bool(value: Any) -> Any:
    if value != "auto" and not isinstance(value, bool):
        raise ValueError('expected "auto", true or false')
    return value


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
Seconds = Annotated[
    Fraction,
    BeforeValidator(_parse_time),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "pattern": r"^\d+/\d+$"}]}),
]
Period = Annotated[Seconds, AfterValidator(_check_positive)]
_SCALAR_SCHEMAS = [{"type": kind} for kind in ("number", "boolean", "string")]
Value = Annotated[
    Any,
    BeforeValidator(_check_value),
    WithJsonSchema({"anyOf": [*_SCALAR_SCHEMAS, {"type": "array", "items": {"anyOf": _SCALAR_SCHEMAS}, "minItems": 1}]}),
]
AutoOrBool = Annotated[
    Literal["auto"] | bool, BeforeValidator(_check_auto_or_bool), WithJsonSchema({"enum": ["auto", True, False]})
]
NameList = Annotated[
    list[str],
    BeforeValidator(_as_list),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]


class InvalidElement:
    """Stands for a list element that was refused, so that its neighbours keep their indices."""


INVALID: Any = InvalidElement()


class Spec(BaseModel):
    """Base of everything in a scenario: unknown keys and loose types are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, arbitrary_types_allowed=True)

    @model_validator(mode="wrap")
    @classmethod
    def _pass_invalid(cls, value: Any, handler: Any) -> Any:
        return value if value is INVALID else handler(value)


def accepted(specs: Iterable[S]) -> Iterator[tuple[int, S]]:
    """(index, spec) of those list elements that were not refused."""
    return ((i, spec) for i, spec in enumerate(specs) if spec is not INVALID)


class ComponentSpec(Spec):
    """One component: exactly one source, and what it is started with."""

    fmu: str | None = Field(None, description="path of an FMU")
    python: str | None = Field(None, description='"file.py:Class", a PythonFMU class or a cosim component')
    modelica: str | None = Field(None, description='"file.mo:Model", built when needed (extra "build")')
    system: str | None = Field(None, description="path of a nested system's JSON")
    arguments: dict[str, Any] = Field({}, description="for the constructor of a Python component")
    parameters: dict[str, Value] = Field({}, description="parameters and start values by variable name")
    period: Period | None = Field(None, description="seconds between two steps; default: every macro step")
    isolation: Literal["fmu"] | None = Field(None, description="the FMU runs in a process of its own")

    @model_validator(mode="after")
    def _one_source(self) -> ComponentSpec:
        given = [source for source in SOURCES if getattr(self, source) is not None]
        if len(given) != 1:
            raise ValueError(f"expected exactly one of {', '.join(SOURCES)}; found {' and '.join(given) or 'none'}")
        if self.arguments and self.python is None:
            raise ValueError('"arguments" are for components with "python"; variables are set with "parameters"')
        if self.isolation and self.fmu is None and self.modelica is None:
            raise ValueError('"isolation" is for components with "fmu" or "modelica"')
        return self


class ConnectionSpec(Spec):
    """Output to input: two variables, or two prefixes whose variables are matched by the rest of their names."""

    source: str = Field(alias="from")
    target: str = Field(alias="to")
    delay: int = Field(0, ge=0, le=1_000_000, description="macro steps; until then the initial output arrives")


class IterationSpec(Spec):
    """Repeating every macro step from the same state until the connected outputs stand still."""

    tolerance: float = Field(1e-9, gt=0, description="y stands still when it changes by at most tolerance * (1 + |y|)")
    limit: int = Field(50, ge=2, description="rounds in a macro step; more are an error")


class AlgorithmSpec(Spec):
    """Stages step one after the other, the components of a stage side by side."""

    kind: Literal["staged"] = "staged"
    stages: list[list[Name]]
    parallel: AutoOrBool = Field(
        "auto",
        description="whether the FMUs of a stage step at the same time, on threads, with the same result: where their measured "
        "steps are long enough (instances of one file never at once), always, or never",
    )
    iteration: IterationSpec | None = Field(
        None, description="repeat the stages in every macro step until they agree; all components must have states to return to"
    )


class RecordSpec(Spec):
    """Which outputs are kept ("*" also matches dots) and how often."""

    signals: list[str] = ["*"]
    interval: Period | None = None


class EventSpec(Spec):
    """At a communication point, before the step that starts there, variables are set."""

    time: Seconds
    values: dict[str, Value] = Field(alias="set")


class InputSpec(Spec):
    """A profile over time from a CSV file (first column "time"), each named column to one or more inputs."""

    file: str
    to: dict[str, NameList]
    interpolation: Literal["linear", "hold"] = "linear"


class CallSpec(Spec):
    """A Python function and its keyword arguments; the first argument is what it is about."""

    python: str = Field(description='"file.py:function" or "package.module:function"')
    arguments: dict[str, Any] = {}


class FunctionSpec(CallSpec):
    """A Python function of the result: a KPI (returns numbers) or a figure (returns a matplotlib Figure)."""

    name: Name


class CheckSpec(Spec):
    """A KPI and what it must be for the run to pass."""

    kpi: str
    min: float | None = None
    max: float | None = None
    equals: bool | int | float | None = None

    @model_validator(mode="after")
    def _bounded(self) -> CheckSpec:
        if self is not INVALID and None not in (self.min, self.max) and self.min > self.max:  # type: ignore[operator]
            raise ValueError('expected "min" to be at most "max"')
        if self is not INVALID and self.min is None and self.max is None and self.equals is None:
            raise ValueError('expected at least one of "min", "max", "equals"')
        return self


class ToleranceSpec(Spec):
    """Half width of the tube around a reference, in value and in time (s)."""

    absolute: float = Field(0.0, ge=0)
    relative: float = Field(0.0, ge=0)
    time: float = Field(0.0, ge=0)


class ReferenceSpec(Spec):
    """A recorded trajectory to compare with; only signals that match a pattern are compared."""

    file: str
    tolerances: dict[str, ToleranceSpec]


class PortsSpec(Spec):
    """What a nested system shows to the outside: each port is one or more inner variables or prefixes."""

    inputs: dict[Name, NameList] = {}
    outputs: dict[Name, str] = {}
    parameters: dict[Name, NameList] = {}


class DeadlinesSpec(Spec):
    """How long one call into a component may take in a supervised run (s of wall time)."""

    load: float = Field(10.0, gt=0, description="load and instantiate")
    initialization: float = Field(10.0, gt=0, description="until the end of initialization mode")
    step: float = Field(5.0, gt=0, description="while stepping")
    end: float = Field(5.0, gt=0, description="terminate and free")


class SystemSpec(Spec):
    """Components and how they are connected: the core of scenarios and nested systems."""

    schema_: str | None = Field(None, alias="$schema")
    name: str = ""
    description: str = ""
    components: dict[Name, ComponentSpec]
    connections: list[ConnectionSpec] = []
    algorithm: AlgorithmSpec | None = Field(None, description="default: one component per stage in the listed order")


class NestedSpec(SystemSpec):
    """A nested system: a system without times that shows ports."""

    ports: PortsSpec = PortsSpec()


class ScenarioSpec(SystemSpec):
    """A whole scenario: a system, its times, and what to keep, compute, check and draw."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_. -]*$")] = Field(
        description="also the name of the folder for results"
    )
    start_time: Seconds = Fraction(0)
    stop_time: Seconds
    step_size: Period
    record: RecordSpec = RecordSpec()
    events: list[EventSpec] = []
    inputs: list[InputSpec] = []
    kpis: list[FunctionSpec] = []
    checks: list[CheckSpec] = []
    figures: list[FunctionSpec] = []
    scene: CallSpec | None = Field(None, description="function of the scenario that says what the 3-D replay draws")
    reference: ReferenceSpec | None = None
    deadlines: DeadlinesSpec = DeadlinesSpec(load=10.0, initialization=10.0, step=5.0, end=5.0)
    non_finite: Literal["error", "allow"] = Field("error", description="what NaN or infinity on a connected output is")


def json_schema(nested: bool = False) -> dict[str, Any]:
    """JSON Schema (2020-12) of a scenario file, or of a nested system's."""
    schema = (NestedSpec if nested else ScenarioSpec).model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
