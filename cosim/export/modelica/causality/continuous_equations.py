"""Solution of the continuous equations and of the initial equations of a model.

Models whose equations all have a variable alone on one side keep their array equations. For all
others the equations are split into scalar ones and solved in general form (`equation_systems`).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ....core.errors import InputError
from ..model.flat_model import Equation, Model, previous_name
from ..model.syntax_tree import Assign, For, Literal, Name, Solve
from ..model.traversal import assigned_references, read_references
from .assignment import strongly_connected_components
from .equation_systems import EquationSystem, reference_of
from .matching import ScalarKey, is_input, match_equations, match_initial_equations, scalar_keys

#: solved equation, system of equations, or loop around a system
Solution = Assign | Solve | For


def solve_equations(
    model: Model, assigned: Collection[str]
) -> tuple[Sequence[Solution], set[ScalarKey]]:
    """Solve the continuous equations for the variables that nothing else defines.

    Args:
        model: The flat model.
        assigned: The continuous states and the variables that when-clauses and algorithms assign.

    Returns:
        The solved equations, and the relations in algebraic loops, which keep their value in an
        evaluation of the equations.

    Raises:
        InputError: The equations do not determine the variables.
    """
    try:
        explicit = match_equations(model, assigned)
    except InputError:
        explicit = None
    if explicit is not None and not _has_loop(model, explicit):
        return explicit, set()
    known = {
        v.name
        for v in model.variables.values()
        if v.variability in ("constant", "parameter") or is_input(v)
    }
    known |= set(assigned) | _previous_values(model)
    system = EquationSystem(model, model.equations, _keys(model, set(model.variables) - known))
    return system.solve(), system.held


def _has_loop(model: Model, statements: Sequence[Assign]) -> bool:
    writers = {
        key: k for k, s in enumerate(statements) for key in scalar_keys(model.variables, s.target)
    }
    reads = [
        {
            writers[key]
            for item in read_references(s)
            for key in scalar_keys(model.variables, item)
            if key in writers
        }
        for s in statements
    ]
    return any(len(component) > 1 for component in strongly_connected_components(reads)) or any(
        k in r for k, r in enumerate(reads)
    )


def solve_initial_equations(
    model: Model,
    assigned: Collection[str],
    continuous: Sequence[Solution],
    written: Collection[ScalarKey],
) -> tuple[Sequence[Solution], set[ScalarKey]]:
    """Solve the continuous and the initial equations for the values at the start.

    States, variables that when-clauses assign, and values before the initialization have their
    start values unless an initial equation determines them.

    Args:
        model: The flat model.
        assigned: The continuous states and the variables that when-clauses and algorithms assign.
        continuous: The solved continuous equations.
        written: The scalars that when-clauses and algorithms assign at the initialization.

    Returns:
        The solved equations, and the relations in algebraic loops.

    Raises:
        InputError: The equations do not determine the initial values, or contradict each other.
    """
    if not model.hybrid:
        try:
            explicit = match_initial_equations(model, assigned)
        except InputError:
            explicit = None
        if explicit is not None and all(isinstance(s, Assign) for s in continuous):
            return [*continuous, *explicit], set()
    known = {
        v.name
        for v in model.variables.values()
        if v.variability in ("constant", "parameter") or is_input(v)
    }
    fixed = {name for name in model.states if model.variables[name].fixed}
    started = (set(assigned) | _previous_values(model)) - fixed
    optional = _keys(model, started) - set(written)
    unknowns = _keys(model, set(model.variables) - known - started - fixed) - set(written)
    fixed_unknowns = [
        Equation(Name(v.name), v.start or Literal(0.0, "Real"), v.where)
        for v in model.variables.values()
        if v.fixed and v.type == "Real" and v.name in {name for name, _ in unknowns}
    ]
    equations = (*model.equations, *model.initial_equations, *fixed_unknowns)
    system = EquationSystem(model, equations, unknowns, [optional], continues=True)
    solved = system.solve()
    determined = {key for s in solved for key in _solved_keys(model, s)} | set(written)
    kept = [
        Assign(reference_of(key, model), reference_of((previous_name(key[0]), key[1]), model))
        for key in sorted(optional - determined)
        if key[0] not in model.states and previous_name(key[0]) in model.variables
    ]
    return [*solved, *kept], system.held


def _solved_keys(model: Model, statement: Solution) -> set[ScalarKey]:
    return {
        key
        for target in assigned_references(statement)
        for key in scalar_keys(model.variables, target)
    }


def _previous_values(model: Model) -> set[str]:
    return {previous_name(name) for name in model.hybrid.remembered} if model.hybrid else set()


def _keys(model: Model, names: Collection[str]) -> set[ScalarKey]:
    return {key for name in names for key in scalar_keys(model.variables, Name(name))}
