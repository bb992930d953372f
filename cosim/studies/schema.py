"""Schemas of sweep and tuning files.

`cosim schema --sweep` and `--tune` print them as JSON Schema.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain, product
from typing import Annotated, Any, Literal

from pydantic import StringConstraints, model_validator

from ..core.errors import did_you_mean
from ..scenario.evaluation_schema import CheckSpec
from ..scenario.schema_types import Integer, NameList, PlacedError, Spec, key
from .factor_schema import (
    TRIAL_COLUMNS,
    FactorSpec,
    Scale,
    Setter,
    SettingPaths,
    check_conflicts,
    check_level_counts,
    check_log_scale,
    check_order,
    reject_column_names,
)


class SeedsSpec(Spec):
    """Replications: every point is run with the same `count` seeds."""

    set: SettingPaths = key(
        'JSON pointers or variables that get the seed; default: "seeds" of the scenario',
        ["/components/plant/arguments/environment/seed"],
        default=[],
    )
    first: Integer = key("first seed; the others follow", 100, default=1)
    count: Integer = key("number of seeds", 20, ge=1)


class MapSpec(Spec):
    """A map of the success rate over two factors.

    Two more factors may select the columns and rows of panels.
    """

    x: str = key("factor along the horizontal axis", "wind")
    y: str = key("factor along the vertical axis", "wave_height")
    columns: str | None = key(
        "factor whose levels have a column of panels each", "controller", default=None
    )
    rows: str | None = key("factor whose levels have a row of panels each", "speed", default=None)
    titles: dict[str, str] = key(
        "title by factor; empty: no title", {"wind": "wind (m/s)"}, default={}
    )

    @property
    def factors(self) -> list[str]:
        """Names of the factors of the map: rows, columns, y and x."""
        return [name for name in (self.rows, self.columns, self.y, self.x) if name is not None]

    @model_validator(mode="after")
    def _different(self) -> MapSpec:
        if repeated := _first_repeated(self.factors):
            raise ValueError(f'two axes of a map are called "{repeated}"')
        return self


class DesignSpec(Spec):
    """Choice of the points: all combinations of levels, or `runs` samples."""

    kind: Literal["full_factorial", "latin_hypercube", "sobol"] = key(
        "all combinations of levels, or samples", "sobol", default="full_factorial"
    )
    runs: Integer | None = key(
        "number of samples; for sobol a power of two", 256, default=None, ge=1
    )
    seed: Integer = key("seed of the samples", 7, default=1, ge=0)

    @model_validator(mode="after")
    def _sized(self) -> DesignSpec:
        if (self.kind == "full_factorial") != (self.runs is None):
            raise ValueError(
                'expected "runs" with latin_hypercube and sobol, and not with full_factorial'
            )
        if self.kind == "sobol" and self.runs and self.runs & (self.runs - 1):
            near = 2 ** round(math.log2(self.runs))
            raise ValueError(
                "a Sobol sequence is balanced only for powers of two; expected for example "
                f'"runs": {near}'
            )
        return self


#: path of a number in a study file
CountPath = tuple["str | int", ...]


class StudySpec(Spec):
    """Common part of sweeps and tunings.

    A scenario, settings that all runs share, and the deadline of a run.
    """

    schema_: str | None = key(
        "path of the JSON Schema, for editors", "sweep.schema.json", default=None, alias="$schema"
    )
    name: Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_. -]*$")] = key(
        "name of the study and of its results folder", "landing_speeds"
    )
    description: str = key("text for reports and people", "Landings at three speeds.", default="")
    scenario: str = key(
        (
            'path relative to this file or of a file that cosim ships ("cosim:scenarios/..."), or '
            "the name of a shipped scenario"
        ),
        "demo1_box",
    )
    settings: dict[str, Any] = key(
        "settings of all runs, as of `--set`", {"uav.vtol.landing_time": 8.0}, default={}
    )
    deadline: float | None = key(
        "wall time that a run may take", 60.0, unit="s", default=None, gt=0
    )

    def run_counts(self) -> dict[CountPath, int]:
        """Return the factors of the largest number of runs, by the paths of their entries."""
        raise NotImplementedError

    @property
    def max_runs(self) -> int:
        """Largest number of runs of the study."""
        return math.prod(self.run_counts().values())

    def cell_counts(self) -> dict[CountPath, int]:
        """Return the number of cells of each map, by the path of the map."""
        return {}


#: key of sweeps and of searches for the worst case
_SUCCESS = key(
    "limits on KPIs; default: the checks of the scenario",
    [{"kpi": "landing.lateral_error", "max": 0.2}],
    default=None,
)


class SweepSpec(StudySpec):
    """A sweep: factors, a design, seeds and criteria of success."""

    factors: list[FactorSpec] = key(
        "what varies",
        [{"name": "speed", "set": "usv.speed_command", "values": [0.4, 0.8, 1.2]}],
        default=[],
    )
    design: DesignSpec = key(
        "choice of the points",
        {"kind": "sobol", "runs": 256},
        default=DesignSpec(kind="full_factorial", runs=None, seed=1),
    )
    seeds: SeedsSpec | None = key(
        "replications of every point",
        {"set": "/components/plant/arguments/environment/seed", "count": 20},
        default=None,
    )
    success: list[CheckSpec] | None = _SUCCESS
    by: list[NameList] = key(
        "factors, or lists of factors, by whose levels the runs are grouped in the aggregates",
        ["speed"],
        default=[],
    )
    maps: list[MapSpec] = key(
        "maps of the success rate, as figures and in sweep.html",
        [{"x": "wind", "y": "wave_height"}],
        default=[],
    )

    @model_validator(mode="after")
    def _consistent(self) -> SweepSpec:
        names = _unique_names("factors", self.factors)
        seeds = [Setter("seed", ("seeds",), product(self.seeds.set, (None,)))] if self.seeds else []
        factors = (
            Setter(factor.name, ("factors", i), factor.settings())
            for i, factor in enumerate(self.factors)
        )
        check_conflicts(self.settings, [*factors, *seeds])
        if not names and self.seeds is None:
            raise ValueError('expected "factors", "seeds" or both')
        columns = [*names, "seed"]
        for i, group in enumerate(self.by):
            if unknown := [name for name in group if name not in columns]:
                hint = did_you_mean(unknown[0], columns)
                raise PlacedError(f'"by" names no factor "{unknown[0]}"{hint}', "by", i)
        sampled = self.design.kind != "full_factorial"
        known = [each.name for each in self.factors if each.has_labels(sampled)]
        known += ["seed"] if self.seeds else []
        for i, each in enumerate(self.maps):
            if unknown := [name for name in each.factors if name not in known]:
                hint = did_you_mean(unknown[0], known)
                text = f'"maps" names no factor with levels "{unknown[0]}"{hint}'
                raise PlacedError(text, "maps", i)
        if self.design.kind == "full_factorial":
            check_level_counts(self.factors)
        return self

    def run_counts(self) -> dict[CountPath, int]:
        """Return the numbers of samples or levels, and of seeds."""
        counts: dict[CountPath, int] = {
            ("factors", i): factor.level_count for i, factor in enumerate(self.factors)
        }
        if self.design.runs is not None and self.factors:
            counts = {("design", "runs"): self.design.runs}
        return counts | ({("seeds", "count"): self.seeds.count} if self.seeds else {})

    def cell_counts(self) -> dict[CountPath, int]:
        """Return the product of the numbers of levels of each map's factors."""
        levels = {factor.name: factor.level_count for factor in self.factors}
        levels["seed"] = self.seeds.count if self.seeds else 0
        return {
            ("maps", i): math.prod(map(levels.__getitem__, each.factors))
            for i, each in enumerate(self.maps)
        }


class ParameterSpec(Spec):
    """A parameter of a tuning, with its bounds."""

    name: Annotated[
        str,
        StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$"),
        reject_column_names(*TRIAL_COLUMNS),
    ] = key("name in expressions and tables", "gain")
    set: SettingPaths = key(
        "variable or JSON pointer; of several, all get the same value", "usv.heading.gain"
    )
    min: float = key("lower bound", 0.1)
    max: float = key("upper bound", 10.0)
    start: float | None = key("first value; default: the middle of the bounds", 1.5, default=None)
    scale: Scale = key("scale on which the method searches", "log", default="linear")
    whole: bool = key("only whole numbers, for example for a seed", True, default=False)
    multiple_of: float | None = key(
        "only multiples of this number, for example of the step size for the time of an event",
        0.01,
        default=None,
        gt=0,
    )

    @model_validator(mode="after")
    def _possible(self) -> ParameterSpec:
        check_order(self.min, self.max)
        check_log_scale(self.scale, self.min)
        if self.start is not None and not self.min <= self.start <= self.max:
            raise ValueError('expected "start" between "min" and "max"')
        if self.whole and math.ceil(self.min) > math.floor(self.max):
            raise ValueError('expected a whole number between "min" and "max"')
        if self.multiple_of and self.whole:
            raise ValueError('expected "whole" or "multiple_of", found both')
        if self.multiple_of and math.ceil(self.min / self.multiple_of) > math.floor(
            self.max / self.multiple_of
        ):
            raise ValueError('expected a multiple of "multiple_of" between "min" and "max"')
        return self


class MethodSpec(Spec):
    """An optimization method and its limits."""

    kind: Literal["differential_evolution", "nelder_mead", "powell"] = key(
        "optimization method", "nelder_mead", default="differential_evolution"
    )
    population: Integer = key(
        "points per generation (differential_evolution)", 24, default=16, ge=5
    )
    generations: Integer = key(
        "generations after the first (differential_evolution)", 40, default=20, ge=1
    )
    evaluations: Integer = key("points at most (nelder_mead, powell)", 100, default=200, ge=1)
    seed: Integer = key("seed of the method", 7, default=1, ge=0)

    def run_counts(self) -> dict[CountPath, int]:
        """Return the factors of the largest number of points."""
        if self.kind == "differential_evolution":
            return {
                ("method", "population"): self.population,
                ("method", "generations"): self.generations + 1,
            }
        return {("method", "evaluations"): self.evaluations}


class TuneSpec(StudySpec):
    """A tuning: the expression of KPIs to be minimised, the parameters and the constraints."""

    parameters: list[ParameterSpec] = key(
        "what is tuned",
        [{"name": "gain", "set": "usv.heading.gain", "min": 0.1, "max": 10.0}],
        min_length=1,
    )
    minimize: str = key("arithmetic over KPIs and parameters", "landing.lateral_error + 0.1 * gain")
    constraints: list[str] = key(
        "comparisons of such expressions", ["heading.overshoot <= 0.1"], default=[]
    )
    cases: list[dict[str, Any]] = key(
        "each point is run with each of these settings",
        [{"usv.speed_command": 0.5}, {"usv.speed_command": 1.0}],
        default=[{}],
        min_length=1,
    )
    over_cases: Literal["mean", "max"] = key("combination of the cases", "max", default="mean")
    method: MethodSpec = key(
        "optimization method and its limits",
        {"kind": "nelder_mead"},
        default=MethodSpec(population=16, generations=20, evaluations=200, seed=1),
    )

    @model_validator(mode="after")
    def _consistent(self) -> TuneSpec:
        settings = chain.from_iterable(case.items() for case in self.cases)
        cases = Setter("cases", ("cases",), settings)
        check_conflicts(self.settings, [cases, *_parameter_setters(self.parameters)])
        return self

    def run_counts(self) -> dict[CountPath, int]:
        """Return the numbers of points and cases."""
        return self.method.run_counts() | {("cases",): len(self.cases)}


class WorstCaseSpec(StudySpec):
    """A search for the run that breaks a controller.

    The disturbances, and the limits that a run must meet.
    """

    parameters: list[ParameterSpec] = key(
        "what is searched: wind, waves, times of faults, seeds",
        [
            {
                "name": "wind",
                "set": "/components/plant/arguments/environment/wind/speed",
                "min": 0.5,
                "max": 8.0,
            }
        ],
        min_length=1,
    )
    success: list[CheckSpec] | None = _SUCCESS
    keep: Integer = key(
        "largest number of counterexamples that are written, the worst ones", 5, default=3, ge=1
    )
    method: MethodSpec = key(
        "optimization method and its limits",
        {"kind": "differential_evolution", "population": 16, "generations": 5},
        default=MethodSpec(population=16, generations=20, evaluations=200, seed=1),
    )

    @model_validator(mode="after")
    def _consistent(self) -> WorstCaseSpec:
        check_conflicts(self.settings, _parameter_setters(self.parameters))
        return self

    def run_counts(self) -> dict[CountPath, int]:
        """Return the number of points."""
        return self.method.run_counts()


def _parameter_setters(parameters: Sequence[ParameterSpec]) -> list[Setter]:
    """Return the settings of parameters, whose names must differ."""
    _unique_names("parameters", parameters)
    return [
        Setter(each.name, ("parameters", i), product(each.set, (None,)))
        for i, each in enumerate(parameters)
    ]


def _unique_names(kind: str, entries: Sequence[FactorSpec | ParameterSpec]) -> list[str]:
    """Return the names of factors or parameters; raise PlacedError if two are equal."""
    names = [each.name for each in entries]
    if repeated := _first_repeated(names):
        raise PlacedError(
            f'two {kind} are called "{repeated}"',
            kind,
            len(names) - 1 - names[::-1].index(repeated),
            "name",
        )
    return names


def _first_repeated(names: Sequence[str]) -> str | None:
    return next((name for i, name in enumerate(names) if name in names[:i]), None)
