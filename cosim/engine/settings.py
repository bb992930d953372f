"""Settings of one simulation run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from ..core.expressions import Expression
from ..core.system import Endpoint
from .pacer import LatePolicy

ExecutorKind = Literal["auto", "native", "python"]
NonFinitePolicy = Literal["error", "allow", "fail"]
StopOutcome = Literal["crash", "decided"]


@dataclass(frozen=True, slots=True)
class Event:
    """Values that are set at a time, before the macro step that starts there.

    An event after the stop time has no effect.

    Attributes:
        time: a communication point (s, exact).
        values: component -> variable -> value.
        where: location in the scenario file, for messages.
    """

    time: Fraction
    values: Mapping[str, Mapping[str, Any]]
    where: str = ""


@dataclass(frozen=True, slots=True)
class StopCondition:
    """Condition that ends the simulation.

    Attributes:
        name: name for messages.
        expression: condition on recorded signals.
        hold: time for which the condition must be met without interruption (s, exact).
        outcome: meaning of the end.
    """

    name: str
    expression: Expression
    hold: Fraction = Fraction(0)
    outcome: StopOutcome = "decided"


@dataclass(frozen=True)
class Settings:
    """Time span, step size and further settings of a simulation.

    Attributes:
        start_time: start time (s, exact).
        stop_time: stop time (s, exact).
        step_size: size of a macro step (s, exact).
        columns: recorded name -> output.
        record_interval: time between recorded points (s, exact); None: every macro step.
        events: values to set during the run.
        stop_conditions: conditions that end the simulation before the stop time; their signals are
            recorded.
        executor: kind of the executor.
        non_finite: treatment of NaN and infinity; "error": a connected output ends the run; "fail":
            a recorded output ends it too; "allow": no output ends it.
        real_time: simulated seconds per second of wall time; None: as fast as possible.
        late: reaction to a step that is more than one step late in real time.
        rows_file: file for the recorded rows; None: in memory, or in a temporary file if there are
            very many.
    """

    start_time: Fraction
    stop_time: Fraction
    step_size: Fraction
    columns: Mapping[str, Endpoint] = field(default_factory=dict)
    record_interval: Fraction | None = None
    events: Sequence[Event] = ()
    stop_conditions: Sequence[StopCondition] = ()
    executor: ExecutorKind = "auto"
    non_finite: NonFinitePolicy = "error"
    real_time: float | None = None
    late: LatePolicy = "warn"
    rows_file: Path | None = None
