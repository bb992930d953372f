"""The world of one scenario as a PythonFMU class, for importers that support FMUs only.

`world_fmu.json` beside this file holds the arguments of the world, by default the plant of Demo 1.
To export another world, edit this file and run `cosim build plant_src/world_fmu.py --output
my_world.fmu`. The host requires Python with this project and PyBullet installed.
"""

import json
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

from cosim.core.component import Ports, Variable

from .variable_views import variable_views
from .world import World, WorldState

ARGUMENTS_FILE = "world_fmu.json"


class RealWithUnit(Real):
    """A Real variable with a unit.

    Args:
        name: Name of the variable.
        unit: Name of the unit, or "".
        **attributes: Further arguments of `pythonfmu.Real`.
    """

    def __init__(self, name: str, unit: str, **attributes: Any):
        super().__init__(name, **attributes)
        self.unit = unit

    def to_xml(self) -> Element:
        """Return the element of modelDescription.xml."""
        element: Element = super().to_xml()
        if self.unit:
            element[0].set("unit", self.unit)
        return element


class SavedState:
    """A state of the world with its bound values.

    The memory in Bullet is released together with this object.
    """

    def __init__(self, world: World, ports: list[np.ndarray]):
        self.state: WorldState = world.get_state()
        self.values = [array.copy() for array in ports]
        weakref.finalize(self, world.free_state, self.state)


class WorldFmu(Fmi2Slave):
    """The world as an FMI 2.0 slave.

    Its variables are those of `world.World`, arrays as scalars.
    """

    description = "Quadcopter and vessel in one PyBullet world"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        # the module may have been imported from the resources of an earlier instance, which no
        # longer exist
        folder = Path(self.resources or Path(__file__).parent)
        self._world = World(self.instance_name, **json.loads((folder / ARGUMENTS_FILE).read_text()))
        weakref.finalize(self, self._world.free)
        inputs, outputs = (self._ports(causality) for causality in ("input", "output"))
        for variable, values in variable_views(inputs.variables, inputs.arrays):
            values[:] = self._world.get(variable.name)
        self._world.bind(inputs, outputs)
        self._world.get_outputs()
        self._arrays = [*inputs.arrays.values(), *outputs.arrays.values()]
        self._start_time = 0.0
        for ports in (inputs, outputs):
            for variable, values in variable_views(ports.variables, ports.arrays):
                self._register(variable, values)

    def _ports(self, causality: str) -> Ports:
        """Return the variables of a causality with zeroed arrays."""
        variables = [
            variable for variable in self._world.variables if variable.causality == causality
        ]
        counts: dict[np.dtype[Any], int] = {}
        for variable in variables:
            counts[variable.dtype] = counts.get(variable.dtype, 0) + len(variable.scalar_names)
        return Ports(variables, {dtype: np.zeros(count, dtype) for dtype, count in counts.items()})

    def _register(self, variable: Variable, values: np.ndarray) -> None:
        """Register the scalars of a variable."""
        data: Any = values.data
        for index, name in enumerate(variable.scalar_names):
            attributes: dict[str, Any] = {
                "causality": Fmi2Causality[variable.causality],
                "description": variable.description,
                "getter": _create_getter(data, index),
                "setter": _create_setter(data, index),
            }
            if variable.type == "Boolean":
                scalar = Boolean(name, variability=Fmi2Variability.discrete, **attributes)
            else:
                scalar = RealWithUnit(
                    name, variable.unit.name if variable.unit else "", **attributes
                )
            self.register_variable(scalar, nested=False)

    def setup_experiment(
        self, start_time: float, _stop_time: float | None, _tolerance: float | None
    ) -> None:
        """Set the start time (s)."""
        self._start_time = start_time

    def enter_initialization_mode(self) -> None:
        """Start the initialization of the world."""
        self._world.enter_initialization_mode(self._start_time, float("inf"))

    def exit_initialization_mode(self) -> None:
        """Compute the initial outputs."""
        self._world.set_inputs()
        self._world.exit_initialization_mode()
        self._world.get_outputs()

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance from `current_time` (s) by `step_size` (s); return true for fmi2OK."""
        self._world.set_inputs()
        self._world.do_step(current_time, step_size)
        self._world.get_outputs()
        return True

    def _get_fmu_state(self) -> Any:
        return SavedState(self._world, self._arrays)

    def _set_fmu_state(self, state: Any) -> None:
        self._world.set_state(state.state)
        for array, values in zip(self._arrays, state.values, strict=True):
            array[:] = values


def _create_getter(data: Any, index: int) -> Callable[[], Any]:
    return lambda: data[index]


def _create_setter(data: Any, index: int) -> Callable[[Any], None]:
    def set_value(value: Any) -> None:
        data[index] = value

    return set_value
