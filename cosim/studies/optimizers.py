"""Optimization methods of tunings, which minimise ranks of points in the unit cube."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .schema import MethodSpec

#: smallest rank of a point that violates a constraint
INFEASIBLE_RANK = 1e100
#: differential evolution has converged when the standard deviation of the values is this fraction
#: of their mean
_CONVERGENCE_TOLERANCE = 1e-6

#: returns the ranks of points in the unit cube
Evaluator = Callable[[Sequence[Sequence[float]]], list[float]]


def _differential_evolution(evaluate: Evaluator, start: Sequence[float], spec: MethodSpec) -> None:
    """Search by differential evolution (R. Storn, K. Price, J. Global Optim. 11 (1997), 341-359).

    A whole generation is evaluated in parallel; the first one contains the start.
    """
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    generator = np.random.default_rng(spec.seed)
    population = qmc.LatinHypercube(len(start), rng=generator).random(spec.population)
    population[0] = start

    def converged(intermediate_result: Any) -> bool:
        """Return whether SciPy's criterion of convergence is met and all points are feasible."""
        ranks = intermediate_result.population_energies
        return bool(
            ranks.max() < INFEASIBLE_RANK
            and np.std(ranks) <= _CONVERGENCE_TOLERANCE * abs(np.mean(ranks))
        )

    differential_evolution(
        lambda points: np.array(evaluate(points.T.tolist())),
        [(0.0, 1.0)] * len(start),
        maxiter=spec.generations,
        init=population,
        rng=generator,
        polish=False,
        vectorized=True,
        updating="deferred",
        callback=converged,
        tol=0.0,
        atol=-1.0,  # disables SciPy's own criterion
    )


def _scipy_minimizer(method: str) -> Callable[[Evaluator, Sequence[float], MethodSpec], None]:
    def search(evaluate: Evaluator, start: Sequence[float], spec: MethodSpec) -> None:
        from scipy.optimize import minimize

        options = {"maxfev": spec.evaluations}
        bounds = [(0.0, 1.0)] * len(start)
        minimize(
            lambda point: evaluate([point.tolist()])[0],
            start,
            method=method,
            bounds=bounds,
            options=options,
        )

    return search


#: optimization methods: search from a start within the unit cube
METHODS: Mapping[str, Callable[[Evaluator, Sequence[float], MethodSpec], None]] = {
    "differential_evolution": _differential_evolution,
    "nelder_mead": _scipy_minimizer("Nelder-Mead"),
    "powell": _scipy_minimizer("Powell"),
}
