"""Schemas of sweep and tuning files; `cosim schema --sweep` and `--tune` print them as JSON Schema."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field, StringConstraints, model_validator

from ..core.errors import did_you_mean
from ..scenario.schema import CheckSpec, complete_schema
from ..scenario.schema_types import Integer, NameList, Spec
from .factor_schema import TRIAL_COLUMNS, FactorSpec, Scale, SettingPaths, check_log_scale, check_order, reject_column_names
from .setting_conflicts import check_conflicts


class SeedsSpec(Spec):
    """Replications: every point is run with the same `count` seeds."""

    set: SettingPaths = Field([], description='default: "seeds" of the scenario')
    first: Integer = 1
    count: Integer = Field(ge=1)


class MapSpec(Spec):
    """A map of the success rate over two factors; two more factors may select the columns and rows of panels."""

    x: str
    y: str
    columns: str | None = None
    rows: str | None = None
    titles: dict[str, str] = Field({}, description='factor -> title, such as "wind (m/s)"; empty: no title')

    @property
    def factors(self) -> list[str]:
        """Names of the factors of the map: rows, columns, y and x."""
        return [name for name in (self.rows, self.columns, self.y, self.x) if name is not None]

    @model_validator(mode="after")
    def _different(self) -> MapSpec:
        _check_unique("axes of a map", self.factors)
        return self


class DesignSpec(Spec):
    """Choice of the points: all combinations of levels, or `runs` samples."""

    kind: Literal["full_factorial", "latin_hypercube", "sobol"] = "full_factorial"
    runs: Integer | None = Field(None, ge=1)
    seed: Integer = Field(1, ge=0)

    @model_validator(mode="after")
    def _sized(self) -> DesignSpec:
        if (self.kind == "full_factorial") != (self.runs is None):
            raise ValueError('expected "runs" with latin_hypercube and sobol, and not with full_factorial')
        if self.kind == "sobol" and self.runs and self.runs & (self.runs - 1):
            near = 2 ** round(math.log2(self.runs))
            raise ValueError(f'a Sobol sequence is balanced only for powers of two; expected for example "runs": {near}')
        return self


#: path of a number in a study file
CountPath = tuple["str | int", ...]


class StudySpec(Spec):
    """Common part of sweeps and tunings: a scenario, settings that all runs share, and the deadline of a run."""

    schema_: str | None = Field(None, alias="$schema")
    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_. -]*$")]
    description: str = ""
    scenario: str = Field(description="path relative to this file, or the name of a shipped scenario")
    settings: dict[str, Any] = Field({}, description="settings of all runs, as of `--set`")
    deadline: float | None = Field(None, gt=0, description="wall time that a run may take (s)")

    def run_counts(self) -> dict[CountPath, int]:
        """Return the factors of the largest number of runs, by the paths of the entries that determine them."""
        raise NotImplementedError

    @property
    def max_runs(self) -> int:
        """Largest number of runs of the study."""
        return math.prod(self.run_counts().values())

    def cell_counts(self) -> dict[CountPath, int]:
        """Return the number of cells of each map, by the path of the map."""
        return {}


class SweepSpec(StudySpec):
    """A sweep: factors, a design, seeds and criteria of success."""

    factors: list[FactorSpec] = []
    design: DesignSpec = DesignSpec(kind="full_factorial", runs=None, seed=1)
    seeds: SeedsSpec | None = None
    success: list[CheckSpec] | None = Field(None, description="limits on KPIs; default: the checks of the scenario")
    by: list[NameList] = Field(
        [], description="factors, or lists of factors, by whose levels the runs are grouped in the aggregates"
    )
    maps: list[MapSpec] = Field([], description="maps of the success rate, as figures and in sweep.html")

    @model_validator(mode="after")
    def _consistent(self) -> SweepSpec:
        names = [factor.name for factor in self.factors]
        _check_unique("factors", names)
        seeds = [("seed", [(path, None) for path in self.seeds.set])] if self.seeds else []
        check_conflicts(self.settings, [*((factor.name, factor.settings()) for factor in self.factors), *seeds])
        if not names and self.seeds is None:
            raise ValueError('expected "factors", "seeds" or both')
        for name in (name for group in self.by for name in group):
            if name not in (*names, "seed"):
                raise ValueError(f'"by" names no factor "{name}"{did_you_mean(name, [*names, "seed"])}')
        for each in self.maps:
            _check_map(each, self)
        if self.design.kind == "full_factorial":
            for factor in self.factors:
                part = factor.range or factor.distribution
                if part and part.count is None:
                    raise ValueError(f'the factor "{factor.name}" needs a "count" in a full factorial design')
        return self

    def run_counts(self) -> dict[CountPath, int]:
        """Return the numbers of samples or levels, and of seeds."""
        counts: dict[CountPath, int] = {("factors", i): factor.level_count for i, factor in enumerate(self.factors)}
        if self.design.runs is not None and self.factors:
            counts = {("design", "runs"): self.design.runs}
        return counts | ({("seeds", "count"): self.seeds.count} if self.seeds else {})

    def cell_counts(self) -> dict[CountPath, int]:
        """Return the product of the numbers of levels of each map's factors."""
        levels = {factor.name: factor.level_count for factor in self.factors}
        levels["seed"] = self.seeds.count if self.seeds else 0
        return {("maps", i): math.prod(levels[name] for name in each.factors) for i, each in enumerate(self.maps)}


class ParameterSpec(Spec):
    """A parameter of a tuning, with its bounds."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$"), reject_column_names(*TRIAL_COLUMNS)]
    set: SettingPaths
    min: float
    max: float
    start: float | None = None
    scale: Scale = "linear"

    @model_validator(mode="after")
    def _possible(self) -> ParameterSpec:
        check_order(self.min, self.max)
        check_log_scale(self.scale, self.min)
        if self.start is not None and not self.min <= self.start <= self.max:
            raise ValueError('expected "start" between "min" and "max"')
        return self


class MethodSpec(Spec):
    """An optimization method and its limits."""

    kind: Literal["differential_evolution", "nelder_mead", "powell"] = "differential_evolution"
    population: Integer = Field(16, ge=5, description="points per generation (differential_evolution)")
    generations: Integer = Field(20, ge=1, description="generations after the first (differential_evolution)")
    evaluations: Integer = Field(200, ge=1, description="points at most (nelder_mead, powell)")
    seed: Integer = Field(1, ge=0)


class TuneSpec(StudySpec):
    """A tuning: the expression of KPIs to be minimised, the parameters and the constraints."""

    parameters: list[ParameterSpec] = Field(min_length=1)
    minimize: str = Field(description='arithmetic over KPIs and parameters, such as "landing.lateral_error + 0.1 * gain"')
    constraints: list[str] = Field([], description='comparisons of such expressions, such as "heading.overshoot <= 0.1"')
    cases: list[dict[str, Any]] = Field([{}], min_length=1, description="each point is run with each of these settings")
    over_cases: Literal["mean", "max"] = "mean"
    method: MethodSpec = MethodSpec(population=16, generations=20, evaluations=200, seed=1)

    @model_validator(mode="after")
    def _consistent(self) -> TuneSpec:
        _check_unique("parameters", [parameter.name for parameter in self.parameters])
        cases = [setting for case in self.cases for setting in case.items()]
        parameters = [(each.name, [(path, None) for path in each.set]) for each in self.parameters]
        check_conflicts(self.settings, [("cases", cases), *parameters])
        return self

    def run_counts(self) -> dict[CountPath, int]:
        """Return the numbers of points and cases."""
        method = self.method
        counts: dict[CountPath, int] = {("method", "evaluations"): method.evaluations}
        if method.kind == "differential_evolution":
            counts = {("method", "population"): method.population, ("method", "generations"): method.generations + 1}
        return counts | {("cases",): len(self.cases)}


def _check_unique(what: str, names: Iterable[str]) -> None:
    names = list(names)
    if repeated := [name for i, name in enumerate(names) if name in names[:i]]:
        raise ValueError(f'two {what} are called "{repeated[0]}"')


def _check_map(map_: MapSpec, sweep: SweepSpec) -> None:
    """Raise ValueError if a factor of a map does not exist or has no levels."""
    known = [each.name for each in sweep.factors if _has_labels(each, sweep.design.kind != "full_factorial")]
    known += ["seed"] if sweep.seeds else []
    for name in map_.factors:
        if name not in known:
            raise ValueError(f'"maps" names no factor with levels "{name}"{did_you_mean(name, known)}')


def _has_labels(factor: FactorSpec, sampled: bool) -> bool:
    """Return whether a factor has levels that can be shown along an axis."""
    if factor.values is not None:
        return not any(isinstance(value, list | dict) for value in factor.values)
    return factor.levels is not None or not sampled


def study_json_schema(kind: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a sweep or tuning file."""
    return complete_schema(kind.model_json_schema(by_alias=True))
