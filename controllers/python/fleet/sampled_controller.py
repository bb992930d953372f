"""Base class of sampled controllers.

Declaration of variables with units, and ticks within a communication step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any, TypeVar
from xml.etree.ElementTree import Element

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

from . import SAMPLE_PERIOD

TIME_TOLERANCE = 1e-6  # rounding error of a time, in sample periods

BlockT = TypeVar("BlockT")


class RealWithUnit(Real):
    """Real variable with a unit."""

    def __init__(self, name: str, unit: str, **attributes: Any):
        super().__init__(name, **attributes)
        self.unit = unit

    def to_xml(self) -> Element:
        """Return the element of the model description, with the attribute `unit`."""
        element: Element = super().to_xml()
        if self.unit:
            element[0].set("unit", self.unit)
        return element


class SampledController(Fmi2Slave):
    """PythonFMU class whose `tick` runs at every multiple of `SAMPLE_PERIOD` within a step.

    It uses the inputs of that step. Constructors declare variables by dotted names:
    `self.input("vehicle.position.z", 0.0, "m")` declares the variable and creates the attribute
    `self.vehicle.position.z`. The start value defines the type; a list declares name[1], name[2],
    ... All states must be declared, as local variables, because saved states consist of the
    declared variables.
    """

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.local("ticks", 0, description="Ticks since time 0")

    def tick(self, time: float) -> None:
        """Compute the outputs at `time` (s)."""
        raise NotImplementedError

    def setup_experiment(
        self, start_time: float, stop_time: float | None, tolerance: float | None
    ) -> None:
        """Set the number of the first tick at or after `start_time` (s)."""
        self.ticks = max(0, math.ceil(start_time / SAMPLE_PERIOD - TIME_TOLERANCE))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Run all ticks from `current_time` (s) up to, but not at, the end of the step."""
        end = current_time + step_size - TIME_TOLERANCE * SAMPLE_PERIOD
        while (time := self.ticks * SAMPLE_PERIOD) < end:
            self.tick(time)
            self.ticks += 1
        return True

    def parameter(self, name: str, start: Any, unit: str = "", description: str = "") -> None:
        """Declare a tunable parameter."""
        self._declare(
            name,
            start,
            unit,
            description,
            causality=Fmi2Causality.parameter,
            variability=Fmi2Variability.tunable,
        )

    def calculated_parameter(
        self, name: str, getter: Callable[[], float], unit: str = "", description: str = ""
    ) -> None:
        """Declare a calculated parameter; it has no attribute."""
        kind = {
            "causality": Fmi2Causality.calculatedParameter,
            "variability": Fmi2Variability.tunable,
        }
        self.register_variable(
            RealWithUnit(name, unit, getter=getter, description=description, **kind)
        )

    def input(self, name: str, start: Any, unit: str = "", description: str = "") -> None:
        """Declare an input."""
        self._declare(name, start, unit, description, causality=Fmi2Causality.input)

    def output(self, name: str, start: Any, unit: str = "", description: str = "") -> None:
        """Declare a discrete output."""
        self._declare(
            name,
            start,
            unit,
            description,
            causality=Fmi2Causality.output,
            variability=Fmi2Variability.discrete,
        )

    def local(self, name: str, start: Any, unit: str = "", description: str = "") -> None:
        """Declare a discrete local variable, for a state."""
        self._declare(
            name,
            start,
            unit,
            description,
            causality=Fmi2Causality.local,
            variability=Fmi2Variability.discrete,
        )

    def add_block(self, name: str, block: BlockT) -> BlockT:
        """Declare the attributes of a block, its states, as local variables below `name`.

        Return the block.
        """
        setattr(self, name, block)
        for state, start in list(vars(block).items()):
            self.local(f"{name}.{state}", start)
        return block

    def _declare(
        self, name: str, start: Any, unit: str, description: str, **attributes: Any
    ) -> None:
        setattr(self._create_owner(name), name.rpartition(".")[2], start)
        attributes["description"] = description or None
        if not isinstance(start, list):
            self.register_variable(_create_variable(name, start, unit, **attributes))
            return
        for i, element in enumerate(start):
            access = {
                "getter": partial(start.__getitem__, i),
                "setter": partial(start.__setitem__, i),
            }
            self.register_variable(
                _create_variable(f"{name}[{i + 1}]", element, unit, **access, **attributes),
                nested=False,
            )

    def _create_owner(self, name: str) -> Any:
        """Return the object that has the attribute of a dotted name; create it if necessary."""
        owner: Any = self
        for part in name.split(".")[:-1]:
            if not hasattr(owner, part):
                setattr(owner, part, SimpleNamespace())
            owner = getattr(owner, part)
        return owner


def _create_variable(
    name: str, start: Any, unit: str, **attributes: Any
) -> Boolean | Integer | RealWithUnit:
    if isinstance(start, bool):
        return Boolean(name, **attributes)
    return (
        Integer(name, **attributes)
        if isinstance(start, int)
        else RealWithUnit(name, unit, **attributes)
    )
