"""Model description of an FMU as the importer uses it.

Variables with units and shapes, and capabilities.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ...core.component import DTYPES, Causality, Variability, Variable
from ...core.errors import InputError, join_alternatives
from ...core.size_limits import require_at_most
from ...core.time_grid import exact_fraction
from ...core.units import BASE_UNITS, Unit, named_unit
from .preflight import DEFAULT_LIMITS, Examination, PreflightLimits, raise_errors
from .preflight.binary import list_platforms
from .preflight.model_description import (
    Interface,
    ModelDescription,
    ModelVariable,
    UnitDefinition,
    parse_value,
)
from .preflight.rules_variables import dimension_size, read_limit

#: valid causalities and variabilities by name, to convert text to their literal types
_CAUSALITIES: Mapping[str, Causality] = {name: name for name in get_args(Causality)}
_VARIABILITIES: Mapping[str, Variability] = {name: name for name in get_args(Variability)}
_C_INT = np.dtype(np.int32)
_TRUE = ("true", "1")
_EXPERIMENT = ("startTime", "stopTime", "stepSize", "tolerance")
#: standard names of the log categories of errors (FMI 2.0 section 2.2.4, FMI 3.0 section 2.4.5)
_ERROR_CATEGORIES = ("logStatusError", "logStatusFatal")


@dataclass(frozen=True)
class DefaultExperiment:
    """Default experiment of an FMU.

    Exact times (s) and relative tolerance, None where an attribute is missing or invalid.
    """

    start_time: Fraction | None = None
    stop_time: Fraction | None = None
    step_size: Fraction | None = None
    tolerance: float | None = None


@dataclass(frozen=True)
class FmuDescription:
    """Model description of an FMU.

    Attributes:
        fmi_version: `fmiVersion`, such as "2.0".
        model_name: `modelName`.
        interfaces: All interfaces through which the FMU can be simulated, the preferred one first.
        interface: Interface through which the FMU is simulated; the following attributes of
            capabilities belong to it.
        model_identifier: `modelIdentifier`.
        instantiation_token: `instantiationToken` of FMI 3.0, `guid` of FMI 1.0 and 2.0.
        description: `description`.
        generation_tool: `generationTool`.
        variables: All variables, including the aliases of FMI 3.0.
        value_references: Value references by variable name, including aliases.
        negated: Names of the variables of FMI 1.0 whose values have the opposite sign of their
            value reference's.
        default_experiment: `DefaultExperiment`.
        capabilities: Names of the capability flags that are set, as the FMU writes them.
        has_state: `canGetAndSetFMUState`.
        variable_step: `canHandleVariableCommunicationStepSize`, always true for Model Exchange.
        once_per_process: `canBeInstantiatedOnlyOncePerProcess`.
        needs_execution_tool: `needsExecutionTool`.
        state_count: Number of continuous states of Model Exchange; FMI 3.0 FMUs return it after
            their initialization.
        indicator_count: `numberOfEventIndicators` of FMI 1.0 and 2.0.
        needs_completed_step: Model Exchange requires fmi*CompletedIntegratorStep.
        platforms: Platforms with a binary, as the FMU names their folders, and "c-code" if it
            contains sources.
        error_categories: Those of FMI's log categories of errors that the FMU declares.
        dependencies: Inputs on which each output depends directly, by name; only outputs with
            declared dependencies.
        initial_dependencies: The same in Initialization Mode.
        directional_derivatives: `providesDirectionalDerivatives`.
        continuous_states: Names of the derivatives by the names of the scalar states, as the model
            structure lists them.
        interpolates_inputs: `canInterpolateInputs` of FMI 1.0 and 2.0, always true for Model
            Exchange.
        gives_output_slopes: `maxOutputDerivativeOrder` is at least 1.
        has_event_mode: `hasEventMode` of FMI 3.0 Co-Simulation.
        may_return_early: `mightReturnEarlyFromDoStep` of FMI 3.0 Co-Simulation.
        dimensions: Sizes of the dimensions by name of the variable, a number or the name of a
            structural parameter; empty unless the shape depends on structural parameters.
    """

    fmi_version: str
    model_name: str
    interfaces: Sequence[Interface]
    interface: Interface
    model_identifier: str
    instantiation_token: str
    description: str
    generation_tool: str
    variables: Sequence[Variable]
    value_references: Mapping[str, int]
    negated: frozenset[str]
    default_experiment: DefaultExperiment
    capabilities: Sequence[str]
    has_state: bool
    variable_step: bool
    once_per_process: bool
    needs_execution_tool: bool
    state_count: int
    indicator_count: int
    needs_completed_step: bool
    platforms: Sequence[str]
    error_categories: Sequence[str]
    dependencies: Mapping[str, frozenset[str]]
    initial_dependencies: Mapping[str, frozenset[str]]
    directional_derivatives: bool
    continuous_states: Mapping[str, str]
    interpolates_inputs: bool
    gives_output_slopes: bool
    has_event_mode: bool
    may_return_early: bool
    dimensions: Mapping[str, Sequence[int | str]]

    @property
    def major(self) -> int:
        """FMI major version: 1, 2 or 3."""
        return int(self.fmi_version.split(".")[0])

    def with_structural_parameters(
        self, values: Mapping[str, int], limits: PreflightLimits = DEFAULT_LIMITS
    ) -> FmuDescription:
        """Return the description for other values of structural parameters, which change the shapes of arrays.

        An array that changes its size loses its start value.

        Args:
            values: Positive values of structural parameters by name.
            limits: Limits of the size of an array.

        Raises:
            InputError: An array becomes too large.
        """
        if not values:
            return self
        sizes = {
            **{v.name: v.start for v in self.variables if v.causality == "structuralParameter"},
            **values,
        }
        variables = []
        for variable in self.variables:
            shape = tuple(
                sizes[size] if isinstance(size, str) else size
                for size in self.dimensions.get(variable.name, ())
            )
            if shape and shape != variable.shape:
                require_at_most(
                    limits.max_array_size, math.prod(shape), f'elements of "{variable.name}"', ""
                )
                variables.append(replace(variable, shape=shape, start=None))
            else:
                variables.append(
                    replace(variable, start=values[variable.name])
                    if variable.name in values
                    else variable
                )
        return replace(self, variables=variables)


def build_description(
    path: Path, examination: Examination, interface: Interface | None = None
) -> FmuDescription:
    """Build the description of an examined FMU.

    Args:
        path: The FMU, for messages.
        examination: Result of the preflight check.
        interface: Interface through which the FMU is simulated; by default the preferred one that
            it has.

    Raises:
        InputError: The examination found errors, or the FMU does not have the interface.
    """
    raise_errors(path, examination.findings)
    model = examination.model
    assert model is not None  # otherwise the examination has found an error
    selected = next(iter(model.interfaces)) if interface is None else interface
    if selected not in model.interfaces:
        raise InputError(
            f'"{path}": has no interface for {selected}, only for '
            f"{join_alternatives(model.interfaces)}"
        )
    attributes = model.interfaces[selected]
    units = {unit.name: _build_unit(unit) for unit in model.units}
    sources = [
        (source, variable)
        for source in model.variables
        for variable in _build_variables(model, source, units)
    ]
    by_name = {
        variable.name: (source, variable) for source, variable in reversed(sources)
    }  # the first one of each name
    variables = [variable for source, variable in sources if by_name[variable.name][1] is variable]
    return FmuDescription(
        model.root["fmiVersion"],
        model.root.get("modelName", ""),
        tuple(model.interfaces),
        selected,
        attributes["modelIdentifier"],
        model.root["instantiationToken" if model.major == 3 else "guid"],
        model.root.get("description", ""),
        model.root.get("generationTool", ""),
        variables,
        {
            variable.name: int(by_name[variable.name][0].attributes["valueReference"])
            for variable in variables
        },
        frozenset(
            source.name
            for source in model.variables
            if source.attributes.get("alias") == "negatedAlias"
        ),
        _build_default_experiment(model.default_experiment),
        [name for name, value in attributes.items() if _is_set(name, value)],
        any(
            attributes.get(name) in _TRUE
            for name in ("canGetAndSetFMUstate", "canGetAndSetFMUState")
        ),
        selected == "model-exchange"
        or attributes.get("canHandleVariableCommunicationStepSize") in _TRUE,
        attributes.get("canBeInstantiatedOnlyOncePerProcess") in _TRUE,
        attributes.get("needsExecutionTool") in _TRUE,
        _count_states(model, selected),
        int(model.root.get("numberOfEventIndicators", 0))
        if selected == "model-exchange" and model.major < 3
        else 0,
        _needs_completed_step(model.major, attributes),
        list_platforms(examination.members),
        [name for name in model.log_categories if name in _ERROR_CATEGORIES],
        _read_dependencies(model, "Output"),
        _read_dependencies(model, "Output") | _read_dependencies(model, "InitialUnknown"),
        any(
            attributes.get(name) in _TRUE
            for name in ("providesDirectionalDerivative", "providesDirectionalDerivatives")
        ),
        _read_continuous_states(model),
        selected == "model-exchange"
        or (model.major < 3 and attributes.get("canInterpolateInputs") in _TRUE),
        selected == "co-simulation"
        and _is_set("maxOutputDerivativeOrder", attributes.get("maxOutputDerivativeOrder", "")),
        selected == "co-simulation" and attributes.get("hasEventMode") in _TRUE,
        selected == "co-simulation" and attributes.get("mightReturnEarlyFromDoStep") in _TRUE,
        {
            name: _read_sizes(model, source)
            for source in model.variables
            for name in _names_with_aliases(source)
        },
    )


def _read_sizes(model: ModelDescription, source: ModelVariable) -> Sequence[int | str]:
    """Return the sizes of the dimensions, or the names of the structural parameters.

    Empty if no parameter changes them.
    """
    references = [dimension.get("valueReference") for dimension in source.dimensions]
    if not any(references):
        return ()
    named = [model.by_reference[text.strip()].name if text else None for text in references]
    return tuple(
        name or dimension_size(model, size) or 0
        for name, size in zip(named, source.dimensions, strict=True)
    )


def _read_dependencies(model: ModelDescription, element: str) -> dict[str, frozenset[str]]:
    """Return the inputs on which each output depends, by name with aliases, from the elements that declare them."""
    inputs = {
        reference: _names_with_aliases(variable)
        for reference, variable in model.by_reference.items()
        if variable.causality == "input"
    }
    return {
        name: frozenset(
            each for reference in unknown.dependencies for each in inputs.get(reference, ())
        )
        for unknown in model.model_structure
        if unknown.element == element
        and unknown.dependencies is not None
        and unknown.reference.strip() in model.by_reference
        for name in _names_with_aliases(model.by_reference[unknown.reference.strip()])
    }


def _read_continuous_states(model: ModelDescription) -> dict[str, str]:
    """Return the names of the derivatives by the names of their scalar states."""
    found = {}
    for unknown in model.model_structure:
        derivative = model.by_reference.get(unknown.reference.strip())
        if (
            unknown.element == "ContinuousStateDerivative"
            and derivative
            and not derivative.dimensions
        ):
            state = model.by_reference.get((derivative.attribute("derivative") or "").strip())
            if state and not state.dimensions:
                found[state.name] = derivative.name
    return found


def _is_set(name: str, value: str) -> bool:
    """Return whether an attribute is a capability flag that is true, or an order of derivatives above zero."""
    return value in _TRUE or (name.startswith("max") and value.strip().isdigit() and int(value) > 0)


def _build_unit(definition: UnitDefinition) -> Unit:
    base = definition.base_unit
    if base is None:
        return named_unit(
            definition.name
        )  # FMI does not define a unit without BaseUnit; its name usually does
    exponents = tuple(int(base.get(name, 0)) for name in BASE_UNITS)
    return Unit(
        definition.name, exponents, float(base.get("factor", 1)), float(base.get("offset", 0))
    )


def _names_with_aliases(source: ModelVariable) -> list[str]:
    return [source.name, *(alias["name"] for alias in source.aliases)]


def _build_variables(
    model: ModelDescription, source: ModelVariable, units: Mapping[str, Unit]
) -> list[Variable]:
    """Build a variable and its aliases."""
    is_c_int = (source.kind == "Enumeration" and model.major < 3) or (
        source.kind == "Boolean" and model.major == 2
    )
    descriptions = [
        source.attribute("description"),
        *(alias.get("description") for alias in source.aliases),
    ]
    return [
        Variable(
            name,
            source.kind,
            _CAUSALITIES[source.causality],
            _variability(source),
            _parse_start(source),
            _find_unit(source, units),
            tuple(dimension_size(model, dimension) or 0 for dimension in source.dimensions),
            description or descriptions[0] or "",
            *_finite_limits(source),
            _enumeration_items(source),
            source.attribute("relativeQuantity") in _TRUE,
            _C_INT if is_c_int else DTYPES[source.kind],
        )
        for name, description in zip(_names_with_aliases(source), descriptions, strict=True)
    ]


def _find_unit(source: ModelVariable, units: Mapping[str, Unit]) -> Unit | None:
    name = source.attribute("unit")
    return (units.get(name) or named_unit(name)) if name else None


def _parse_start(source: ModelVariable) -> Any:
    """Return the start value, a tuple in row-major order if there are several, or None."""
    if not source.start_words:
        return None
    is_text = source.kind in ("String", "Binary", "Clock")
    values = [word if is_text else parse_value(word, source.kind) for word in source.start_words]
    return values[0] if len(values) == 1 else tuple(values)


def _enumeration_items(source: ModelVariable) -> tuple[tuple[str, int], ...]:
    if source.kind != "Enumeration" or source.declared_type is None:
        return ()
    return tuple((name, int(text)) for name, text in source.declared_type.items)


def _variability(source: ModelVariable) -> Variability:
    """Return the variability; only floating-point variables can be continuous."""
    return _VARIABILITIES[
        source.variability if source.is_float or source.variability != "continuous" else "discrete"
    ]


def _finite_limits(source: ModelVariable) -> tuple[float | None, float | None]:
    """Return (min, max), None for each limit that is missing or invalid, and for both if min is above max."""
    texts = (
        None if source.kind == "Boolean" else source.attribute(name) for name in ("min", "max")
    )
    limits = [None if text is None else read_limit(text) for text in texts]
    low, high = (limit if limit is not None and math.isfinite(limit) else None for limit in limits)
    return (None, None) if low is not None and high is not None and low > high else (low, high)


def _build_default_experiment(experiment: Mapping[str, str]) -> DefaultExperiment:
    numbers = [
        None if (text := experiment.get(name)) is None else _parse_number(text)
        for name in _EXPERIMENT
    ]
    start, stop, step, tolerance = numbers
    positive_step = step if step and step > 0 else None
    return DefaultExperiment(
        start, stop, positive_step, float(tolerance) if tolerance and tolerance > 0 else None
    )


def _count_states(model: ModelDescription, interface: str) -> int:
    if model.major == 1:
        return (
            int(model.root.get("numberOfContinuousStates", 0))
            if interface == "model-exchange"
            else 0
        )
    return sum(unknown.element == "ContinuousStateDerivative" for unknown in model.model_structure)


def _needs_completed_step(major: int, attributes: Mapping[str, str]) -> bool:
    if major == 3:
        return attributes.get("needsCompletedIntegratorStep") in _TRUE
    return attributes.get("completedIntegratorStepNotNeeded") not in _TRUE


def _parse_number(text: str) -> Fraction | None:
    """Return an exact number, or None if the text is not a finite number."""
    with suppress(ValueError):
        return exact_fraction(text)
    return None
