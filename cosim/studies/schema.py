"""Schemas of sweep and tuning files; `cosim schema --sweep` and `--tune` print them as JSON Schema."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, Field, StringConstraints, model_validator

from ..core.errors import did_you_mean
from ..scenario.schema import CheckSpec, NameList, Spec
from .setting_conflicts import check_conflicts

#: arguments of each distribution; `min` and `max` of truncated_normal are optional
DISTRIBUTIONS = {
    "uniform": ("min", "max"),
    "normal": ("mean", "std"),
    "truncated_normal": ("mean", "std", "min", "max"),
    "lognormal": ("median", "sigma"),
    "triangular": ("min", "mode", "max"),
    "exponential": ("mean",),
    "weibull": ("shape", "scale"),
}
_OPTIONAL_ARGUMENTS = {"truncated_normal": {"min", "max"}}
_POSITIVE_ARGUMENTS = ("std", "sigma", "median", "shape", "scale")
#: keys of a factor that define its levels
_LEVEL_SOURCES = ("values", "range", "distribution", "levels")
#: quantiles in aggregates.csv
QUANTILES = {"min": 0.0, "q05": 0.05, "q25": 0.25, "median": 0.5, "q75": 0.75, "q95": 0.95, "max": 1.0}
#: columns of the output files beside those of factors or parameters
TABLE_COLUMNS = ("run", "seed", "status", "passed", "failure", "output", "command")
AGGREGATE_COLUMNS = ("kpi", "count", "mean", "std", *QUANTILES)
SUCCESS_COLUMNS = ("runs", "distinct", "failed", "passed", "rate", "low", "high")
TRIAL_COLUMNS = ("value", "violation", "failure")


def _reject_column_names(*names: str) -> AfterValidator:
    def check(value: str) -> str:
        if value in names:
            raise ValueError(f"expected a name other than those of columns: {', '.join(dict.fromkeys(names))}")
        return value

    return AfterValidator(check)


SettingPaths = Annotated[NameList, Field(min_length=1)]
FactorName = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_. ]*$"),
    _reject_column_names(*TABLE_COLUMNS, *AGGREGATE_COLUMNS, *SUCCESS_COLUMNS),
]
Scale = Literal["linear", "log"]


def _check_order(low: float | None, high: float | None) -> None:
    if low is not None and high is not None and not low < high:
        raise ValueError('expected "min" to be less than "max"')


def _check_log_scale(scale: Scale, low: float) -> None:
    if scale == "log" and low <= 0:
        raise ValueError('a logarithmic scale needs a positive "min"')


class RangeSpec(Spec):
    """Evenly spaced values from `min` to `max`; `count` of them in a full factorial design."""

    min: float
    max: float
    count: int | None = Field(None, ge=2)
    scale: Scale = "linear"

    @model_validator(mode="after")
    def _possible(self) -> RangeSpec:
        _check_order(self.min, self.max)
        _check_log_scale(self.scale, self.min)
        return self


class DistributionSpec(Spec):
    """A probability distribution; a full factorial design takes the medians of `count` equally likely parts."""

    kind: Literal["uniform", "normal", "truncated_normal", "lognormal", "triangular", "exponential", "weibull"]
    min: float | None = None
    max: float | None = None
    mean: float | None = None
    std: float | None = None
    median: float | None = None
    sigma: float | None = Field(None, description="standard deviation of the logarithm")
    mode: float | None = None
    shape: float | None = None
    scale: float | None = None
    count: int | None = Field(None, ge=1)

    @model_validator(mode="after")
    def _complete(self) -> DistributionSpec:
        known, given = DISTRIBUTIONS[self.kind], self.arguments
        if unknown := [name for name in given if name not in known]:
            raise ValueError(f'"{self.kind}" has no "{unknown[0]}"{did_you_mean(unknown[0], known)}')
        if missing := [name for name in known if name not in given and name not in _OPTIONAL_ARGUMENTS.get(self.kind, ())]:
            raise ValueError(f'"{self.kind}" needs {", ".join(missing)}')
        if small := [name for name in _POSITIVE_ARGUMENTS if given.get(name, 1.0) <= 0]:
            raise ValueError(f'expected a positive "{small[0]}"')
        if self.kind == "exponential" and given["mean"] <= 0:
            raise ValueError('expected a positive "mean"')
        _check_order(self.min, self.max)
        if self.mode is not None and not given["min"] <= self.mode <= given["max"]:
            raise ValueError('expected "mode" between "min" and "max"')
        return self

    @property
    def arguments(self) -> dict[str, float]:
        """Arguments of the distribution that the file gives."""
        return {name: value for name, value in self.model_dump(exclude={"kind", "count"}).items() if value is not None}


class FactorSpec(Spec):
    """A factor that varies: variables or JSON pointers with their values, or named levels with several settings each."""

    name: FactorName
    set: SettingPaths | None = Field(None, description="variable or JSON pointer; of several, all get the same value")
    values: list[Any] | None = Field(None, min_length=1)
    range: RangeSpec | None = None
    distribution: DistributionSpec | None = None
    levels: dict[str, dict[str, Any]] | None = Field(None, min_length=1, description="label -> settings")
    integer: bool = Field(False, description="values of a range or distribution are rounded")

    @model_validator(mode="after")
    def _one_source(self) -> FactorSpec:
        given = [name for name in _LEVEL_SOURCES if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"expected exactly one of {', '.join(_LEVEL_SOURCES)}; found {' and '.join(given) or 'none'}")
        if (self.levels is None) == (self.set is None):
            raise ValueError('expected "set" together with values, range or distribution, and not together with levels')
        return self

    def settings(self) -> Iterator[tuple[str, Any]]:
        """Yield each path that the factor sets with its listed values, or with None if it has none."""
        for level in (self.levels or {}).values():
            yield from level.items()
        yield from ((path, value) for path in self.set or () for value in self.values or (None,))


class SeedsSpec(Spec):
    """Replications: every point is run with the same `count` seeds."""

    set: SettingPaths
    first: int = 1
    count: int = Field(ge=1)


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
    runs: int | None = Field(None, ge=1)
    seed: int = Field(1, ge=0)

    @model_validator(mode="after")
    def _sized(self) -> DesignSpec:
        if (self.kind == "full_factorial") != (self.runs is None):
            raise ValueError('expected "runs" with latin_hypercube and sobol, and not with full_factorial')
        if self.kind == "sobol" and self.runs and self.runs & (self.runs - 1):
            near = 2 ** round(math.log2(self.runs))
            raise ValueError(f'a Sobol sequence is balanced only for powers of two; expected for example "runs": {near}')
        return self


class StudySpec(Spec):
    """Common part of sweeps and tunings: a scenario, settings that all runs share, and the deadline of a run."""

    schema_: str | None = Field(None, alias="$schema")
    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_. -]*$")]
    description: str = ""
    scenario: str = Field(description="path relative to this file, or the name of a shipped scenario")
    settings: dict[str, Any] = Field({}, description="settings of all runs, as of `--set`")
    deadline: float | None = Field(None, gt=0, description="wall time that a run may take (s)")


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


class ParameterSpec(Spec):
    """A parameter of a tuning, with its bounds."""

    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$"), _reject_column_names(*TRIAL_COLUMNS)]
    set: SettingPaths
    min: float
    max: float
    start: float | None = None
    scale: Scale = "linear"

    @model_validator(mode="after")
    def _possible(self) -> ParameterSpec:
        _check_order(self.min, self.max)
        _check_log_scale(self.scale, self.min)
        if self.start is not None and not self.min <= self.start <= self.max:
            raise ValueError('expected "start" between "min" and "max"')
        return self


class MethodSpec(Spec):
    """An optimization method and its limits."""

    kind: Literal["differential_evolution", "nelder_mead", "powell"] = "differential_evolution"
    population: int = Field(16, ge=5, description="points per generation (differential_evolution)")
    generations: int = Field(20, ge=1, description="generations after the first (differential_evolution)")
    evaluations: int = Field(200, ge=1, description="points at most (nelder_mead, powell)")
    seed: int = Field(1, ge=0)


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
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **kind.model_json_schema(by_alias=True)}
