"""Schema of the factors of a sweep, and conflicts between the settings of a study.

Factors and the parameters of a tuning share their names and bounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, Field, StringConstraints, model_validator

from ..core.errors import did_you_mean
from ..scenario.json_document import pointer_keys
from ..scenario.schema_types import Integer, NameList, PlacedError, Spec, key

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
QUANTILES = {
    "min": 0.0,
    "q05": 0.05,
    "q25": 0.25,
    "median": 0.5,
    "q75": 0.75,
    "q95": 0.95,
    "max": 1.0,
}
#: columns of the output files beside those of factors or parameters
TABLE_COLUMNS = ("run", "seed", "status", "passed", "missed", "failure", "output", "command")
AGGREGATE_COLUMNS = ("kpi", "count", "mean", "std", *QUANTILES)
SUCCESS_COLUMNS = ("runs", "distinct", "failed", "passed", "rate", "low", "high")
TRIAL_COLUMNS = ("value", "violation", "failure")


def reject_column_names(*names: str) -> AfterValidator:
    """Return a validator that refuses the names of columns."""

    def check(value: str) -> str:
        if value in names:
            raise ValueError(
                f"expected a name other than those of columns: {', '.join(dict.fromkeys(names))}"
            )
        return value

    return AfterValidator(check)


SettingPaths = Annotated[NameList, Field(min_length=1)]
FactorName = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_. ]*$"),
    reject_column_names(*TABLE_COLUMNS, *AGGREGATE_COLUMNS, *SUCCESS_COLUMNS),
]
Scale = Literal["linear", "log"]


def check_order(low: float | None, high: float | None) -> None:
    """Raise ValueError unless `low` is less than `high`; None stands for no bound."""
    if low is not None and high is not None and not low < high:
        raise ValueError('expected "min" to be less than "max"')


def check_log_scale(scale: Scale, low: float) -> None:
    """Raise ValueError for a logarithmic scale with a lower bound that is not positive."""
    if scale == "log" and low <= 0:
        raise ValueError('a logarithmic scale needs a positive "min"')


class RangeSpec(Spec):
    """Evenly spaced values from `min` to `max`; `count` of them in a full factorial design."""

    min: float = key("first value", 0.5)
    max: float = key("last value", 1.5)
    count: Integer | None = key(
        "number of values; required in a full factorial design", 5, default=None, ge=2
    )
    scale: Scale = key("spacing of the values", "log", default="linear")

    @model_validator(mode="after")
    def _possible(self) -> RangeSpec:
        check_order(self.min, self.max)
        check_log_scale(self.scale, self.min)
        return self


class DistributionSpec(Spec):
    """A probability distribution.

    A full factorial design takes the medians of `count` equally likely parts.
    """

    kind: Literal[
        "uniform", "normal", "truncated_normal", "lognormal", "triangular", "exponential", "weibull"
    ] = key("family of distributions", "normal")
    min: float | None = key(
        "lower bound (uniform, truncated_normal, triangular)", 0.0, default=None
    )
    max: float | None = key(
        "upper bound (uniform, truncated_normal, triangular)", 2.0, default=None
    )
    mean: float | None = key(
        "mean (normal, truncated_normal: before truncation; exponential)", 1.0, default=None
    )
    std: float | None = key(
        "standard deviation (normal, truncated_normal: before truncation)", 0.1, default=None
    )
    median: float | None = key("median (lognormal)", 1.0, default=None)
    sigma: float | None = key("standard deviation of the logarithm (lognormal)", 0.2, default=None)
    mode: float | None = key("most probable value (triangular)", 1.0, default=None)
    shape: float | None = key("shape parameter k (weibull)", 2.0, default=None)
    scale: float | None = key("scale parameter lambda (weibull)", 5.0, default=None)
    count: Integer | None = key(
        "number of values; required in a full factorial design", 5, default=None, ge=1
    )

    @model_validator(mode="after")
    def _complete(self) -> DistributionSpec:
        known, given = DISTRIBUTIONS[self.kind], self.arguments
        if unknown := [name for name in given if name not in known]:
            raise ValueError(
                f'"{self.kind}" has no "{unknown[0]}"{did_you_mean(unknown[0], known)}'
            )
        if missing := [
            name
            for name in known
            if name not in given and name not in _OPTIONAL_ARGUMENTS.get(self.kind, ())
        ]:
            raise ValueError(f'"{self.kind}" needs {", ".join(missing)}')
        if small := [name for name in _POSITIVE_ARGUMENTS if given.get(name, 1.0) <= 0]:
            raise ValueError(f'expected a positive "{small[0]}"')
        if self.kind == "exponential" and given["mean"] <= 0:
            raise ValueError('expected a positive "mean"')
        check_order(self.min, self.max)
        if self.mode is not None and not given["min"] <= self.mode <= given["max"]:
            raise ValueError('expected "mode" between "min" and "max"')
        return self

    @property
    def arguments(self) -> dict[str, float]:
        """Arguments of the distribution that the file gives."""
        return {
            name: value
            for name, value in self.model_dump(exclude={"kind", "count"}).items()
            if value is not None
        }


class FactorSpec(Spec):
    """A factor that varies.

    Variables or JSON pointers with their values, or named levels with several settings each.
    """

    name: FactorName = key(
        "name of the factor and of its column in the tables; names of other columns (`run`, "
        "`seed`, `mean` and so on) are "
        "reserved",
        "speed",
    )
    set: SettingPaths | None = key(
        "variable or JSON pointer; of several, all get the same value",
        "usv.speed_command",
        default=None,
    )
    values: list[Any] | None = key("listed values", [0.4, 0.8, 1.2], default=None, min_length=1)
    range: RangeSpec | None = key(
        "evenly spaced values", {"min": 0.5, "max": 1.5, "count": 5}, default=None
    )
    distribution: DistributionSpec | None = key(
        "random values", {"kind": "normal", "mean": 1.0, "std": 0.1}, default=None
    )
    levels: dict[str, dict[str, Any]] | None = key(
        "settings by the label of a level",
        {"calm": {"uav.gain": 1.0}, "rough": {"uav.gain": 2.0}},
        default=None,
        min_length=1,
    )
    integer: bool = key("round the values of a range or distribution", True, default=False)

    @model_validator(mode="after")
    def _one_source(self) -> FactorSpec:
        given = [name for name in _LEVEL_SOURCES if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"expected exactly one of {', '.join(_LEVEL_SOURCES)}; found "
                f"{' and '.join(given) or 'none'}"
            )
        if (self.levels is None) == (self.set is None):
            raise ValueError(
                'expected "set" together with values, range or distribution, and not together with '
                "levels"
            )
        return self

    @property
    def level_count(self) -> int:
        """Number of levels in a full factorial design."""
        listed = self.values or self.levels
        if listed is not None:
            return len(listed)
        part = self.range or self.distribution
        assert part is not None
        return part.count or 0

    def settings(self) -> Iterator[tuple[str, Any]]:
        """Yield each path that the factor sets with its listed values, or with None."""
        for level in (self.levels or {}).values():
            yield from level.items()
        yield from product(self.set or (), self.values or (None,))

    def has_labels(self, sampled: bool) -> bool:
        """Return whether the factor has levels that can be shown along an axis.

        `sampled`: the design is not full factorial.
        """
        if self.values is not None:
            return not any(isinstance(value, list | dict) for value in self.values)
        return self.levels is not None or not sampled


def check_level_counts(factors: Sequence[FactorSpec]) -> None:
    """Raise PlacedError if a factor of a full factorial design has no number of levels."""
    for i, factor in enumerate(factors):
        for kind in ("range", "distribution"):
            part = getattr(factor, kind)
            if part and part.count is None:
                text = f'the factor "{factor.name}" needs a "count" in a full factorial design'
                raise PlacedError(text, "factors", i, kind)


class _Setting(NamedTuple):
    """Setting of a factor, parameter or case.

    Its owner, its name, and its path of keys in the scenario.
    """

    owner: str
    name: str
    path: tuple[str, ...]

    @property
    def is_pointer(self) -> bool:
        """True if the setting changes the scenario's JSON.

        Variables are set after all JSON changes.
        """
        return self.name.startswith("/")

    @property
    def is_nested(self) -> bool:
        """True if the setting is part of an object that is set."""
        return self.path != _setting_path(self.name)

    def conflict_message(self, other: _Setting) -> str:
        """Return the message about an `other` setting of the same path."""
        if self.name == other.name:
            return f'both {other.owner} and {self.owner} set "{self.name}"'
        return (
            f'both {other.owner} and {self.owner} set the same value, as "{other.name}" and as '
            f'"{self.name}"'
        )


def _expand_settings(owner: str, pairs: Iterable[tuple[str, Any]]) -> list[_Setting]:
    """Return the settings, including one for each part of an object."""
    settings: dict[_Setting, None] = {}
    for text, value in pairs:
        for path in _nested_paths(_setting_path(text), value):
            settings[_Setting(owner, text, path)] = None
    return list(settings)


def _setting_path(text: str) -> tuple[str, ...]:
    """Return the path of keys that a setting changes.

    A variable is a parameter of its component.
    """
    if text.startswith("/"):
        return (*pointer_keys(text),)
    component, dot, variable = text.partition(".")
    return ("components", component, "parameters", variable) if dot else (text,)


def _nested_paths(path: tuple[str, ...], value: Any) -> Iterator[tuple[str, ...]]:
    yield path
    for name, inner in value.items() if isinstance(value, dict) else ():
        yield from _nested_paths((*path, name), inner)


class Setter(NamedTuple):
    """Factor, parameter, seeds or cases: its name, its path in the study file, and its settings."""

    name: str
    path: tuple[str | int, ...]
    settings: Iterable[tuple[str, Any]]


def check_conflicts(common: Mapping[str, Any], setters: Iterable[Setter]) -> None:
    """Raise PlacedError if one of two settings would have no effect.

    Args:
        common: settings of all runs. Setters may override them; variables among them may change
            parts of objects that setters set.
        setters: factors, seeds, cases or parameters, in the order in which they are applied.
    """
    defaults = _expand_settings("the settings", common.items())
    known = {each.path: each for each in defaults if not each.is_pointer}
    pointers_by_path = _pointers_by_ancestor(defaults)
    for name, path, pairs in setters:
        settings = _expand_settings(f'"{name}"', pairs)
        for each in settings:
            other = known.get(each.path)
            if other and (other not in defaults or not (each.is_nested or each.name == other.name)):
                raise PlacedError(each.conflict_message(other), *path)
            if each.is_pointer and (other := pointers_by_path.get(each.path)):
                raise PlacedError(
                    f'"{each.name}" of {each.owner} replaces "{other.name}" of {other.owner}', *path
                )
        known |= {each.path: each for each in settings}
        pointers_by_path |= _pointers_by_ancestor(settings)


def _pointers_by_ancestor(settings: Iterable[_Setting]) -> dict[tuple[str, ...], _Setting]:
    """Return, for every path within which a JSON pointer sets a value, one such setting."""
    pointers: dict[tuple[str, ...], _Setting] = {}
    for each in settings:
        if each.is_pointer and not each.is_nested:
            pointers |= {each.path[:depth]: each for depth in range(1, len(each.path))}
    return pointers
