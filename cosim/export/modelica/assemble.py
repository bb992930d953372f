"""Compilation of a Modelica file to a block.

Of an unbalanced model the front end only counts the equations. Its counts agree for the model with
as many equations `time = time`, or variables, as are missing. The matching of this model then shows
which variables no equation determines, or which equations contradict others.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any

from ...core.errors import InputError, Problem, abbreviate_names
from ..fmu.block import Block, BlockVariable, Exchange
from .c_code import generate_c
from .c_code.exchange_code import has_exchange, indicator_count
from .causality.analysed_model import AnalysedModel
from .causality.clock_inference import clock_parameters
from .causality.clocked_partitions import resolve_clocks
from .causality.continuous_states import introduce_derivatives, reduce_states
from .causality.equation_systems import SingularError
from .causality.hybrid import prepare_hybrid
from .external.c_files import external_archives
from .external.shared_library import callable_functions
from .fmi_variables import FMI_TYPES, block_variables
from .frontend.constants import fold_constants, fold_strings, string_parameters
from .frontend.folded_branches import folded_parameters
from .frontend.model_files import ModelicaSources
from .frontend.reader import ModelReader
from .frontend.rumoca_frontend import DEFAULT_OPTIONS, ModelicaOptions, flatten_model
from .model.arithmetic import EvaluationError
from .model.flat_model import Model, derivative_name
from .model.syntax_tree import raise_model_error
from .model.traversal import variable_names

_DEFAULT_STEP_SIZE = 0.01

#: largest number of values of all variables; an array has one per element
MAX_MODEL_SIZE = 1_000_000


def load_block(
    path: Path, model: str | None = None, options: ModelicaOptions = DEFAULT_OPTIONS
) -> Block:
    """Compile a Modelica model to a block.

    Args:
        path: The Modelica file. It may use the packages in folders beside it.
        model: Name of the model. None selects the model with the name of the file.
        options: Libraries and values of parameters.

    Raises:
        InputError: The model has errors or uses unsupported features; the error contains the file
            and line.
    """
    with _refusing_deep_nesting(path):
        return _block(*analyse_file(path, model, options))


def _block(analysed: AnalysedModel, sources: ModelicaSources) -> Block:
    # the folder that contains all files of the model
    folder = min(
        (file.parent.parent if file.name == "package.mo" else file.parent for file in sources.used),
        key=lambda f: len(f.parts),
    )
    names = {str(file.relative_to(folder)): file for file in sources.used}
    return Block(
        identifier=re.sub(r"\W", "_", analysed.model.name.rpartition(".")[2]),
        description=analysed.model.description,
        variables=block_variables(analysed),
        step_size=min(
            (float(analysed.evaluate(clock.period)) for clock in analysed.schedule.clocks),
            default=_DEFAULT_STEP_SIZE,
        ),
        files=generate_c(analysed, sorted(names), sources.packages),
        resources=names,
        archives=external_archives(
            (f for f in analysed.model.functions.values() if f.external), sources.packages
        ),
        exchange=_exchange(analysed.model) if has_exchange(analysed.model) else None,
    )


def _exchange(model: Model) -> Exchange:
    indicators = [
        BlockVariable(
            f"_event_indicator_{k + 1}",
            f"indicator[{k}]",
            "Float64",
            "local",
            "continuous",
            description="For Model Exchange",
        )
        for k in range(indicator_count(model))
    ]
    stores_values = model.hybrid is not None and bool(model.hybrid.delays)
    return Exchange(
        {state: derivative_name(state) for state in model.states}, indicators, stores_values
    )


def analyse_file(
    path: Path, model: str | None = None, options: ModelicaOptions = DEFAULT_OPTIONS
) -> tuple[AnalysedModel, ModelicaSources]:
    """Return a model of a Modelica file after causality analysis, and its sources.

    Args:
        path: The Modelica file.
        model: Name of the model. None selects the model with the name of the file.
        options: Libraries and values of parameters.

    Raises:
        InputError: The model has errors or uses unsupported features.
    """
    with _refusing_deep_nesting(path):
        return _flatten(path, model, options)


@contextmanager
def _refusing_deep_nesting(path: Path) -> Iterator[None]:
    """Raise InputError if an expression is nested deeper than Python's recursion limit."""
    try:
        yield
    except RecursionError:
        raise InputError(
            Problem(
                "an expression or statement is nested too deeply; divide it into several", str(path)
            )
        ) from None


def _flatten(
    path: Path, model: str | None, options: ModelicaOptions
) -> tuple[AnalysedModel, ModelicaSources]:
    try:
        json, sources = flatten_model(Path(path), model, options)
    except InputError as error:
        if options.supplement:
            raise
        raise explain_imbalance(
            error, lambda text: _flatten(path, model, replace(options, supplement=text))
        ) from None
    return analyse(json, sources, model or Path(path).stem), sources


def analyse(json: Mapping[str, Any], sources: ModelicaSources, name: str) -> AnalysedModel:
    """Convert the document of the front end to an analysed model."""
    flat = ModelReader(json, sources).read_model(name)
    structural = (
        flat.structural
        | folded_parameters(json, sources)
        | string_parameters(flat)
        | clock_parameters(flat)
    )
    flat = replace(
        flat,
        structural=structural,
        functions=callable_functions(flat.functions, sources.packages),
        uses_library=bool(sources.libraries),
    )
    flat = _without_unused_connectors(flat)
    flat = prepare_hybrid(
        reduce_states(introduce_derivatives(resolve_clocks(fold_strings(fold_constants(flat)))))
    )
    _check_types(flat)
    try:
        return AnalysedModel(flat)
    except EvaluationError as error:
        where = str(sources.files[0]) if sources.files else ""
        raise InputError(
            Problem(f"the default values of the parameters are not valid: {error}", where)
        ) from None


def _without_unused_connectors(model: Model) -> Model:
    """Return the model without the variables of its components that occur nowhere.

    Expandable connectors have such variables.
    """
    used = variable_names(
        (model.equations, model.whens, model.algorithms, model.asserts, model.initial_equations)
    )
    unused = {
        v.name
        for v in model.variables.values()
        if "." in v.name
        and v.name not in used
        and v.variability in ("continuous", "discrete")
        and v.causality == "local"
        and not v.binding
    }
    return replace(
        model, variables={name: v for name, v in model.variables.items() if name not in unused}
    )


def _check_types(model: Model) -> None:
    size = 0
    for variable in model.variables.values():
        size += prod(variable.shape)
        if size > MAX_MODEL_SIZE:
            raise_model_error(
                f"{variable.name}: the model has more than {MAX_MODEL_SIZE} values", variable.where
            )
        if (
            variable.type == "ExternalObject"
            and variable.variability == "parameter"
            and not variable.shape
        ):
            continue
        if variable.type not in FMI_TYPES:
            raise_model_error(
                f"{variable.name}: variables of type {variable.type} are not supported",
                variable.where,
            )


_BALANCE = re.compile(r"unbalanced model: \d+ equations, \d+ unknowns \(balance = (-?\d+)\)")

#: name of the variables that are added to a model with too many equations
_ADDED = "cosimAdded"


def explain_imbalance(error: InputError, analyse: Callable[[str], object]) -> InputError:
    """Return an error that names the variables and equations of an unbalanced model.

    Args:
        error: The error.
        analyse: Analyses the model with a text of further declarations and equations.
    """
    return InputError([_explain_problem(problem, analyse) for problem in error.problems])


def _explain_problem(problem: Problem, analyse: Callable[[str], object]) -> Problem:
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
