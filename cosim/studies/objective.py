"""Constraints of KPIs: comparisons of two arithmetic expressions with `<=` or `>=`."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from dataclasses import dataclass

from ..core.expressions import Expression, check_node, parse_syntax


@dataclass(frozen=True)
class Constraint:
    """Constraint `left <= right`."""

    left: Expression
    right: Expression

    @property
    def names(self) -> list[str]:
        """Names of the KPIs and parameters on both sides."""
        return [*self.left.names, *self.right.names]

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
