"""The model description of an FMU in cosim's own terms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from ...core.component import Variable
from ...core.time_grid import exact_fraction
from ...core.units import BASE_UNITS, Unit, parse_unit
from .preflight import DEFAULT_LIMITS, Examination, PreflightLimits, examine, raise_errors
from .preflight.binary import list_platforms
from .preflight.model_description import ModelDescription, ModelVariable, UnitDefinition
from .preflight.rules_values import dimension_size, read_limit
from .preflight.values import parse_value

_C_INT = np.dtype(np.int32)
_TRUE = ("true", "1")


@dataclass(frozen=True)
class DefaultExperiment:
    """What the FMU proposes for a simulation (s, exact); None where it proposes nothing."""

    start_time: Fraction | None = None
    stop_time: Fraction | None = None
    step_size: Fraction | None = None


@dataclass(frozen=True)
class FmuDescription:
    """What an FMU says about itself. `references` maps variable names to value references."""

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

    @property
    def major(self) -> int:
        return int(self.fmi_version.split(".")[0])


def read_description(path: Path, limits: PreflightLimits = DEFAULT_LIMITS) -> FmuDescription:
    """Read an FMU's description after the FMU was examined; nothing is extracted.

    Raises InputError with everything that is wrong when the file is no FMU, no safe one, or none that offers FMI 2.0 or
    3.0 Co-Simulation. Whether it has a binary for this machine does not matter here.
    """
    return build_description(path, examine(path, limits))


def build_description(path: Path, examination: Examination) -> FmuDescription:
    """The description of an FMU that was examined. Raises InputError with the errors that were found."""
    raise_errors(path, examination.findings)
    model = examination.model
    assert model is not None and model.co_simulation is not None  # anything else is an error that was found
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
    )


def _build_unit(definition: UnitDefinition) -> Unit | None:
    base = definition.base_unit
    if base is None:
        with suppress(ValueError):  # FMI leaves open what it means; as a rule what its name says
            return parse_unit(definition.name)
        return None
    exponents = tuple(int(base.get(name, 0)) for name in BASE_UNITS)
    return Unit(definition.name, exponents, float(base.get("factor", 1)), float(base.get("offset", 0)))


def _names_with_aliases(source: ModelVariable) -> list[str]:
    return [source.name, *(alias["name"] for alias in source.aliases)]


def _build_variables(model: ModelDescription, source: ModelVariable, units: Mapping[str, Unit | None]) -> list[Variable]:
    """The variable and its aliases."""
    as_c_int = model.major == 2 and source.kind in ("Boolean", "Enumeration")
    texts = [source.attribute("description"), *(alias.get("description") for alias in source.aliases)]
    return [
        Variable(
            name,
            source.kind,
            source.causality,  # type: ignore[arg-type]
            source.variability,  # type: ignore[arg-type]
            _parse_start(source),
            units.get(source.attribute("unit") or ""),
            tuple(dimension_size(model, dimension) or 0 for dimension in source.dimensions),
            text or texts[0] or "",
            _finite_limit(source, "min"),
            _finite_limit(source, "max"),
            _enumeration_items(source),
            source.attribute("relativeQuantity") in _TRUE,
            _C_INT if as_c_int else None,  # type: ignore[arg-type]
        )
        for name, text in zip(_names_with_aliases(source), texts, strict=True)
    ]


def _parse_start(source: ModelVariable) -> Any:
    """One value, or a tuple of them in row-major order."""
    if not source.start_words:
        return None
    texts = source.kind in ("String", "Binary", "Clock")
    values = [word if texts else parse_value(word, source.kind) for word in source.start_words]
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
    """A time that can be simulated."""
    with suppress(ValueError):
        return exact_fraction(text)
    return None
