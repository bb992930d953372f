"""Causality of equations in any form: explicit solutions, and systems for algebraic loops.

The scalar equations are matched with unknowns and divided into components (`matching`). An equation
that is linear in its only unknown is solved symbolically: with the residual r = a x + b, a = dr/dx
does not contain x, and b is r at x = 0. All other components become systems for Newton's method
with symbolic derivatives. Comparisons in a loop keep their values while the loop is solved.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import chain

from ....core.errors import InputError, Problem
from ..model.flat_model import Equation, Model
from ..model.scalars import ScalarKey, reference_of, scalar_keys, scalars_read
from ..model.simplification import ZERO, divide, negate, subtract, without_zeros
from ..model.syntax_tree import (
    Assign,
    Binary,
    Expression,
    For,
    Index,
    Literal,
    Name,
    Range,
    Solve,
    SourceLocation,
    raise_model_error,
)
from ..model.traversal import has_builtin, is_call, rewrite, rewrite_outermost
from .differentiation import Differentiation
from .matching import match, strongly_connected_components
from .scalar_equations import EquationSplitter

#: steps from the simplified to the actual expressions of homotopy()
_CONTINUATION_STEPS = 10
_DISCRETE_TYPES = ("Integer", "Boolean", "Enumeration")


class SingularError(InputError):
    """Structurally singular system of equations.

    Attributes:
        undetermined: Variables that no equation determines, with the places of their declarations.
        surplus: Places of the equations that determine no variable, with the variables that they
            contain.
    """

    def __init__(
        self,
        undetermined: Sequence[tuple[str, SourceLocation | None]],
        surplus: Sequence[tuple[SourceLocation | None, Sequence[str]]],
    ):
        self.undetermined, self.surplus = undetermined, surplus
        names = ", ".join(name for name, _ in undetermined)
        where = surplus[0][0] if surplus else undetermined[0][1]
        if undetermined and surplus:
            text = f"the equations do not determine {names}, and this equation contradicts others"
        elif surplus:
            text = "this equation is superfluous: the others determine all its variables"
        else:
            text = f"no equation gives {undetermined[0][0]} a value"
        super().__init__(Problem(text, str(where or "")))


@dataclass
class EquationSystem:
    """The continuous equations of a model as scalar equations, for one set of unknowns."""

    model: Model
    equations: Sequence[Equation]
    unknowns: Collection[ScalarKey]
    #: groups of unknowns that have a value if no equation is needed for them, for example start
    #: values
    optional: Sequence[Collection[ScalarKey]] = ()
    #: true to solve equations with homotopy(actual, simplified) in steps from the simplified to the
    #: actual ones
    continues: bool = False

    def __post_init__(self) -> None:
        splitter = EquationSplitter(self.model)
        self._scalar = list(chain.from_iterable(map(splitter.split, self.equations)))
        self._all = set(self.unknowns).union(*self.optional)
        self._incidence = [self._keys(equation) for equation in self._scalar]
        relations = self.model.hybrid.relations if self.model.hybrid else ()
        self._relations = {relation.name for relation in relations}
        #: relations in algebraic loops, which keep their value while the equations are evaluated
        self.held: set[ScalarKey] = set()

    @property
    def scalar_equations(self) -> Sequence[Equation]:
        """The equations, one for each element."""
        return self._scalar

    def is_linear(self, equation: Equation, key: ScalarKey) -> bool:
        """Return whether a scalar equation is linear in an unknown."""
        return self._system([equation], [key]).linear

    def matching(self) -> dict[int, ScalarKey]:
        """Return the unknown that each scalar equation determines.

        Equations without one are missing.
        """
        return match([self._preferences(k) for k in range(len(self._scalar))], self.optional)

    def solve(self) -> list[Assign | Solve | For]:
        """Return the equations as assignments and systems of equations, in no particular order.

        Raises:
            InputError: The system is structurally singular.
        """
        matched = self.matching()
        self._check(matched)
        numbers = sorted(matched)
        owner = {matched[number]: k for k, number in enumerate(numbers)}
        successors = []
        for k, number in enumerate(numbers):
            others = {owner[key] for key in self._incidence[number] if key in owner}
            successors.append(others - {k})
        components = strongly_connected_components(successors)
        loops: set[int] = set()
        for component in components:
            if len(component) > 1:
                loops.update(k for k in component if matched[numbers[k]][0] in self._relations)
        if loops:
            self.held |= {matched[numbers[k]] for k in loops}
            successors = [nodes - loops for nodes in successors]
            components = strongly_connected_components(successors)
        solved = []
        for component in components:
            solved.append(self._solve_component([numbers[k] for k in component], matched))
        return solved

    def _keys(self, equation: Equation) -> list[ScalarKey]:
        """Return the unknowns that an equation contains."""
        return sorted(scalars_read(self.model, (equation.left, equation.right)) & self._all)

    def _preferences(self, number: int) -> list[ScalarKey]:
        """Return the unknowns for which an equation can be solved.

        Those that stand alone on one side are first.
        """
        equation = self._scalar[number]
        preferred: list[ScalarKey] = []
        for side in (equation.left, equation.right):
            preferred += [k for k in self._key_of(side) if self._is_free_of(k, side, equation)]
        others = [key for key in self._incidence[number] if not self._is_discrete(key)]
        return list(dict.fromkeys([*preferred, *others]))

    def _key_of(self, side: Expression) -> set[ScalarKey]:
        keys = scalar_keys(self.model.variables, side) if isinstance(side, Name | Index) else set()
        return keys & self._all if len(keys) == 1 else set()

    def _is_free_of(self, key: ScalarKey, side: Expression, equation: Equation) -> bool:
        other = equation.right if side is equation.left else equation.left
        return key not in scalars_read(self.model, other)

    def _is_discrete(self, key: ScalarKey) -> bool:
        return self.model.variables[key[0]].type in _DISCRETE_TYPES

    def _check(self, matched: dict[int, ScalarKey]) -> None:
        missing = set(self.unknowns) - set(matched.values())
        surplus = [
            equation for number, equation in enumerate(self._scalar) if number not in matched
        ]
        if surplus or missing:
            names = sorted({name for name, _ in missing})
            variables = [(name, self.model.variables[name].where) for name in names]
            equations = [(each.where, self._names(each)) for each in surplus]
            raise SingularError(variables, equations)

    def _names(self, equation: Equation) -> list[str]:
        """Return the names of the unknowns that an equation contains."""
        return sorted({name for name, _ in self._keys(equation)})

    def _solve_component(
        self, numbers: list[int], matched: dict[int, ScalarKey]
    ) -> Assign | Solve | For:
        if len(numbers) == 1:
            return self._solve_scalar(self._scalar[numbers[0]], matched[numbers[0]])
        keys = [matched[number] for number in numbers]
        if discrete := [key for key in keys if self._is_discrete(key)]:
            chain = ", ".join(sorted({name for name, _ in keys}))
            raise_model_error(
                f"algebraic loop with the discrete variable {discrete[0][0]}: {chain}; break "
                "it with pre()",
                self._scalar[numbers[0]].where,
            )
        return self._continued([self._scalar[number] for number in numbers], keys)

    def _continued(self, equations: Sequence[Equation], keys: Sequence[ScalarKey]) -> Solve | For:
        """Return a system of equations, in a loop if it has homotopy().

        The part of the actual expressions grows from iteration to iteration.
        """
        if not (self.continues and has_builtin(tuple(equations), "homotopy")):
            return self._system(equations, keys)
        part = Binary("/", Name("continuation"), Literal(float(_CONTINUATION_STEPS), "Real"))

        def mix(node: object) -> object:
            if not (is_call(node, "homotopy")):
                return node
            actual, simplified = node.arguments
            return Binary(
                "+", simplified, Binary("*", part, Binary("-", actual, simplified, node.where))
            )

        system = self._system(rewrite(tuple(equations), mix), keys)
        steps = Range(Literal(0, "Integer"), None, Literal(_CONTINUATION_STEPS, "Integer"))
        return For("continuation", steps, (system,), system.where)

    def _solve_scalar(self, equation: Equation, key: ScalarKey) -> Assign | Solve | For:
        reference = reference_of(key, self.model)
        for side, other in ((equation.left, equation.right), (equation.right, equation.left)):
            if self._key_of(side) == {key} and self._is_free_of(key, side, equation):
                return Assign(reference, other, equation.where)
        system = self._system([equation], [key])
        if not system.linear or system.jacobian[0][0] == ZERO:
            return self._continued([equation], [key])
        constant = self._without(system.residuals[0], key)
        return Assign(reference, divide(negate(constant), system.jacobian[0][0]), equation.where)

    def _without(self, node: Expression, key: ScalarKey) -> Expression:
        """Return an expression that is linear in an unknown with zero instead of the unknown."""

        def substitute(item: object) -> object:
            if not isinstance(item, Name | Index):
                return None
            return ZERO if self._key_of(item) == {key} else item

        result: Expression = without_zeros(rewrite_outermost(node, substitute))
        return result

    def _system(self, equations: Sequence[Equation], keys: Sequence[ScalarKey]) -> Solve:
        residuals = tuple(subtract(equation.left, equation.right) for equation in equations)
        jacobian = tuple(self._gradient(residual, keys) for residual in residuals)
        linear = scalars_read(self.model, jacobian).isdisjoint(keys)
        references = tuple(reference_of(key, self.model) for key in keys)
        return Solve(
            references,
            residuals,
            jacobian,
            linear,
            next((equation.where for equation in equations if equation.where), None),
        )

    def _gradient(self, node: Expression, keys: Sequence[ScalarKey]) -> tuple[Expression, ...]:
        return tuple(self._derivative(node, key) for key in keys)

    def _derivative(self, node: Expression, key: ScalarKey) -> Expression:
        def leaf(reference: Name | Index) -> Expression | None:
            keys = scalar_keys(self.model.variables, reference)
            return Literal(1.0, "Real") if key in keys else None

        return Differentiation(self.model.functions, leaf)(node)
