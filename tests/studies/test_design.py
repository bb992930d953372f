"""Designs: the points that result from factors and seeds."""

import math
from itertools import product

import numpy as np
import pytest
from scipy import stats

from cosim.studies.design import build_design
from cosim.studies.factor_schema import DISTRIBUTIONS
from cosim.studies.schema import SweepSpec

ARGUMENTS = {
    "min": 1.0,
    "max": 4.0,
    "mean": 2.0,
    "std": 0.5,
    "median": 2.0,
    "sigma": 0.3,
    "mode": 1.5,
    "shape": 1.8,
    "scale": 2.0,
}
#: the same distributions in the notation of SciPy
TEXTBOOK = {
    "uniform": stats.uniform(1.0, 3.0),
    "normal": stats.norm(2.0, 0.5),
    "truncated_normal": stats.truncnorm(-2.0, 4.0, loc=2.0, scale=0.5),
    "lognormal": stats.lognorm(0.3, scale=2.0),
    "triangular": stats.triang(1 / 6, 1.0, 3.0),
    "exponential": stats.expon(scale=2.0),
    "weibull": stats.weibull_min(1.8, scale=2.0),
}
RANGE = {"name": "r", "set": "a.r", "range": {"min": 2.0, "max": 32.0}}


def made(*factors, **more):
    return build_design(
        SweepSpec.model_validate(
            {"name": "d", "scenario": "s.json", "factors": list(factors), **more}
        )
    )


def sampled(kind, runs, *factors, seed=1):
    return made(*factors, design={"kind": kind, "runs": runs, "seed": seed})


def test_a_full_factorial_design_has_all_combinations_and_seeds_vary_fastest():
    points = made(
        {"name": "a", "set": "x.a", "values": ["p", "q"]},
        {"name": "b", "set": ["y.b", "/b"], "values": [1, 2, 3]},
        seeds={"set": "/seed", "first": 7, "count": 2},
    )
    expected = list(product("pq", (1, 2, 3), (7, 8)))
    assert [tuple(p.labels.values()) for p in points] == expected
    assert points[3].settings == {"x.a": "p", "y.b": 2, "/b": 2, "/seed": 8}
    assert len(points) == 12


def test_a_range_includes_both_ends_exactly():
    linear = made(RANGE | {"range": {"min": 0.1, "max": 0.7, "count": 4}})
    assert [p.labels["r"] for p in linear] == pytest.approx([0.1, 0.3, 0.5, 0.7])
    logarithmic = made(RANGE | {"range": {"min": 2.0, "max": 32.0, "count": 5, "scale": "log"}})
    found = [p.labels["r"] for p in logarithmic]
    assert (found[0], found[-1]) == (2.0, 32.0)
    assert found == pytest.approx([2, 4, 8, 16, 32])


@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol"])
def test_samples_are_stratified_in_every_factor(kind):
    levels = {"name": "l", "levels": {"slow": {"a.v": 1}, "fast": {"a.v": 2}}}
    points = list(sampled(kind, 64, RANGE, levels))
    places = sorted((p.labels["r"] - 2) / 30 for p in points)
    assert [int(place * 64) for place in places] == list(range(64))
    assert sum(p.labels["l"] == "slow" for p in points) == 32
    assert all(p.settings["a.v"] == (1 if p.labels["l"] == "slow" else 2) for p in points)


def test_an_integral_number_with_a_decimal_point_is_a_count():
    assert len(sampled("sobol", 8.0, RANGE, seed=1.0)) == 8
    assert (
        len(
            made(
                RANGE | {"range": {"min": 0.1, "max": 0.7, "count": 4.0}},
                seeds={"set": "a.s", "count": 2.0},
            )
        )
        == 8
    )


@pytest.mark.parametrize("kind", ["latin_hypercube", "sobol"])
def test_the_same_seed_gives_the_same_points(kind):
    first, again, other = (list(sampled(kind, 8, RANGE, seed=seed)) for seed in (1, 1, 2))
    assert first == again != other


@pytest.mark.parametrize("kind", DISTRIBUTIONS)
def test_samples_follow_their_distribution(kind):
    """A Latin hypercube has one value in each of its equally likely parts."""
    given = {name: ARGUMENTS[name] for name in DISTRIBUTIONS[kind]}
    points = sampled(
        "latin_hypercube", 200, {"name": "d", "set": "a.d", "distribution": {"kind": kind, **given}}
    )
    parts = TEXTBOOK[kind].cdf(sorted(p.labels["d"] for p in points)) * 200
    assert np.floor(parts + 1e-9).tolist() == list(range(200))


def test_levels_of_a_distribution_are_the_medians_of_its_parts():
    points = made(
        {
            "name": "d",
            "set": "a.d",
            "distribution": {"kind": "normal", "mean": 5.0, "std": 2.0, "count": 3},
        }
    )
    assert [p.labels["d"] for p in points] == pytest.approx(
        [5 + 2 * stats.norm.ppf(q) for q in (1 / 6, 1 / 2, 5 / 6)]
    )


def test_integers_are_rounded():
    points = made(RANGE | {"integer": True, "range": {"min": 1, "max": 4, "count": 7}})
    assert [p.labels["r"] for p in points] == [1, 2, 2, 2, 3, 4, 4]
    assert all(type(p.labels["r"]) is int for p in points)


def test_points_are_computed_on_demand():
    values = list(range(100))
    points = made(*({"name": name, "set": f"a.{name}", "values": values} for name in "xyz"))
    assert len(points) == 10**6
    assert points[123456].labels == {"x": 12, "y": 34, "z": 56}


def test_normal_samples_are_finite_at_the_ends():
    normal = {
        "name": "d",
        "set": "a.d",
        "distribution": {"kind": "normal", "mean": 0.0, "std": 1.0},
    }
    assert all(math.isfinite(p.labels["d"]) for p in sampled("sobol", 1024, normal))
