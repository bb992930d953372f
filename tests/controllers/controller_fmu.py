"""One instance of a controller FMU, one tick at a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fmpy import read_model_description
from fmpy.fmi2 import FMU2Slave

PERIOD = 0.01
PYTHON_TYPES = {"Real": float, "Integer": int, "Enumeration": int, "Boolean": bool}


class ControllerFmu:
    """The FMU unpacked to `folder`: `step` runs the tick at the present time on the given inputs and returns all outputs."""

    def __init__(self, folder: str, parameters: Mapping[str, Any]):
        description = read_model_description(folder)
        self.time, self.variables = 0.0, {v.name: v for v in description.modelVariables}
        self.inputs = [v.name for v in description.modelVariables if v.causality == "input"]
        self.outputs = [v for v in description.modelVariables if v.causality == "output"]
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
        for name, value in values.items():
            if isinstance(value, list):
                self.set({f"{name}[{i}]": v for i, v in enumerate(value, 1)})
            else:
                self._call("set", self.variables[name], [PYTHON_TYPES[self.variables[name].type](value)])

    def get(self, name: str) -> Any:
        return PYTHON_TYPES[self.variables[name].type](self._call("get", self.variables[name])[0])

    def step(self, inputs: Mapping[str, Any]) -> dict[str, Any]:
        self.set(inputs)
        self.fmu.doStep(self.time, PERIOD)
        self.time += PERIOD
        return {v.name: self.get(v.name) for v in self.outputs}

    def close(self) -> None:
        self.fmu.freeInstance()

    def _call(self, verb: str, variable: Any, *values: list[Any]) -> list[Any]:
        kind = "Integer" if variable.type == "Enumeration" else variable.type
        return getattr(self.fmu, verb + kind)([variable.valueReference], *values)
