"""Solution of the continuous equations and of the initial equations of a model.

Models whose equations all have a variable alone on one side keep their array equations. For all
others the equations are split into scalar ones and solved in general form (`equation_systems`).
"""

from collections.abc import Collection, Sequence

from ....core.errors import InputError
from ..model.flat_model import Equation, Model, given_variables, previous_name
from ..model.scalars import (
    ScalarKey,
    reference_of,
    scalar_keys,
    scalars_in,
    scalars_of,
    scalars_read,
)
from ..model.syntax_tree import (
    Assign,
    Expression,
    For,
    Index,
    Literal,
    Name,
    Solve,
    raise_model_error,
)
from ..model.traversal import assigned_references, is_call
from .equation_systems import EquationSystem
from .matching import strongly_connected_components

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
    known = given_variables(model) | set(assigned) | _previous_values(model)
    system = EquationSystem(model, model.equations, scalars_of(model, set(model.variables) - known))
    return system.solve(), system.held


def _has_loop(model: Model, statements: Sequence[Assign]) -> bool:
    writers = {}
    for k, statement in enumerate(statements):
        for key in scalar_keys(model.variables, statement.target):
            writers[key] = k
    reads = []
    for statement in statements:
        keys = scalars_read(model, statement)
        reads.append({writers[key] for key in keys if key in writers})
    components = strongly_connected_components(reads)
    return any(len(component) > 1 for component in components) or any(
        k in read for k, read in enumerate(reads)
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
    known = given_variables(model)
    fixed = {name for name in model.states if model.variables[name].fixed}
    started = (set(assigned) | _previous_values(model)) - fixed
    optional = scalars_of(model, started) - set(written)
    unknowns = scalars_of(model, set(model.variables) - known - started - fixed) - set(written)
    unknown_names = {name for name, _ in unknowns}
    fixed_unknowns = [
        Equation(Name(v.name), v.start or Literal(0.0, "Real"), v.where)
        for v in model.variables.values()
        if v.fixed and v.type == "Real" and v.name in unknown_names
    ]
    equations = (*model.equations, *model.initial_equations, *fixed_unknowns)
    system = EquationSystem(model, equations, unknowns, [optional], continues=True)
    solved = system.solve()
    determined = scalars_in(model, assigned_references(tuple(solved))) | set(written)
    kept = [
        Assign(reference_of(key, model), reference_of((previous_name(key[0]), key[1]), model))
        for key in sorted(optional - determined)
        if key[0] not in model.states and previous_name(key[0]) in model.variables
    ]
    return [*solved, *kept], system.held


def _previous_values(model: Model) -> set[str]:
    return {previous_name(name) for name in model.hybrid.remembered} if model.hybrid else set()


def match_equations(model: Model, assigned: Collection[str]) -> list[Assign]:
    """Match the continuous equations with variables.

    An equation between two variables (`a = b`) defines the one that no other equation defines. It
    is matched after the other equations have been matched.

    Args:
        model: The flat model.
        assigned: The variables that when-clauses and algorithms assign.

    Returns:
        The equations as assignments, in the order of the model.

    Raises:
        InputError: An equation defines no variable, or a variable has no equation.
    """
    defined = scalars_of(model, set(assigned) | _previous_values(model) | given_variables(model))
    pending, matched = list(enumerate(model.equations)), dict[int, Assign]()
    while pending:
        unmatched = []
        for number, equation in pending:
            candidates = _candidates(model, equation, defined)
            if len(candidates) == 1:
                defined |= scalar_keys(model.variables, candidates[0].target)
                matched[number] = candidates[0]
            else:
                unmatched.append((number, equation))
        if len(unmatched) == len(pending):
            _raise_unmatched([equation for _, equation in unmatched], model, defined)
        pending = unmatched
    for variable in model.variables.values():
        if not scalar_keys(model.variables, Name(variable.name)) <= set(defined):
            raise_model_error(f"no equation gives {variable.name} a value", variable.where)
    return [matched[number] for number in sorted(matched)]


def _candidates(model: Model, equation: Equation, defined: Collection[ScalarKey]) -> list[Assign]:
    """Return the assignments of an undefined variable that are equivalent to the equation.

    None, one or two.
    """
    sides = ((equation.left, equation.right), (equation.right, equation.left))
    assignments = []
    for side, other in sides:
        if isinstance(side, Name | Index):
            keys = scalar_keys(model.variables, side)
            if keys and keys.isdisjoint(defined):
                assignments.append(Assign(side, other, equation.where))
    return assignments


def _raise_unmatched(
    equations: list[Equation], model: Model, defined: Collection[ScalarKey]
) -> None:
    equation = equations[0]
    if _candidates(model, equation, defined):
        sides = [side for each in equations for side in (each.left, each.right)]
        names = ", ".join(sorted({side.name for side in sides if isinstance(side, Name)}))
        raise_model_error(
            "these variables are only connected to each other, no equation gives them a "
            f"value: {names}",
            equation.where,
        )
    raise_model_error(
        "this equation defines no variable: one side must be a variable, or der() of one, that "
        "no other equation defines",
        equation.where,
    )


def match_initial_equations(model: Model, assigned: Collection[str]) -> list[Assign]:
    """Match the initial equations with variables; an equation `pre(x) = ...` defines x.

    Args:
        model: The flat model.
        assigned: The continuous states and the variables that when-clauses and algorithms assign.

    Returns:
        The initial equations as assignments.

    Raises:
        InputError: An initial equation defines none of these variables.
    """
    return [_initial_assignment(model, equation, assigned) for equation in model.initial_equations]


def _initial_assignment(model: Model, equation: Equation, assigned: Collection[str]) -> Assign:
    assignments = []
    for side, other in ((equation.left, equation.right), (equation.right, equation.left)):
        target: Expression = side.arguments[0] if is_call(side, "pre") else side
        if isinstance(target, Name | Index) and {
            name for name, _ in scalar_keys(model.variables, target)
        } & set(assigned):
            assignments.append(Assign(target, other, equation.where))
    if not assignments:
        raise_model_error(
            "one side of an initial equation must be a continuous state, or a variable that a "
            "when-clause assigns",
            equation.where,
        )
    return assignments[0]
