"""Plain FMI loops with FMPy's calls: what an importer must equal to the last bit."""

from __future__ import annotations

import math
import shutil
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, fmi1, fmi2, fmi3, read_model_description

_CLASSES = {
    ("1", "co-simulation"): fmi1.FMU1Slave,
    ("1", "model-exchange"): fmi1.FMU1Model,
    ("2", "co-simulation"): fmi2.FMU2Slave,
    ("2", "model-exchange"): fmi2.FMU2Model,
    ("3", "co-simulation"): fmi3.FMU3Slave,
    ("3", "model-exchange"): fmi3.FMU3Model,
}


def plain_loop(
    path: Path, interface: str, times: Sequence[float], step: float, names: Sequence[str]
) -> dict[str, np.ndarray]:
    """Simulate an FMU by Co-Simulation, or by Model Exchange with Euler's method.

    Args:
        path: The FMU.
        interface: "co-simulation" or "model-exchange".
        times: Times of the rows (s), at equal distances.
        step: Step size of Euler's method (s).
        names: Names of scalar outputs.

    Returns:
        Values by name; shorter than `times` if the FMU ends the simulation.
    """
    description = read_model_description(str(path), validate=False)
    folder = extract(str(path))
    kind = description.coSimulation if interface == "co-simulation" else description.modelExchange
    version = description.fmiVersion[0]
    fmu = _CLASSES[version, interface](
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=kind.modelIdentifier,
        instanceName="plain",
    )
    variables = {v.name: v for v in description.modelVariables}
    fmu.instantiate()
    rows: list[list[Any]] = []

    def record() -> None:
        rows.append([_get(fmu, version, variables[name]) for name in names])

    distance = times[1] - times[0]
    if interface == "co-simulation":
        _initialize_slave(fmu, version, times)
        record()
        for time in times[:-1]:
            try:
                fmu.doStep(
                    currentCommunicationPoint=time, communicationStepSize=round(distance, 12)
                )
            except fmi1.FMICallException as error:
                if error.status != 2:  # discard: the FMU ends the simulation
                    raise
                record()
                break
            record()
    else:
        model = _Model(fmu, version, description, times)
        record()
        substeps = math.ceil(round(distance / step, 9))
        for time, end in pairwise(times):
            for n in range(substeps):
                size = round(distance, 12) / substeps
                if not model.step(size, time + (n + 1) * size if n + 1 < substeps else end):
                    break
            record()
            if model.has_ended:
                break
    fmu.terminate()
    fmu.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)
    return {
        name: np.array(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)
    }


def _get(fmu: Any, version: str, variable: Any) -> Any:
    kind = variable.type
    if kind == "Enumeration":
        kind = "Int64" if version == "3" else "Integer"
    value = getattr(fmu, f"get{kind}")([variable.valueReference])[0]
    return value.decode() if isinstance(value, bytes) and kind == "String" else value


def _initialize_slave(fmu: Any, version: str, times: Sequence[float]) -> None:
    if version == "1":
        fmu.initialize(times[0], times[-1])
        return
    if version == "2":
        fmu.setupExperiment(startTime=times[0], stopTime=times[-1])
        fmu.enterInitializationMode()
    else:
        fmu.enterInitializationMode(startTime=times[0], stopTime=times[-1])
    fmu.exitInitializationMode()


class _Model:
    """Explicit Euler with events at the ends of steps."""

    def __init__(self, fmu: Any, version: str, description: Any, times: Sequence[float]):
        self.fmu, self.version, self.has_ended, self.next_event = fmu, version, False, math.inf
        if version == "1":
            fmu.setTime(times[0])
            fmu.initialize()
        else:
            _initialize_slave(fmu, version, times)
        self.states = description.numberOfContinuousStates
        self.indicators = description.numberOfEventIndicators
        if version == "3":
            self.states, self.indicators = (
                fmu.getNumberOfContinuousStates(),
                fmu.getNumberOfEventIndicators(),
            )
        self._update()
        self.signs = self._signs()

    def _update(self) -> None:
        again = True
        while again and not self.has_ended:
            if self.version == "1":
                converged, _, _, self.has_ended, has_next, time = self.fmu.eventUpdate()
                again = not converged
            else:
                update = (
                    self.fmu.newDiscreteStates
                    if self.version == "2"
                    else self.fmu.updateDiscreteStates
                )
                again, self.has_ended, _, _, has_next, time = update()
            self.next_event = time if has_next else math.inf
        if self.version != "1" and not self.has_ended:
            self.fmu.enterContinuousTimeMode()

    def _vector(self, name: str, count: int) -> np.ndarray:
        values = np.zeros(count)
        if count:
            getattr(self.fmu, name)(values.ctypes.data_as(_POINTER), count)
        return values

    def _signs(self) -> list[bool]:
        return [bool(value <= 0) for value in self._vector("getEventIndicators", self.indicators)]

    def step(self, size: float, end: float) -> bool:
        """Make one step to `end` (s); return whether the simulation goes on."""
        derivatives = self._vector(
            "getContinuousStateDerivatives" if self.version == "3" else "getDerivatives",
            self.states,
        )
        states = self._vector("getContinuousStates", self.states)
        self.fmu.setTime(end)
        if self.states:
            states = states + size * derivatives
            self.fmu.setContinuousStates(states.ctypes.data_as(_POINTER), self.states)
        signs = self._signs()
        done = self.fmu.completedIntegratorStep()
        step_event, ends = (bool(done), False) if self.version == "1" else map(bool, done)
        self.has_ended = ends
        if step_event or signs != self.signs or end >= self.next_event - 1e-9 * size:
            if self.version != "1":
                self.fmu.enterEventMode()
            self._update()
            signs = self._signs()
        self.signs = signs
        return not self.has_ended


_POINTER = fmi2.POINTER(fmi2.c_double)
