"""Data model of scenario and nested-system files.

`cosim schema` prints it as JSON Schema: the docstrings of the classes and the descriptions of the
fields are user documentation.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, StringConstraints, model_validator

from ..core.system import Interpolation, IterationMethod
from ..core.text import count_noun
from ..engine.settings import NonFinitePolicy, StopOutcome
from .component_schema import ComponentSpec, component_model
from .component_sources import InputTableSource
from .evaluation_schema import CallSpec, CheckSpec, FunctionSpec, ReferenceSpec
from .schema_types import (
    INVALID,
    AutoOrBool,
    Duration,
    Gain,
    Integer,
    Name,
    NameList,
    Period,
    Seconds,
    Spec,
    Value,
    key,
    schema_of,
)

#: pattern of the names of scenarios
SCENARIO_NAME = r"^[A-Za-z0-9_][A-Za-z0-9_. -]*$"

#: lists whose elements can be changed by an object in a file with "extends", and the key that names
#: their elements
KEYED_LISTS = {
    "connections": "to",
    "kpis": "name",
    "figures": "name",
    "checks": "kpi",
    "stop_when": "name",
}
#: keys that a file with "extends" does not inherit
NOT_INHERITED = ("$schema", "name", "description", "reference")


def _names_like(pattern: str) -> dict[str, Any]:
    """Return the JSON Schema of one or more names."""
    return {"pattern": pattern, "items": {"pattern": pattern}, "minItems": 1}


#: the rules of the validators below that JSON Schema can express
_CONNECTION_RULES: dict[str, Any] = {
    "anyOf": [
        {"properties": dict.fromkeys(("from", "to"), _names_like(pattern))}
        for pattern in (r"^[^*]*$", r"^[^*]*\*[^*]*$")
    ]
}


class ConnectionSpec(Spec):
    """A connection of an output to an input, of two prefixes, or of two patterns with one "*" each.

    Variables below prefixes match if their names after the prefixes are equal; those of patterns,
    if the texts at "*" are equal. The outputs of a list are added: input = gain * output + gain *
    output + ... + offset.
    """

    model_config = ConfigDict(json_schema_extra=_CONNECTION_RULES)

    sources: NameList = key(
        'output "component.variable", a prefix of outputs, or a pattern; the outputs of a list '
        "are added",
        "plant.uav",
        alias="from",
    )
    target: str = key(
        'input "component.variable", a prefix of inputs, or a pattern', "uav.vehicle", alias="to"
    )
    gain: Gain = key(
        "factor that is applied after the conversion of units; a list has one for each output "
        "of a sum",
        -1.0,
        default=1.0,
    )
    offset: float = key(
        "value that is added after the gain", 0.5, unit="that of the input", default=0.0
    )
    convert: bool = key(
        "convert Booleans (0 or 1) and all integers to floating-point numbers; above 2^53 they "
        "are rounded",
        True,
        default=False,
    )
    interpolation: Interpolation = key(
        "course of the input within a step. hold: constant; linear: through the last two values "
        "of the output, for components "
        "that interpolate their inputs (FMI 2.0: canInterpolateInputs)",
        "linear",
        default="hold",
    )
    delay: Integer = key(
        "delay; the input keeps the initial output until then",
        1,
        unit="macro steps",
        default=0,
        ge=0,
        le=1_000_000,
    )

    @model_validator(mode="after")
    def _same_wildcards(self) -> ConnectionSpec:
        if self is not INVALID and {
            name.count("*") for name in (*self.sources, self.target)
        } not in ({0}, {1}):
            raise ValueError('expected one "*" in each of "from" and "to", or none')
        return self

    @model_validator(mode="after")
    def _one_gain_per_source(self) -> ConnectionSpec:
        if self is not INVALID and not self.sources:
            raise ValueError('expected at least one output in "from"')
        if self is not INVALID and len(self.gains) != len(self.sources):
            outputs = count_noun(len(self.sources), "output")
            raise ValueError(
                f'expected a number or one "gain" for each of {outputs}, found {len(self.gains)}'
            )
        return self

    @property
    def gains(self) -> list[float]:
        """Gain of each source."""
        return self.gain if isinstance(self.gain, list) else [self.gain] * len(self.sources)


class IterationSpec(Spec):
    """Repetition of every macro step from the same state until the connected outputs converge."""

    method: IterationMethod = key(
        "fixed-point: the outputs of a repetition are the inputs of the next one; newton: "
        "converges also where this diverges, "
        "with one more repetition for each connected output",
        "newton",
        default="fixed-point",
    )

    tolerance: float = key(
        "an output y has converged if it changes by at most tolerance * (1 + |y|)",
        1e-6,
        default=1e-9,
        gt=0,
    )
    limit: Integer = key(
        "largest number of iterations in a macro step; more are an error", 20, default=50, ge=2
    )


class AlgorithmSpec(Spec):
    """The order of execution in a macro step.

    Stages step one after the other (Gauss-Seidel). The components of a stage step side by side
    (Jacobi).
    """

    kind: Literal["staged"] = key("the stages step one after the other", "staged", default="staged")
    stages: list[list[Name]] | None = key(
        "names of components, each in exactly one stage; default: one stage for each "
        "component, ordered by their dependencies",
        [["usv", "uav"], ["plant"]],
        default=None,
    )
    parallel: AutoOrBool = key(
        "run the FMUs of a stage in parallel threads, with identical results. true: always; "
        "false: never; auto: if "
        'their measured steps are long enough. With "auto", instances of the same FMU file never '
        "run in parallel",
        False,
        default="auto",
    )
    iteration: IterationSpec | None = key(
        "repeat the stages in every macro step until they converge; all components must save "
        "and restore states",
        {"tolerance": 1e-9, "limit": 50},
        default=None,
    )


class RecordSpec(Spec):
    """The signals that are recorded, and the recording interval."""

    signals: list[str] = key(
        'patterns of signal names; "*" matches any characters, including dots',
        ["plant.*", "usv.rudder_angle"],
        default=["*"],
    )
    interval: Period | None = key(
        "time between two rows; default: the step size", 0.1, unit="s", default=None
    )


class EventSpec(Spec):
    """Values that are set at a communication point, before the step that starts there."""

    time: Seconds = key("a communication point", 20.0, unit="s")
    values: dict[str, Value] = key(
        "values of tunable parameters and unconnected inputs, by name",
        {"plant.usv.external_force.y": 2.0},
        alias="set",
    )


class StopSpec(Spec):
    """A condition that ends the run before the stop time.

    The run ends at the first recorded point at which the condition has been met for its hold time
    without interruption.
    """

    name: Name = key("unique name for messages", "landed")
    when: str = key(
        "condition on recorded signals",
        "plant.uav.crashed or plant.uav.position.z < 0 and uav.mode >= 2",
    )
    for_: Duration = key("hold time", 3.0, unit="s", default=Fraction(0), alias="for")
    outcome: StopOutcome = key(
        "decided: nothing that matters follows; crash: a failure, exit code 3 of `cosim run`",
        "crash",
        default="decided",
    )


class PortsSpec(Spec):
    """The ports of a nested system.

    Names for inner variables or prefixes that outer systems can connect and set.
    """

    inputs: dict[Name, NameList] = key(
        "one or more inner inputs or prefixes of inputs for each port",
        {"vehicle": ["guidance.vehicle", "speed.vehicle"]},
        default={},
    )
    outputs: dict[Name, str] = key(
        "an inner output or prefix of outputs for each port", {"thrust": "speed.thrust"}, default={}
    )
    parameters: dict[Name, NameList] = key(
        "one or more inner parameters or prefixes for each port", {"gain": "speed.gain"}, default={}
    )


class DeadlinesSpec(Spec):
    """The longest time that one call of a component may take in a supervised run (wall time)."""

    load: float = key("to load and instantiate", 60.0, unit="s", default=10.0, gt=0)
    initialization: float = key(
        "until the end of initialization mode", 30.0, unit="s", default=10.0, gt=0
    )
    step: float = key("while stepping", 1.0, unit="s", default=5.0, gt=0)
    end: float = key("to terminate and free", 10.0, unit="s", default=5.0, gt=0)


class SystemSpec(Spec):
    """Components and their connections."""

    schema_: str | None = key(
        "path of the JSON Schema, for editors",
        "scenario.schema.json",
        default=None,
        alias="$schema",
    )
    name: str = key("name of the system", "strider_autopilot", default="")
    description: str = key(
        "text for reports and people", "The vessel keeps its course.", default=""
    )
    components: dict[Name, ComponentSpec] = key(
        "components by name", {"usv": {"fmu": "../fmus/strider_autopilot.fmu"}}
    )
    connections: list[ConnectionSpec] = key(
        "connections of outputs to inputs", [{"from": "plant.usv", "to": "usv.vehicle"}], default=[]
    )
    algorithm: AlgorithmSpec | None = key(
        "order of execution; default: the components step one after the other, ordered by "
        "their dependencies",
        {"kind": "staged", "stages": [["usv", "uav"], ["plant"]]},
        default=None,
    )


class NestedSpec(SystemSpec):
    """A nested system.

    Components and connections without times, used by a scenario or another nested system.
    """

    ports: PortsSpec = key(
        "inner variables that outer systems can connect and set",
        {"inputs": {"vehicle": "speed.vehicle"}, "outputs": {"thrust": "speed.thrust"}},
        default=PortsSpec(),
    )


class ScenarioSpec(SystemSpec):
    """A system of components with times, recorded signals, events, KPIs, checks and figures."""

    name: Annotated[str, StringConstraints(pattern=SCENARIO_NAME)] = key(
        "name of the scenario and of its results folder", "demo1_box"
    )
    start_time: Seconds = key("time at the start of the run", 0.0, unit="s", default=Fraction(0))
    stop_time: Seconds = key(
        "stop time; the run ends at the last whole multiple of the step size and of all "
        "periods until then",
        40.0,
        unit="s",
    )
    step_size: Period = key(
        "macro step: time between two communication points, as a number or a fraction such as "
        '"1/60"',
        0.01,
        unit="s",
    )
    record: RecordSpec = key(
        "recorded signals; default: all outputs at every communication point",
        {"signals": ["plant.*"], "interval": 0.1},
        default=RecordSpec(),
    )
    events: list[EventSpec] = key(
        "values that are set during the run",
        [{"time": 20.0, "set": {"plant.usv.external_force.y": 2.0}}],
        default=[],
    )
    inputs: list[InputTableSource] = key(
        "input profiles from CSV files",
        [{"file": "profiles/accelerations.csv", "to": {"ax": "uav.ax"}}],
        default=[],
    )
    kpis: list[FunctionSpec] = key(
        "functions that compute numbers from the result",
        [
            {
                "name": "altitude",
                "python": "cosim.kpis:rms",
                "arguments": {"signal": "plant.uav.position.z"},
            }
        ],
        default=[],
    )
    checks: list[CheckSpec] = key(
        "requirements on KPI values", [{"kpi": "altitude.value", "max": 0.1}], default=[]
    )
    figures: list[FunctionSpec] = key(
        "functions that draw figures from the result",
        [
            {
                "name": "course",
                "python": "my_figures.py:course",
                "arguments": {"vehicle": "plant.usv"},
            }
        ],
        default=[],
    )
    scene: CallSpec | None = key(
        "function that returns the scene of the 3-D replay; default: what the components describe",
        {"python": "my_figures.py:scene"},
        default=None,
    )
    reference: ReferenceSpec | None = key(
        "recorded trajectory for comparisons",
        {"file": "references/demo1_box.csv", "tolerances": {"plant.*": {"absolute": 0.01}}},
        default=None,
    )
    seeds: list[str] = key(
        "JSON pointers of the entries that a seed sets",
        ["/components/plant/arguments/environment/seed"],
        default=[],
    )
    deadlines: DeadlinesSpec = key(
        "time limits of calls in supervised runs", {"load": 60.0}, default=DeadlinesSpec()
    )
    stop_when: list[StopSpec] = key(
        "conditions that end the run before the stop time",
        [{"name": "crash", "when": "plant.uav.crashed", "outcome": "crash"}],
        default=[],
    )
    non_finite: NonFinitePolicy = key(
        "treatment of NaN and infinity. error: on a connected output they end the run, on a "
        "recorded one they give a "
        "warning; fail: on a connected or recorded output they end the run; allow: neither",
        "fail",
        default="error",
    )


def ports_of(spec: SystemSpec) -> PortsSpec:
    """Return the ports of a nested system; a scenario has none."""
    return spec.ports if isinstance(spec, NestedSpec) else PortsSpec()


def json_schema(nested: bool = False) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of scenario files, or of nested-system files."""
    return schema_of(NestedSpec if nested else ScenarioSpec, component_model(), NestedSpec)
