"""Optimization in the unit cube: parameters as coordinates, methods and constraints."""

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.expressions import Expression, check_node, parse_syntax
from .design import interpolate
from .schema import MethodSpec, ParameterSpec

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


def search(
    evaluate: Callable[[Sequence[Mapping[str, float]]], list[float]],
    parameters: Sequence[ParameterSpec],
    spec: MethodSpec,
) -> None:
    """Search for the values of parameters with the lowest rank.

    Args:
        evaluate: returns the ranks of points; each point is given by its values by name.
        parameters: the parameters with their bounds and start values.
        spec: the method.
    """

    def evaluate_coordinates(points: Sequence[Sequence[float]]) -> list[float]:
        return evaluate([parameter_values(parameters, point) for point in points])

    start = _start_coordinates(parameters)
    if spec.kind == "differential_evolution":
        _differential_evolution(evaluate_coordinates, start, spec)
        return
    from scipy.optimize import minimize

    minimize(
        lambda point: evaluate_coordinates([point.tolist()])[0],
        start,
        method=spec.kind.replace("_", "-"),
        bounds=[(0.0, 1.0)] * len(start),
        options={"maxfev": spec.evaluations},
    )


def start_values(parameters: Sequence[ParameterSpec]) -> dict[str, float]:
    """Return the values of parameters by name at the start of the search."""
    return parameter_values(parameters, _start_coordinates(parameters))


def parameter_values(
    parameters: Sequence[ParameterSpec], point: Sequence[float]
) -> dict[str, float]:
    """Return the values of parameters by name at a point in the unit cube.

    They are within their bounds and rounded to 12 digits, so that they are equal on all machines.
    """
    return {spec.name: _value(spec, float(x)) for spec, x in zip(parameters, point, strict=True)}


def parameter_settings(
    parameters: Sequence[ParameterSpec], values: Mapping[str, float]
) -> dict[str, float]:
    """Return the settings of the scenario for values of parameters."""
    settings: dict[str, float] = {}
    for each in parameters:
        settings |= dict.fromkeys(each.set, values[each.name])
    return settings


def _start_coordinates(parameters: Sequence[ParameterSpec]) -> list[float]:
    """Return the start of the search in the unit cube.

    A parameter without a start value begins in the middle.
    """
    coordinates = []
    for each in parameters:
        if each.start is None:
            coordinates.append(0.5)
        elif each.scale == "log":
            coordinates.append(math.log(each.start / each.min) / math.log(each.max / each.min))
        else:
            coordinates.append((each.start - each.min) / (each.max - each.min))
    return coordinates


def _value(spec: ParameterSpec, coordinate: float) -> float:
    value = interpolate(coordinate, spec.min, spec.max, spec.scale == "log")
    if spec.whole:
        return min(max(round(value), math.ceil(spec.min)), math.floor(spec.max))
    if unit := spec.multiple_of:
        count = min(
            max(round(value / unit), math.ceil(spec.min / unit)), math.floor(spec.max / unit)
        )
        return float(f"{count * unit:.12g}")
    return min(max(float(f"{value:.12g}"), spec.min), spec.max)


@dataclass(frozen=True)
class Constraint:
    """Constraint `left <= right`."""

    left: Expression
    right: Expression

    def violation(self, values: Mapping[str, float]) -> float:
        """Return by how much the constraint is violated.

        0 if it is met, infinity if a side is NaN.
        """
        excess = self.left(values) - self.right(values)
        return math.inf if math.isnan(excess) else max(0.0, excess)


def parse_constraint(text: str) -> Constraint:
    """Parse `a <= b` or `a >= b`; raise ValueError if it is invalid."""
    tree = parse_syntax(text)
    if not (
        isinstance(tree, ast.Compare)
        and len(tree.ops) == 1
        and isinstance(tree.ops[0], ast.LtE | ast.GtE)
    ):
        raise ValueError(f'expected a comparison with <= or >=, found "{text}"')
    sides = [Expression(ast.unparse(side), side) for side in (tree.left, tree.comparators[0])]
    for side in sides:
        check_node(side.tree)
    left, right = sides if isinstance(tree.ops[0], ast.LtE) else sides[::-1]
    return Constraint(left, right)
