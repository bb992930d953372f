"""Model description of an FMU as the importer uses it.

Variables with units and shapes, and capabilities.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, cast

import numpy as np

from ...core.component import DTYPES, Causality, Variability, Variable
from ...core.size_limits import require_at_most
from ...core.time_grid import exact_fraction
from ...core.units import BASE_UNITS, Unit, named_unit
from .preflight.model_description import (
    Interface,
    ModelDescription,
    ModelVariable,
    UnitDefinition,
    is_true,
    parse_value,
)
from .preflight.rules_variables import MAX_ARRAY_SIZE, dimension_size, read_limit

#: types and FMI major versions whose values are C int
_STORED_AS_C_INT = {("Enumeration", 1), ("Enumeration", 2), ("Boolean", 2)}
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

    def with_structural_parameters(self, values: Mapping[str, int]) -> FmuDescription:
        """Return the description for other values of structural parameters.

        They change the shapes of arrays. An array that changes its size loses its start value.

        Args:
            values: Positive values of structural parameters by name.

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
            dimensions = self.dimensions.get(variable.name, ())
            shape = tuple(sizes[n] if isinstance(n, str) else n for n in dimensions)
            if shape and shape != variable.shape:
                count, what = math.prod(shape), f'elements of "{variable.name}"'
                require_at_most(MAX_ARRAY_SIZE, count, what, "")
                variable = replace(variable, shape=shape, start=None)
            elif variable.name in values:
                variable = replace(variable, start=values[variable.name])
            variables.append(variable)
        return replace(self, variables=variables)


def build_description(
    model: ModelDescription, interface: Interface, platforms: Sequence[str]
) -> FmuDescription:
    """Build the description of an FMU without errors.

    Args:
        model: Its model description.
        interface: Interface through which the FMU is simulated, one of those that it has.
        platforms: Platforms with a binary, see `list_platforms`.
    """
    attributes, is_model_exchange = model.interfaces[interface], interface == "model-exchange"
    units = {unit.name: _build_unit(unit) for unit in model.units}
    variables: dict[str, Variable] = {}
    references: dict[str, int] = {}
    dimensions: dict[str, Sequence[int | str]] = {}
    negated = set()
    for source in model.variables:
        if source.attributes.get("alias") == "negatedAlias":
            negated.add(source.name)
        for variable in _build_variables(model, source, units):
            dimensions[variable.name] = _read_sizes(model, source)
            if variable.name not in variables:  # the first one of each name
                variables[variable.name] = variable
                references[variable.name] = int(source.attributes["valueReference"])
    indicator_count = 0
    if is_model_exchange and model.major < 3:
        indicator_count = int(model.root.get("numberOfEventIndicators", 0))
    dependencies = _read_dependencies(model, "Output")
    slope_order = attributes.get("maxOutputDerivativeOrder", "")
    return FmuDescription(
        model.root["fmiVersion"],
        model.root.get("modelName", ""),
        tuple(model.interfaces),
        interface,
        attributes["modelIdentifier"],
        model.root["instantiationToken" if model.major == 3 else "guid"],
        model.root.get("description", ""),
        model.root.get("generationTool", ""),
        list(variables.values()),
        references,
        frozenset(negated),
        _build_default_experiment(model.default_experiment),
        [name for name, value in attributes.items() if _is_set(name, value)],
        is_true(attributes, "canGetAndSetFMUstate", "canGetAndSetFMUState"),
        is_model_exchange or is_true(attributes, "canHandleVariableCommunicationStepSize"),
        is_true(attributes, "canBeInstantiatedOnlyOncePerProcess"),
        is_true(attributes, "needsExecutionTool"),
        _count_states(model, interface),
        indicator_count,
        is_true(attributes, "needsCompletedIntegratorStep")
        if model.major == 3
        else not is_true(attributes, "completedIntegratorStepNotNeeded"),
        platforms,
        [name for name in model.log_categories if name in _ERROR_CATEGORIES],
        dependencies,
        dependencies | _read_dependencies(model, "InitialUnknown"),
        is_true(attributes, "providesDirectionalDerivative", "providesDirectionalDerivatives"),
        _read_continuous_states(model),
        is_model_exchange or (model.major < 3 and is_true(attributes, "canInterpolateInputs")),
        not is_model_exchange and _is_set("maxOutputDerivativeOrder", slope_order),
        not is_model_exchange and is_true(attributes, "hasEventMode"),
        not is_model_exchange and is_true(attributes, "mightReturnEarlyFromDoStep"),
        dimensions,
    )


def _read_sizes(model: ModelDescription, source: ModelVariable) -> Sequence[int | str]:
    """Return the sizes of the dimensions, or the names of the structural parameters.

    Empty if no parameter changes them.
    """
    sizes: list[int | str] = []
    for dimension in source.dimensions:
        reference = dimension.get("valueReference")
        if reference:
            sizes.append(model.by_reference[reference.strip()].name)
        else:
            sizes.append(dimension_size(model, dimension) or 0)
    return sizes if any(isinstance(size, str) for size in sizes) else ()


def _read_dependencies(model: ModelDescription, element: str) -> dict[str, frozenset[str]]:
    """Return the inputs on which each output depends, as one kind of elements declares them.

    All names include the aliases.
    """
    found: dict[str, frozenset[str]] = {}
    for unknown in model.model_structure:
        variable = model.by_reference.get(unknown.reference.strip())
        if unknown.element != element or unknown.dependencies is None or variable is None:
            continue
        inputs: set[str] = set()
        for reference in unknown.dependencies:
            source = model.by_reference.get(reference)
            if source and source.causality == "input":
                inputs.update(_names_with_aliases(source))
        found |= dict.fromkeys(_names_with_aliases(variable), frozenset(inputs))
    return found


def _read_continuous_states(model: ModelDescription) -> dict[str, str]:
    """Return the names of the derivatives by the names of their scalar states."""
    found = {}
    for unknown in model.model_structure:
        derivative = model.by_reference.get(unknown.reference.strip())
        if unknown.element != "ContinuousStateDerivative" or not derivative:
            continue
        state = model.by_reference.get((derivative.attribute("derivative") or "").strip())
        if state and not (state.dimensions or derivative.dimensions):
            found[state.name] = derivative.name
    return found


def _is_set(name: str, value: str) -> bool:
    """Return whether an attribute is a flag that is true, or an order of derivatives above zero."""
    is_order = name.startswith("max") and value.strip().isdigit() and int(value) > 0
    return is_order or is_true({name: value}, name)


def _build_unit(definition: UnitDefinition) -> Unit:
    base = definition.base_unit
    if base is None:
        # FMI does not define a unit without BaseUnit; its name usually does
        return named_unit(definition.name)
    exponents = tuple(int(base.get(name, 0)) for name in BASE_UNITS)
    factor, offset = float(base.get("factor", 1)), float(base.get("offset", 0))
    return Unit(definition.name, exponents, factor, offset)


def _names_with_aliases(source: ModelVariable) -> list[str]:
    return [source.name, *(alias["name"] for alias in source.aliases)]


def _build_variables(
    model: ModelDescription, source: ModelVariable, units: Mapping[str, Unit]
) -> list[Variable]:
    """Build a variable and its aliases."""
    kind, unit = source.kind, source.attribute("unit")
    dtype = DTYPES[kind]
    items: tuple[tuple[str, int], ...] = ()
    if (kind, model.major) in _STORED_AS_C_INT:
        dtype = np.dtype(np.int32)
    if kind == "Enumeration" and source.declared_type:
        items = tuple((name, int(text)) for name, text in source.declared_type.items)
    # only floating-point variables can be continuous
    is_discrete = source.variability == "continuous" and not source.is_float
    variable = Variable(
        source.name,
        kind,
        cast(Causality, source.causality),
        "discrete" if is_discrete else cast(Variability, source.variability),
        _parse_start(source),
        (units.get(unit) or named_unit(unit)) if unit else None,
        tuple(dimension_size(model, dimension) or 0 for dimension in source.dimensions),
        source.attribute("description") or "",
        *_finite_limits(source),
        items,
        source.attribute("relativeQuantity") in ("true", "1"),
        dtype,
    )
    variables = [variable]
    for alias in source.aliases:
        text = alias.get("description") or variable.description
        variables.append(replace(variable, name=alias["name"], description=text))
    return variables


def _parse_start(source: ModelVariable) -> Any:
    """Return the start value, a tuple in row-major order if there are several, or None."""
    if not source.start_words:
        return None
    values: Sequence[Any] = source.start_words
    if source.kind not in ("String", "Binary", "Clock"):
        values = [parse_value(word, source.kind) for word in values]
    return values[0] if len(values) == 1 else tuple(values)


def _finite_limits(source: ModelVariable) -> tuple[float | None, float | None]:
    """Return (min, max).

    None for each limit that is missing or invalid, and for both if min is above max.
    """
    limits: list[float | None] = []
    for name in ("min", "max"):
        text = None if source.kind == "Boolean" else source.attribute(name)
        limit = None if text is None else read_limit(text)
        limits.append(limit if limit is not None and math.isfinite(limit) else None)
    low, high = limits
    return (None, None) if low is not None and high is not None and low > high else (low, high)


def _build_default_experiment(experiment: Mapping[str, str]) -> DefaultExperiment:
    numbers: dict[str, Fraction] = {}
    for name, text in experiment.items():
        with suppress(ValueError):  # not a finite number
            numbers[name] = exact_fraction(text)
    step, tolerance = numbers.get("stepSize"), numbers.get("tolerance")
    return DefaultExperiment(
        numbers.get("startTime"),
        numbers.get("stopTime"),
        step if step and step > 0 else None,
        float(tolerance) if tolerance and tolerance > 0 else None,
    )


def _count_states(model: ModelDescription, interface: str) -> int:
    if model.major > 1:
        elements = [unknown.element for unknown in model.model_structure]
        return elements.count("ContinuousStateDerivative")
    is_declared = interface == "model-exchange"
    return int(model.root.get("numberOfContinuousStates", 0)) if is_declared else 0
