"""Designs of sweeps: the points that result from factors and seeds.

Samples are drawn by `scipy.stats.qmc` in the unit cube. Every factor maps a coordinate in [0, 1) to
a level, by the inverse of its distribution function.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .factor_schema import DistributionSpec, FactorSpec, RangeSpec
from .schema import DesignSpec, SweepSpec

#: largest double below 1
_LARGEST_BELOW_ONE = float(np.nextafter(1.0, 0.0))


class Level(NamedTuple):
    """Level of a factor: its label in the table, and its settings."""

    label: Any
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Factor:
    """Factor with its levels; `quantile` maps [0, 1) to the values of a continuous factor."""

    name: str
    paths: Sequence[str] = ()
    listed_levels: Sequence[Level] = ()
    quantile: Callable[[float], Any] | None = None
    #: levels of a full factorial design
    grid_levels: Sequence[Level] = ()

    def level_at(self, coordinate: float) -> Level:
        """Return the level at a coordinate in [0, 1)."""
        if self.quantile is None:
            return self.listed_levels[int(coordinate * len(self.listed_levels))]
        return level_of_value(self.paths, self.quantile(coordinate))


def level_of_value(paths: Sequence[str], value: Any) -> Level:
    """Return the level that sets all paths to one value."""
    return Level(value, dict.fromkeys(paths, value))


def build_factor(spec: FactorSpec, gridded: bool) -> Factor:
    """Return the factor that a sweep file describes.

    It has the levels of a full factorial design if it is `gridded`.
    """
    paths = spec.set or []
    listed = [Level(label, settings) for label, settings in (spec.levels or {}).items()]
    listed += [level_of_value(paths, value) for value in spec.values or ()]
    if listed:
        return Factor(spec.name, listed_levels=listed, grid_levels=listed)
    count = spec.level_count if gridded else 0
    if spec.range is not None:
        exact = _range_quantile(spec.range)
        coordinates = [i / (count - 1) for i in range(count)]  # both ends included
    else:
        assert spec.distribution is not None
        exact = _distribution_quantile(spec.distribution)
        coordinates = [(i + 0.5) / count for i in range(count)]  # medians of equally likely parts
    quantile = (lambda coordinate: round(exact(coordinate))) if spec.integer else exact
    grid = [level_of_value(paths, quantile(coordinate)) for coordinate in coordinates]
    return Factor(spec.name, paths, quantile=quantile, grid_levels=grid)


def _range_quantile(spec: RangeSpec) -> Callable[[float], float]:
    return lambda coordinate: interpolate(coordinate, spec.min, spec.max, spec.scale == "log")


def interpolate(position: float, low: float, high: float, logarithmic: bool) -> float:
    """Interpolate between two bounds at a position in [0, 1]; 0 and 1 give the bounds exactly."""
    if position in (0, 1):
        return high if position else low
    value = (
        low * math.exp(position * math.log(high / low))
        if logarithmic
        else low + position * (high - low)
    )
    return min(max(value, low), high)


def _distribution_quantile(spec: DistributionSpec) -> Callable[[float], float]:
    from scipy import stats

    distribution = _DISTRIBUTIONS[spec.kind](stats, **spec.arguments)
    return lambda coordinate: float(
        distribution.ppf(min(max(coordinate, 1 - _LARGEST_BELOW_ONE), _LARGEST_BELOW_ONE))
    )


def _truncated_normal(
    stats: Any, mean: float, std: float, min: float = -math.inf, max: float = math.inf
) -> Any:
    return stats.truncnorm((min - mean) / std, (max - mean) / std, mean, std)


_DISTRIBUTIONS: Mapping[str, Callable[..., Any]] = {
    "uniform": lambda stats, min, max: stats.uniform(min, max - min),
    "normal": lambda stats, mean, std: stats.norm(mean, std),
    "truncated_normal": _truncated_normal,
    "lognormal": lambda stats, median, sigma: stats.lognorm(sigma, scale=median),
    "triangular": lambda stats, min, mode, max: stats.triang(
        (mode - min) / (max - min), min, max - min
    ),
    "exponential": lambda stats, mean: stats.expon(scale=mean),
    "weibull": lambda stats, shape, scale: stats.weibull_min(shape, scale=scale),
}


@dataclass(frozen=True)
class Point:
    """Point of a design: the labels of its levels by column of the table, and all its settings."""

    labels: Mapping[str, Any]
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Design:
    """All points of a sweep, computed on demand; seeds vary fastest, then the last factor."""

    factors: Sequence[Factor]
    seeds: Sequence[Level] = ()
    #: coordinates in the unit cube, shape (points, factors); None: all combinations of levels
    unit_samples: np.ndarray | None = field(default=None, repr=False)

    @property
    def columns(self) -> list[str]:
        """Names of the factors, followed by "seed" if there are seeds."""
        return [*(factor.name for factor in self.factors), *(["seed"] if self.seeds else [])]

    def __len__(self) -> int:
        points = (
            math.prod(len(factor.grid_levels) for factor in self.factors)
            if self.unit_samples is None
            else len(self.unit_samples)
        )
        return points * max(1, len(self.seeds))

    def __iter__(self) -> Iterator[Point]:
        return map(self.__getitem__, range(len(self)))

    def __getitem__(self, run: int) -> Point:
        if not 0 <= run < len(self):
            raise IndexError(run)
        index, seed = divmod(run, max(1, len(self.seeds)))
        levels = [*self._levels(index), *(self.seeds[seed : seed + 1])]
        labels = {name: level.label for name, level in zip(self.columns, levels, strict=True)}
        settings: dict[str, Any] = {}
        for level in levels:
            settings |= level.settings
        return Point(labels, settings)

    def _levels(self, index: int) -> list[Level]:
        if self.unit_samples is not None:
            return [
                factor.level_at(x)
                for factor, x in zip(self.factors, self.unit_samples[index].tolist(), strict=True)
            ]
        # the digits of the index in a number system whose bases are the numbers of levels
        levels = []
        for factor in reversed(self.factors):
            index, level = divmod(index, len(factor.grid_levels))
            levels.append(factor.grid_levels[level])
        return levels[::-1]

    def labels(self, name: str) -> list[Any]:
        """Return the labels of all grid levels of a factor, or of the seeds."""
        levels = (
            self.seeds
            if name == "seed"
            else next(factor.grid_levels for factor in self.factors if factor.name == name)
        )
        return [level.label for level in levels]

    def level_settings(self) -> Iterator[Mapping[str, Any]]:
        """Yield the settings of each listed level; strings among them may name files."""
        for factor in self.factors:
            yield from (level.settings for level in factor.listed_levels)


def build_design(spec: SweepSpec) -> Design:
    """Build the design of a sweep; equal files give equal points."""
    factors = [build_factor(each, gridded=spec.design.runs is None) for each in spec.factors]
    seeds = spec.seeds
    replications = (
        [level_of_value(seeds.set, seeds.first + i) for i in range(seeds.count)] if seeds else []
    )
    return Design(factors, replications, _draw_samples(spec.design, len(factors)))


def _draw_samples(spec: DesignSpec, dimensions: int) -> np.ndarray | None:
    if spec.runs is None or dimensions == 0:
        return None
    from scipy.stats import qmc

    generator = np.random.default_rng(spec.seed)
    kind = {"latin_hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol}[spec.kind]
    samples: np.ndarray = kind(dimensions, rng=generator).random(spec.runs)
    np.minimum(samples, _LARGEST_BELOW_ONE, out=samples)
    return samples
