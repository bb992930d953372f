"""The model description of an FMU in cosim's own terms."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
from lxml import etree

from ..component import Variable
from ..errors import InputError
from ..timing import exact
from ..units import BASE, Unit

_FMI2_TYPES = {"Real": "Float64", "Integer": "Int32"}
_C_INT = np.dtype(np.int32)


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


def read_description(path: Path) -> Description:
    """Read an FMU's description without extracting it.

    Raises InputError when the file is no FMU, or none that offers FMI 2.0 or 3.0 Co-Simulation.
    """
    from fmpy import read_model_description, supported_platforms

    if not path.is_file():
        raise InputError(f'FMU "{path}" does not exist')
    fmi_version = _fmi_version(path)
    if fmi_version.partition(".")[0] not in ("2", "3"):
        raise InputError(f'"{path}" is an FMI {fmi_version} FMU; FMI 2.0 and 3.0 are supported')
    try:
        model = read_model_description(path, validate=False)
        platforms = supported_platforms(path)
    except Exception as error:
        raise InputError(f'the model description of "{path}" cannot be read: {error}') from error
    if model.coSimulation is None:
        raise InputError(f'"{path}" offers no Co-Simulation interface')
    if not model.instantiationToken:
        attribute = "guid" if model.fmiMajorVersion == 2 else "instantiationToken"
        raise InputError(f'the model description of "{path}" lacks the attribute {attribute}')
    return _description(path, model, platforms)


def _fmi_version(path: Path) -> str:
    """What the root element says. Raises InputError when the file is no FMU at all."""
    try:
        with ZipFile(path) as archive, archive.open("modelDescription.xml") as file:
            parser = etree.XMLParser(resolve_entities=False, no_network=True)
            root = etree.parse(file, parser).getroot()
    except (BadZipFile, KeyError) as error:
        raise InputError(f'"{path}" is no FMU: {error.args[0]}') from None
    except etree.XMLSyntaxError as error:
        raise InputError(f'the model description of "{path}" is no XML: {error.msg}') from None
    return root.get("fmiVersion") or "of unknown version"


def _description(path: Path, model: Any, platforms: Sequence[str]) -> Description:
    units = {unit.name: _unit(unit) for unit in model.unitDefinitions}
    try:
        variables = [_variable(variable, units, model.fmiMajorVersion) for variable in model.modelVariables]
        experiment = _experiment(model.defaultExperiment)
    except (ValueError, KeyError) as error:
        raise InputError(f'the model description of "{path}" is wrong: {error}') from None
    interface = model.coSimulation
    return Description(
        model.fmiVersion,
        model.modelName,
        interface.modelIdentifier,
        model.instantiationToken,
        model.description or "",
        model.generationTool or "",
        variables,
        {variable.name: variable.valueReference for variable in model.modelVariables},
        experiment,
        interface.canGetAndSetFMUstate,
        interface.canBeInstantiatedOnlyOncePerProcess,
        interface.needsExecutionTool,
        platforms,
    )


def _unit(definition: Any) -> Unit | None:
    base = definition.baseUnit
    if base is None:
        return None
    return Unit(definition.name, tuple(int(getattr(base, name)) for name in BASE), float(base.factor), float(base.offset))


def _variable(variable: Any, units: Mapping[str, Unit | None], major: int) -> Variable:
    kind = _FMI2_TYPES.get(variable.type, variable.type)
    declared = variable.declaredType
    unit = variable.unit or (declared.unit if declared else None)
    as_c_int = major == 2 and kind in ("Boolean", "Enumeration")
    return Variable(
        variable.name,
        kind,
        variable.causality or "local",
        variable.variability or ("continuous" if kind in ("Float64", "Float32") else "discrete"),
        _start(variable.start, kind, variable.name),
        units.get(unit) if unit else None,
        tuple(variable.shape or ()),
        variable.description or (declared.description if declared else None) or "",
        _limit(variable.min or (declared.min if declared else None)),
        _limit(variable.max or (declared.max if declared else None)),
        _C_INT if as_c_int else None,  # type: ignore[arg-type]
    )


def _start(text: str | None, kind: str, name: str) -> Any:
    if text is None or kind in ("String", "Binary"):
        return text
    try:
        values = [_number(word, kind) for word in text.split()]
    except (ValueError, KeyError):
        raise ValueError(f'start value "{text}" of variable "{name}" is no {kind}') from None
    return values[0] if len(values) == 1 else tuple(values)


def _number(word: str, kind: str) -> float | int | bool:
    if kind == "Boolean":
        return {"true": True, "1": True, "false": False, "0": False}[word]
    return float(word) if kind.startswith("Float") else int(word)


def _limit(text: str | None) -> float | None:
    if text is None:
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def _experiment(experiment: Any) -> DefaultExperiment:
    if experiment is None:
        return DefaultExperiment()
    times = (experiment.startTime, experiment.stopTime, experiment.stepSize)
    return DefaultExperiment(*(None if time is None else exact(str(time)) for time in times))
