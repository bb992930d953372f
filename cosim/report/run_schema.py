"""Schema of the files that `cosim run` writes, as far as reports read them.

Other keys are allowed.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, RootModel, model_validator

from ..core.json_values import is_number


def _check_kpi(value: Any) -> Any:
    if value is not None and not is_number(value):
        raise ValueError("expected a number, true, false or null")
    return value


class _Part(BaseModel):
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
    system: str | None = None
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
    members = [member for stage in stages for member in stage]
    return [
        name
        for member in members
        for name in ([member] if isinstance(member, str) else _member_names(member.stages))
    ]


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
