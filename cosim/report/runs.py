"""Results folders of `cosim run`: read results and load the figure functions of their scenarios."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, cast

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    RootModel,
    ValidationError,
    model_validator,
)

from ..core.errors import InputError
from ..core.json_values import is_number, parse_object
from ..results import Kpis, Result, RunMetadata
from ..results.kpi import NamedCall
from ..scenario.json_document import read_document
from ..scenario.named_functions import load_function
from ..scenario.validation import schema_problems


def _check_kpi(value: Any) -> Any:
    if value is not None and not is_number(value):
        raise ValueError("expected a number, true, false or null")
    return value


class _Part(BaseModel):
    """Part of a file that `cosim run` has written, as far as reports read it."""

    model_config = ConfigDict(extra="allow", strict=True)


class _Check(_Part):
    kpi: str


class _Function(_Part):
    python: str
    arguments: dict[str, Any] = {}


class _Figure(_Function):
    name: str


class _ScenarioComponent(_Part):
    python: str | None = None
    system: str | dict[str, Any] | None = None
    parameters: dict[str, Any] = {}
    arguments: dict[str, Any] = {}


class _Scenario(_Part):
    description: str = ""
    components: dict[str, _ScenarioComponent] = {}
    checks: list[_Check] = []
    figures: list[_Figure] = []
    scene: _Function | None = None


class _Component(_Part):
    name: str
    origin: str
    inputs: int
    outputs: int
    period: float | None = None


class _Group(_Part):
    name: str
    stages: list[list[str | _Group]]


class _System(_Part):
    components: list[_Component]
    stages: list[list[str | _Group]]
    connections: list[Annotated[list[str], Field(min_length=4, max_length=4)]]

    @model_validator(mode="after")
    def _check_names(self) -> _System:
        known = {component.name for component in self.components}
        if unknown := [name for name in _member_names(self.stages) if name not in known]:
            raise ValueError(f'the stages name "{unknown[0]}", which is no component')
        return self


def _member_names(stages: list[list[str | _Group]]) -> list[str]:
    names: list[str] = []
    for stage in stages:
        for member in stage:
            names += [member] if isinstance(member, str) else _member_names(member.stages)
    return names


class _Termination(_Part):
    time: float
    component: str = ""
    condition: str = ""
    outcome: str = ""
    cause: str = ""
    since: float = 0.0


class _Pacing(_Part):
    steps: int
    late_steps: int


class RunFile(_Part):
    """Content of run.json."""

    name: str = "run"
    failure: str | None = None
    scenario: _Scenario = _Scenario()
    scenario_file: str = ""
    system: _System | None = None
    versions: dict[str, str] = {}
    machine: dict[str, str] = {}
    sha256: dict[str, str] = {}
    timing: dict[str, float] = {}
    units: dict[str, str] = {}
    kpi_units: dict[str, str] = {}
    kpi_notes: list[str] = []
    check_notes: list[str] = []
    warnings: list[str] = []
    live_events: list[Any] = []
    terminated_by: _Termination | None = None
    real_time: _Pacing | None = None


class KpiFile(RootModel[dict[str, Annotated[Any, BeforeValidator(_check_kpi)]]]):
    """Content of kpis.json."""


def read_run(directory: str | Path) -> Result:
    """Read the result, KPIs, timing and metadata from a folder that `cosim run` wrote.

    Boolean signals become 0 and 1, see `Result.from_csv`.

    Raises:
        InputError: A file is missing or invalid.
    """
    directory = Path(directory)
    about = _read_json(directory / "run.json", RunFile)
    timing, units = about.pop("timing", {}), about.pop("units", {})
    kpis = (
        _read_json(directory / "kpis.json", KpiFile) if (directory / "kpis.json").exists() else {}
    )
    numbers = {name: math.nan if value is None else value for name, value in kpis.items()}
    recording = Result.from_csv(directory / "result.csv").recording
    return Result(
        replace(recording, units={**recording.units, **units}),
        Kpis(numbers),
        timing,
        cast(RunMetadata, about),
    )


def _read_json(path: Path, schema: type[BaseModel]) -> dict[str, Any]:
    """Read a JSON object that `cosim run` has written.

    Raise InputError, with the line, if another program has changed it.
    """
    try:
        value = parse_object(path.read_text(encoding="utf-8"))
        schema.model_validate(value)
    except OSError as error:
        raise InputError(
            f"cannot read {path}: {error.strerror}; expected a folder that `cosim run` wrote"
        ) from error
    except ValidationError as error:
        raise InputError(schema_problems(schema, read_document(path), error)) from None
    except ValueError as error:
        raise InputError(
            f"{path} is not valid JSON: {error}; expected a file that `cosim run` wrote"
        ) from error
    return value


def load_figures(result: Result) -> list[NamedCall]:
    """Import the figures of a result's scenario: name, function and arguments of each.

    Raises:
        InputError: The scenario file is unknown, or a function does not exist.
    """
    specs = result.metadata.get("scenario", {}).get("figures", [])
    if not specs:
        return []
    if "scenario_file" not in result.metadata:
        raise InputError(
            'run.json has no "scenario_file", so the figure functions cannot be found: run the '
            "scenario again"
        )
    folder = Path(result.metadata["scenario_file"]).parent
    return [
        (spec["name"], load_function(spec["python"], folder), spec.get("arguments", {}))
        for spec in specs
    ]
