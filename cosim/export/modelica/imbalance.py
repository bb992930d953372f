"""Names of the variables and equations because of which a model has too few or too many equations.

The front end only counts. Its counts agree for the model with as many equations `time = time`, or
variables, as are missing. The matching of this model then shows which variables no equation
determines, or which equations contradict others.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

from ...core.errors import InputError, Problem, abbreviate_names
from .causality.equation_systems import SingularError

_BALANCE = re.compile(r"unbalanced model: \d+ equations, \d+ unknowns \(balance = (-?\d+)\)")
#: name of the variables that are added to a model with too many equations
_ADDED = "cosimAdded"


def explain_imbalance(error: InputError, analyse: Callable[[str], object]) -> InputError:
    """Return the error of a model with the names of variables and equations in messages about an unbalanced model.

    Args:
        error: The error.
        analyse: Analyses the model with a text of further declarations and equations.
    """
    return InputError([_explain(problem, analyse) for problem in error.problems])


def _explain(problem: Problem, analyse: Callable[[str], object]) -> Problem:
    found = _BALANCE.search(problem.message)
    if found is None:
        return problem
    balance = int(found[1])
    try:
        analyse(
            f"Real {_ADDED}[{balance}];"
            if balance > 0
            else f"equation {'time = time; ' * -balance}"
        )
    except SingularError as singular:
        cause = _undetermined(singular) if balance < 0 else _surplus(singular)
        return replace(cause, message=f"{problem.message}: {cause.message}") if cause else problem
    except InputError:
        pass
    return problem


def _undetermined(singular: SingularError) -> Problem | None:
    """Return the variables that no equation determines, with the place of the first one."""
    if not singular.undetermined:
        return None
    names = abbreviate_names(name for name, _ in singular.undetermined)
    return Problem(f"no equation determines {names}", str(singular.undetermined[0][1] or ""))


def _surplus(singular: SingularError) -> Problem | None:
    """Return the first equation that contradicts others."""
    if not singular.surplus:
        return None
    where, names = singular.surplus[0]
    others = (
        f"the others determine {abbreviate_names(names)}"
        if names
        else "it contains no unknown variable"
    )
    return Problem(f"this equation is one too many, {others}", str(where or ""))
