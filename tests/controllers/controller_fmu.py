"""One instance of a controller FMU, one tick at a time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave

PERIOD = 0.01
PYTHON_TYPES = {"Real": float, "Integer": int, "Enumeration": int, "Boolean": bool}


class ControllerFmu:
    """The FMU unpacked to `folder`: `step` runs the tick at the present time on the given inputs
    and returns all outputs.
    """

    def __init__(self, folder: str, parameters: Mapping[str, Any]):
        description = read_model_description(folder)
        self.time, self.variables = 0.0, {v.name: v for v in description.modelVariables}
        self.inputs = [v.name for v in description.modelVariables if v.causality == "input"]
        self.outputs = by_kind(v for v in description.modelVariables if v.causality == "output")
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=description.modelName,
        )
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.set(parameters)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def set(self, values: Mapping[str, Any]) -> None:
        """Set variables by name; a list sets name[1], name[2], ..."""
        single = dict(elements(values))
        for kind, variables in by_kind(self.variables[name] for name in single).items():
            numbers = [PYTHON_TYPES[v.type](single[v.name]) for v in variables]
            getattr(self.fmu, f"set{kind}")([v.valueReference for v in variables], numbers)

    def get(self, name: str) -> Any:
        return self._read(by_kind([self.variables[name]]))[name]

    def step(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        self.set(inputs)
        self.fmu.doStep(self.time, PERIOD)
        self.time += PERIOD
        return self._read(self.outputs)

    def close(self) -> None:
        self.fmu.freeInstance()

    def _read(self, kinds: Mapping[str, list[Any]]) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for kind, variables in kinds.items():
            found = getattr(self.fmu, f"get{kind}")([v.valueReference for v in variables])
            values |= {
                v.name: PYTHON_TYPES[v.type](value)
                for v, value in zip(variables, found, strict=True)
            }
        return values


def by_kind(variables: Iterable[Any]) -> dict[str, list[Any]]:
    """Group variables by the word in the names of the functions that access them."""
    kinds: dict[str, list[Any]] = {}
    for variable in variables:
        kinds.setdefault("Integer" if variable.type == "Enumeration" else variable.type, []).append(
            variable
        )
    return kinds


def elements(values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield names and values with the elements of lists one by one."""
    for name, value in values.items():
        if isinstance(value, list):
            yield from ((f"{name}[{i}]", v) for i, v in enumerate(value, 1))
        else:
            yield name, value
