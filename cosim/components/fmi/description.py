"""Model description of an FMU as the importer uses it: variables with units and shapes, and capabilities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ...core.component import DTYPES, Causality, Variability, Variable
from ...core.time_grid import exact_fraction
from ...core.units import BASE_UNITS, Unit, named_unit
from .preflight import DEFAULT_LIMITS, Examination, PreflightLimits, examine, raise_errors
from .preflight.binary import list_platforms
from .preflight.model_description import ModelDescription, ModelVariable, UnitDefinition
from .preflight.rules_values import dimension_size, read_limit
from .preflight.values import parse_value

#: valid causalities and variabilities by name, to convert text to their literal types
_CAUSALITIES: Mapping[str, Causality] = {name: name for name in get_args(Causality)}
_VARIABILITIES: Mapping[str, Variability] = {name: name for name in get_args(Variability)}
_C_INT = np.dtype(np.int32)
_TRUE = ("true", "1")
#: standard names of the log categories of errors (FMI 2.0 section 2.2.4, FMI 3.0 section 2.4.5)
_ERROR_CATEGORIES = ("logStatusError", "logStatusFatal")


@dataclass(frozen=True)
class DefaultExperiment:
    """Default experiment of an FMU: exact times (s), None where an attribute is missing."""

    start_time: Fraction | None = None
    stop_time: Fraction | None = None
    step_size: Fraction | None = None


@dataclass(frozen=True)
class FmuDescription:
    """Model description of an FMU.

    Attributes:
        fmi_version: `fmiVersion`, such as "2.0".
        model_name: `modelName`.
        model_identifier: `modelIdentifier` of the Co-Simulation interface.
        instantiation_token: `instantiationToken` of FMI 3.0, `guid` of FMI 2.0.
        description: `description`.
        generation_tool: `generationTool`.
        variables: All variables, including the aliases of FMI 3.0.
        value_references: Value references by variable name, including aliases.
        default_experiment: `DefaultExperiment`.
        has_state: `canGetAndSetFMUState`.
        once_per_process: `canBeInstantiatedOnlyOncePerProcess`.
        needs_execution_tool: `needsExecutionTool`.
        platforms: Platforms with a binary, as the FMU names their folders, and "c-code" if it contains sources.
        error_categories: Those of FMI's log categories of errors that the FMU declares.
    """

    fmi_version: str
    model_name: str
    model_identifier: str
    instantiation_token: str
    description: str
    generation_tool: str
    variables: Sequence[Variable]
    value_references: Mapping[str, int]
    default_experiment: DefaultExperiment
    has_state: bool
    once_per_process: bool
    needs_execution_tool: bool
    platforms: Sequence[str]
    error_categories: Sequence[str]

    @property
    def major(self) -> int:
        """FMI major version, 2 or 3."""
        return int(self.fmi_version.split(".")[0])


def read_description(path: Path, limits: PreflightLimits = DEFAULT_LIMITS) -> FmuDescription:
    """Check an FMU and read its model description, without extracting anything.

    The FMU needs no binary for this platform.

    Args:
        path: The FMU.
        limits: Limits of the preflight check.

    Raises:
        InputError: The file is missing, is not a valid or safe FMU, or has no Co-Simulation interface of FMI 2.0 or 3.0.
    """
    return build_description(path, examine(path, limits))


def build_description(path: Path, examination: Examination) -> FmuDescription:
    """Build the description of an examined FMU.

    Args:
        path: The FMU, for messages.
        examination: Result of the preflight check.

    Raises:
        InputError: The examination found errors.
    """
    raise_errors(path, examination.findings)
    model = examination.model
    assert model is not None  # otherwise the examination has found an error
    assert model.co_simulation is not None
    units = {unit.name: _build_unit(unit) for unit in model.units}
    variables = [variable for source in model.variables for variable in _build_variables(model, source, units)]
    return FmuDescription(
        model.root["fmiVersion"],
        model.root.get("modelName", ""),
        model.co_simulation["modelIdentifier"],
        model.root["guid" if model.major == 2 else "instantiationToken"],
        model.root.get("description", ""),
        model.root.get("generationTool", ""),
        variables,
        {name: int(source.attributes["valueReference"]) for source in model.variables for name in _names_with_aliases(source)},
        _build_default_experiment(model.default_experiment),
        any(model.co_simulation.get(name) in _TRUE for name in ("canGetAndSetFMUstate", "canGetAndSetFMUState")),
        model.co_simulation.get("canBeInstantiatedOnlyOncePerProcess") in _TRUE,
        model.co_simulation.get("needsExecutionTool") in _TRUE,
        list_platforms(examination.members),
        [name for name in model.log_categories if name in _ERROR_CATEGORIES],
    )


def _build_unit(definition: UnitDefinition) -> Unit:
    base = definition.base_unit
    if base is None:
        return named_unit(definition.name)  # FMI does not define a unit without BaseUnit; its name usually does
    exponents = tuple(int(base.get(name, 0)) for name in BASE_UNITS)
    return Unit(definition.name, exponents, float(base.get("factor", 1)), float(base.get("offset", 0)))


def _names_with_aliases(source: ModelVariable) -> list[str]:
    return [source.name, *(alias["name"] for alias in source.aliases)]


def _build_variables(model: ModelDescription, source: ModelVariable, units: Mapping[str, Unit]) -> list[Variable]:
    """Build a variable and its aliases."""
    is_c_int = model.major == 2 and source.kind in ("Boolean", "Enumeration")
    descriptions = [source.attribute("description"), *(alias.get("description") for alias in source.aliases)]
    return [
        Variable(
            name,
            source.kind,
            _CAUSALITIES[source.causality],
            _VARIABILITIES[source.variability],
            _parse_start(source),
            _find_unit(source, units),
            tuple(dimension_size(model, dimension) or 0 for dimension in source.dimensions),
            description or descriptions[0] or "",
            _finite_limit(source, "min"),
            _finite_limit(source, "max"),
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


def _finite_limit(source: ModelVariable, name: str) -> float | None:
    text = source.attribute(name)
    limit = None if text is None or source.kind == "Boolean" else read_limit(text)
    return limit if limit is not None and math.isfinite(limit) else None


def _build_default_experiment(experiment: Mapping[str, str]) -> DefaultExperiment:
    times = (experiment.get(name) for name in ("startTime", "stopTime", "stepSize"))
    return DefaultExperiment(*(None if time is None else _parse_time(time) for time in times))


def _parse_time(text: str) -> Fraction | None:
    """Return an exact time (s), or None if the text is not a finite number."""
    with suppress(ValueError):
        return exact_fraction(text)
    return None
