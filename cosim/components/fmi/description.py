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
from ...core.time_grid import exact
from ...core.units import BASE, Unit, parse
from .preflight import LIMITS, Examination, Limits, examine, refuse
from .preflight.binary import platforms
from .preflight.model_description import Model, ModelVariable, UnitDefinition
from .preflight.rules_values import dimension_size, read_limit
from .preflight.values import value

_C_INT = np.dtype(np.int32)
_TRUE = ("true", "1")


@dataclass(frozen=True)
class DefaultExperiment:
    """What the FMU proposes for a simulation (s, exact); None where it proposes nothing."""

    start_time: Fraction | None = None
    stop_time: Fraction | None = None
    step_size: Fraction | None = None


@dataclass(frozen=True)
class Description:
    """What an FMU says about itself. `references` maps variable names to value references."""

    fmi_version: str
    model_name: str
    identifier: str
    token: str
    description: str
    generation_tool: str
    variables: Sequence[Variable]
    references: Mapping[str, int]
    default_experiment: DefaultExperiment
    has_state: bool
    only_once_per_process: bool
    needs_execution_tool: bool
    platforms: Sequence[str]

    @property
    def major(self) -> int:
        return int(self.fmi_version.split(".")[0])


def read_description(path: Path, limits: Limits = LIMITS) -> Description:
    """Read an FMU's description after the FMU was examined; nothing is extracted.

    Raises InputError with everything that is wrong when the file is no FMU, no safe one, or none that offers FMI 2.0 or
    3.0 Co-Simulation. Whether it has a binary for this machine does not matter here.
    """
    return describe(path, examine(path, limits))


def describe(path: Path, examination: Examination) -> Description:
    """The description of an FMU that was examined. Raises InputError with the errors that were found."""
    refuse(path, examination.findings)
    model = examination.model
    assert model is not None and model.interface is not None  # anything else is an error that was found
    units = {unit.name: _unit(unit) for unit in model.units}
    variables = [variable for source in model.variables for variable in _variables(model, source, units)]
    return Description(
        model.root["fmiVersion"],
        model.root.get("modelName", ""),
        model.interface["modelIdentifier"],
        model.root["guid" if model.major == 2 else "instantiationToken"],
        model.root.get("description", ""),
        model.root.get("generationTool", ""),
        variables,
        {name: int(source.attributes["valueReference"]) for source in model.variables for name in _names(source)},
        _experiment(model.experiment),
        any(model.interface.get(name) in _TRUE for name in ("canGetAndSetFMUstate", "canGetAndSetFMUState")),
        model.interface.get("canBeInstantiatedOnlyOncePerProcess") in _TRUE,
        model.interface.get("needsExecutionTool") in _TRUE,
        platforms(examination.members),
    )


def _unit(definition: UnitDefinition) -> Unit | None:
    base = definition.base
    if base is None:
        with suppress(ValueError):  # FMI leaves open what it means; as a rule what its name says
            return parse(definition.name)
        return None
    exponents = tuple(int(base.get(name, 0)) for name in BASE)
    return Unit(definition.name, exponents, float(base.get("factor", 1)), float(base.get("offset", 0)))


def _names(source: ModelVariable) -> list[str]:
    return [source.name, *(alias["name"] for alias in source.aliases)]


def _variables(model: Model, source: ModelVariable, units: Mapping[str, Unit | None]) -> list[Variable]:
    """The variable and its aliases."""
    as_c_int = model.major == 2 and source.kind in ("Boolean", "Enumeration")
    texts = [source.attribute("description"), *(alias.get("description") for alias in source.aliases)]
    return [
        Variable(
            name,
            source.kind,
            source.causality,  # type: ignore[arg-type]
            source.variability,  # type: ignore[arg-type]
            _start(source),
            units.get(source.attribute("unit") or ""),
            tuple(dimension_size(model, dimension) or 0 for dimension in source.dimensions),
            text or texts[0] or "",
            _limit(source, "min"),
            _limit(source, "max"),
            _items(source),
            source.attribute("relativeQuantity") in _TRUE,
            _C_INT if as_c_int else None,  # type: ignore[arg-type]
        )
        for name, text in zip(_names(source), texts, strict=True)
    ]


def _start(source: ModelVariable) -> Any:
    """One value, or a tuple of them in row-major order."""
    if not source.starts:
        return None
    texts = source.kind in ("String", "Binary", "Clock")
    values = [word if texts else value(word, source.kind) for word in source.starts]
    return values[0] if len(values) == 1 else tuple(values)


def _items(source: ModelVariable) -> tuple[tuple[str, int], ...]:
    if source.kind != "Enumeration" or source.declared is None:
        return ()
    return tuple((name, int(text)) for name, text in source.declared.items)


def _limit(source: ModelVariable, name: str) -> float | None:
    text = source.attribute(name)
    limit = None if text is None or source.kind == "Boolean" else read_limit(text)
    return limit if limit is not None and math.isfinite(limit) else None


def _experiment(experiment: Mapping[str, str]) -> DefaultExperiment:
    times = (experiment.get(name) for name in ("startTime", "stopTime", "stepSize"))
    return DefaultExperiment(*(None if time is None else _seconds(time) for time in times))


def _seconds(text: str) -> Fraction | None:
    """A time that can be simulated."""
    with suppress(ValueError):
        return exact(text)
    return None
