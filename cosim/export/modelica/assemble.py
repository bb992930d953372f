"""Compilation of a Modelica file to a block, and the FMI attributes of its variables."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError, Problem
from ..fmu.block import Block, BlockVariable, Exchange
from .c_code.emit import generate_c
from .c_code.exchange_code import has_exchange, indicator_count
from .c_code.header import struct_members
from .causality.clock_inference import clock_parameters
from .causality.clocked_partitions import resolve_clocks
from .causality.continuous_states import introduce_derivatives
from .causality.dependent_states import reduce_states
from .causality.hybrid import prepare_hybrid
from .causality.hybrid_interpreter import HybridInterpreter
from .causality.interpreter import Interpreter
from .causality.matching import is_input
from .external.library import callable_functions
from .external.sources import external_archives
from .frontend.constants import fold_constants
from .frontend.folded_branches import folded_parameters
from .frontend.reader import ModelReader
from .frontend.rumoca_frontend import DEFAULT_OPTIONS, ModelicaOptions, flatten_model
from .frontend.sources import ModelicaSources
from .frontend.strings import fold_strings, string_parameters
from .imbalance import explain_imbalance
from .model.arithmetic import EvaluationError
from .model.flat_model import Model, Variable, derivative_name
from .model.syntax_tree import raise_model_error
from .model.traversal import variable_names
from .units import FmiRole, check_units

_FMI_TYPES = {
    "Real": "Float64",
    "Integer": "Int32",
    "Boolean": "Boolean",
    "Enumeration": "Enumeration",
}
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
        return _load_block(path, model, options)


def _load_block(path: Path, model: str | None, options: ModelicaOptions) -> Block:
    defaults, sources = _flatten(path, model, options)
    folder = _source_root(sources.used)
    names = {str(file.relative_to(folder)): file for file in sources.used}
    return Block(
        identifier=re.sub(r"\W", "_", defaults.model.name.rpartition(".")[2]),
        description=defaults.model.description,
        variables=_block_variables(defaults),
        step_size=min(
            (float(defaults.evaluate(clock.period)) for clock in defaults.schedule.clocks),
            default=_DEFAULT_STEP_SIZE,
        ),
        files=generate_c(defaults, sorted(names), sources.packages),
        resources=names,
        archives=external_archives(
            (f for f in defaults.model.functions.values() if f.external), sources.packages
        ),
        exchange=_exchange(defaults.model) if has_exchange(defaults.model) else None,
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


def load_interpreter(
    path: Path, model: str | None = None, options: ModelicaOptions = DEFAULT_OPTIONS
) -> Interpreter:
    """Create an interpreter of a Modelica model with default parameters.

    Args:
        path: The Modelica file.
        model: Name of the model. None selects the model with the name of the file.
        options: Libraries and values of parameters.

    Raises:
        InputError: The model has errors or uses unsupported features.
    """
    with _refusing_deep_nesting(path):
        return _flatten(path, model, options)[0]


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
) -> tuple[Interpreter, ModelicaSources]:
    try:
        json, sources = flatten_model(Path(path), model, options)
    except InputError as error:
        if options.supplement:
            raise
        raise explain_imbalance(
            error, lambda text: _flatten(path, model, replace(options, supplement=text))
        ) from None
    return analyse(json, sources, model or Path(path).stem), sources


def analyse(json: Mapping[str, Any], sources: ModelicaSources, name: str) -> Interpreter:
    """Convert the document of the front end to an interpreter of the model."""
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
        return HybridInterpreter(flat) if flat.hybrid else Interpreter(flat)
    except EvaluationError as error:
        where = str(sources.files[0]) if sources.files else ""
        raise InputError(
            Problem(f"the default values of the parameters are not valid: {error}", where)
        ) from None


def _without_unused_connectors(model: Model) -> Model:
    """Return the model without the variables of its components that occur nowhere, as in expandable connectors."""
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
        if variable.type not in _FMI_TYPES:
            raise_model_error(
                f"{variable.name}: variables of type {variable.type} are not supported",
                variable.where,
            )


def _source_root(files: Sequence[Path]) -> Path:
    """Return the folder that contains all files of the model."""
    return min(
        (file.parent.parent if file.name == "package.mo" else file.parent for file in files),
        key=lambda f: len(f.parts),
    )


def _block_variables(defaults: Interpreter) -> list[BlockVariable]:
    names = struct_members(defaults.model)
    roles = [
        (v, role) for v in defaults.model.variables.values() if (role := _fmi_role(v, defaults))
    ]
    dropped = check_units(roles)
    known = ((replace(v, unit="") if v.unit in dropped else v, role) for v, role in roles)
    return [_block_variable(v, names[v.name], role, defaults) for v, role in known]


def _fmi_role(variable: Variable, defaults: Interpreter) -> FmiRole | None:
    """Return causality and variability of a variable in the FMU, or None if the FMU does not contain it.

    The FMU contains the inputs and outputs of the model itself, and all parameters that are neither protected nor set by a
    modifier. Structural parameters are constants. The FMU of a model with states, event iteration or a library contains all
    other variables too.
    """
    roles = defaults.parameter_roles
    if variable.type == "ExternalObject":
        return None
    if variable.name in roles.settable:
        return "parameter", "fixed" if variable.name in roles.clock_parameters else "tunable"
    if variable.name in defaults.model.structural and not variable.protected:
        return "local", "constant"
    if variable.variability == "parameter":
        return (
            None
            if variable.protected or variable.bound_by_modifier
            else ("calculatedParameter", "tunable")
        )
    continuous = variable.type == "Real" and bool(
        defaults.model.states or not defaults.schedule.clocks
    )
    if is_input(variable):
        return "input", "continuous" if variable.type == "Real" else "discrete"
    if variable.causality == "output" and variable.top_level:
        return "output", "continuous" if continuous else "discrete"
    if (
        (defaults.model.hybrid or defaults.model.uses_library or defaults.model.states)
        and not variable.name.startswith(("$", "pre("))
        and 0 not in variable.shape
    ):
        return (
            "local",
            "continuous" if continuous and variable.variability == "continuous" else "discrete",
        )
    return None


def _block_variable(
    variable: Variable, member: str, role: FmiRole, defaults: Interpreter
) -> BlockVariable:
    return BlockVariable(
        name=variable.name,
        member=member,
        type=_FMI_TYPES[variable.type],
        causality=role[0],
        variability=role[1],
        start=_to_python(defaults.get(variable.name)),
        unit=variable.unit,
        shape=variable.shape,
        description=variable.description,
        minimum=None
        if variable.minimum is None
        else float(np.min(defaults.evaluate(variable.minimum))),
        maximum=None
        if variable.maximum is None
        else float(np.max(defaults.evaluate(variable.maximum))),
        enumeration=tuple((literal, "") for literal in _literals(variable, defaults.model)),
        type_name=variable.enumeration,
        quantity=variable.quantity,
    )


def _literals(variable: Variable, model: Model) -> tuple[str, ...]:
    """Return the literals of a variable's enumeration type; the type name may lack the package."""
    name = variable.enumeration
    candidates = {
        literals
        for key, literals in model.enumerations.items()
        if name and f".{key}".endswith(f".{name}")
    }
    if len(candidates) > 1:
        raise_model_error(
            f'{variable.name}: several enumerations are named "{name}"; give them different names',
            variable.where,
        )
    return next(iter(candidates), ())


def _to_python(value: Any) -> Any:
    return tuple(value.ravel().tolist()) if isinstance(value, np.ndarray) else value
