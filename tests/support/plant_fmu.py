"""Plant FMUs of the project (FMI 2.0), run by FMPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from cosim.core import resources


@cache
def unpack_fmu(name: str) -> str:
    return extract(str(resources.root() / "fmus" / f"{name}.fmu"))


class PlantFmu:
    """An initialized instance, accessed by variable names."""

    def __init__(self, name: str, start: Mapping[str, float]):
        folder = unpack_fmu(name)
        description = read_model_description(folder)
        self.references = {
            variable.name: variable.valueReference for variable in description.modelVariables
        }
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.set(start)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.time = 0.0

    def set(self, values: Mapping[str, float]) -> None:
        self.slave.setReal(
            [self.references[name] for name in values], [float(value) for value in values.values()]
        )

    def get(self, *names: str) -> np.ndarray:
        return np.array(self.slave.getReal([self.references[name] for name in names]))

    def vector(self, prefix: str, axes: Sequence[str] = "xyz") -> np.ndarray:
        return self.get(*(f"{prefix}.{axis}" for axis in axes))

    def step(self, size: float, count: int = 1) -> None:
        for _ in range(count):
            self.slave.doStep(self.time, size)
            self.time += size
