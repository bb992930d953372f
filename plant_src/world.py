"""The PyBullet world as one component: all vehicles, the platforms, and contact between them."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cosim.core import component_log
from cosim.core.component import DTYPES, Component, Ports, PreparedCall, Variable
from cosim.core.errors import ComponentError, InputError, Problem, did_you_mean

from . import world_settings
from .catalogue import MODELS
from .environment.environment_model import EnvironmentModel
from .physics.body import InvalidStateError, create_compound_shape, set_dynamics
from .physics.client import connect, preconnect, pybullet
from .physics.compiled_equations import library_path
from .physics.fleet import Fleet, FleetState
from .placement import Platform
from .scene import replay
from .vehicles.common.shapes import Box
from .world_settings import WorldSettings

if TYPE_CHECKING:
    from cosim.results import Result

#: a step of Bullet is at most this long (s); a longer do_step is split into equal ones
MAX_BULLET_STEP = 0.01

#: vehicles and platforms may not overlap deeper than this at the start (m)
MAX_INITIAL_OVERLAP = 1e-3

_FLOAT, _FLAG = DTYPES["Float64"], DTYPES["Boolean"]
_BODY_A, _BODY_B, _DISTANCE = 1, 2, 8  # fields of Bullet's contact points


class WorldState(NamedTuple):
    """The state of a world: that of its vehicles, and what the environment was told and publishes."""

    fleet: FleetState
    environment: np.ndarray


class World(Component):
    """Vehicles and fixed platforms in one PyBullet client, with wind, waves and current around them.

    `vehicles`: name -> {"model": one of `catalogue.VEHICLES`, "motion": "planar" or "6dof", "position": [x, y, z] or for vessels
    [x, y] (m, centre of mass), "yaw": rad, "velocity_body": [u, v, w] (m/s), "rates": [p, q, r] (rad/s), "parameters": name ->
    value}; all but model and position may be left out.
    `platforms`: name -> {"size": [x, y, z] (m, edges), "position": [x, y, z] (m, centre)}.
    `environment`: as `environment/settings.py` has it; waves and gusts begin with the run.

    The variables of vehicle V are those of its model with the prefix "V.", those of the environment have "environment.". Raises
    InputError with all problems.
    """

    binds_everything = True
    has_state = True

    def __init__(
        self,
        instance_name: str,
        vehicles: Mapping[str, Any],
        platforms: Mapping[str, Any] | None = None,
        environment: Mapping[str, Any] | None = None,
    ):
        read = world_settings.read_world_settings(
            vehicles, {} if platforms is None else platforms, {} if environment is None else environment
        )
        self._name = instance_name
        self._step, self._step_size, self._step_count, self._start_time = np.zeros(1), math.nan, 1, 0.0
        self._flags = np.zeros((len(read.vehicles), 2), _FLAG)
        self._flags_data = self._flags.reshape(-1).data
        self._bound_inputs: dict[str, np.ndarray] = {}
        self._client, self._disconnect = connect(self)
        try:
            self._populate(read)
        except BaseException:
            self.free()
            raise
        self._variables_by_name = {variable.name: (variable, values) for variable, values in self._variables_with_values()}
        self.variables = [variable for variable, _ in self._variables_by_name.values()]

    @staticmethod
    def warm() -> None:
        """The equations of all vehicles and a client of Bullet are made ready."""
        for model in MODELS:
            library_path(model)
        preconnect()

    @staticmethod
    def scene(name: str, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """What the 3-D replay draws of a world, see `scene.replay`."""
        return replay.world_scene(name, scenario)

    @staticmethod
    def video_frames(result: Result, camera: str, times: np.ndarray, size: tuple[int, int]) -> Iterator[np.ndarray]:
        """Render the frames of a video, see `scene.video`."""
        from .scene.video import frames

        return frames(result, camera, times, size)

    def _populate(self, read: WorldSettings) -> None:
        names = {self._add_platform(platform): f"platforms.{platform.name}" for platform in read.platforms}
        self._fleet = Fleet(self._client, read.vehicles, read.platforms, self._step, self._flags)
        names |= {shadow.body_id: f"vehicles.{shadow.name}" for shadow in self._fleet.bodies}
        self._check_overlaps(names)
        self._environment = EnvironmentModel(read.environment, read.sea, read.vehicles, read.platforms, self._fleet.bodies)
        self._has_environment = bool(self._environment.update_functions)  # a calm world pays nothing
        for name in self._environment.vessels_without_wave_motion:
            component_log.log_message(self._name, component_log.WARNING, f"the planar vessel {name} does not move with the waves")

    def _add_platform(self, platform: Platform) -> int:
        x, y, z = platform.size
        shape = create_compound_shape([Box((x / 2, y / 2, z / 2), (0.0, 0.0, 0.0))], self._client)
        body = pybullet.createMultiBody(0, shape, -1, platform.position, physicsClientId=self._client)
        set_dynamics(self._client, body, -1)
        return body

    def _check_overlaps(self, names: Mapping[int, str]) -> None:
        pybullet.performCollisionDetection(self._client)
        depths: dict[tuple[str, str], float] = {}
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            pair = names[point[_BODY_A]], names[point[_BODY_B]]
            depths[pair] = max(depths.get(pair, 0.0), -point[_DISTANCE])
        problems = [
            Problem(f"{b} overlaps {a} by {depth:.3g} m", subject=("arguments", *b.split("."), "position"))
            for (a, b), depth in depths.items()
            if depth > MAX_INITIAL_OVERLAP
        ]
        if problems:
            raise InputError(problems)

    # -- values --------------------------------------------------------------------------------------------------------

    def _variables_with_values(self) -> Iterator[tuple[Variable, np.ndarray]]:
        """Every variable and where its values lie."""
        for shadow, flags in zip(self._fleet.bodies, self._flags, strict=True):
            prefixed = [replace(variable, name=f"{shadow.name}.{variable.name}") for variable in shadow.model.variables]
            yield from _variable_views([v for v in prefixed if v.causality == "input"], {_FLOAT: shadow.inputs})
            yield from _variable_views([v for v in prefixed if v.causality == "output"], {_FLOAT: shadow.outputs, _FLAG: flags})
        around = self._environment
        yield from _variable_views(around.input_variables, {_FLOAT: around.inputs})
        yield from _variable_views(around.output_variables, {_FLOAT: around.outputs})

    def set(self, name: str, value: Any) -> None:
        variable, values = self._variable(name, "set")
        if variable.causality != "input":
            raise ComponentError(self._name, "set", f"{name} is an output")
        values[:] = value
        if name in self._bound_inputs:
            self._bound_inputs[name][:] = value

    def get(self, name: str) -> Any:
        variable, values = self._variable(name, "get")
        return values.tolist() if variable.shape else values.item()

    def _variable(self, name: str, function: str) -> tuple[Variable, np.ndarray]:
        if name not in self._variables_by_name:
            raise ComponentError(self._name, function, f'no variable "{name}"{did_you_mean(name, self._variables_by_name)}')
        return self._variables_by_name[name]

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._bound_inputs = {variable.name: values for variable, values in _variable_views(inputs.variables, inputs.arrays)}
        given, wanted = inputs.arrays[_FLOAT].data, outputs.arrays[_FLOAT].data
        # memoryviews: numpy takes longer for so few numbers
        own_inputs, own_outputs = self._fleet.inputs.data, self._fleet.outputs.data
        self._input_copies = [(own_inputs, given[: len(own_inputs)])]
        self._output_copies = [
            (wanted[: len(own_outputs)], own_outputs),
            (outputs.arrays[_FLAG].data, self._flags.reshape(-1).data),
        ]
        if self._has_environment:
            self._input_copies.append((self._environment.inputs.data, given[len(own_inputs) :]))
            self._output_copies.append((wanted[len(own_outputs) :], self._environment.outputs.data))

    def set_inputs(self) -> None:
        for own, given in self._input_copies:
            own[:] = given

    def get_outputs(self) -> None:
        for wanted, own in self._output_copies:
            wanted[:] = own

    def prepare_step_calls(self, clock: ctypes.c_double, step_size: float) -> Sequence[PreparedCall]:
        return [PreparedCall(self._turn, (clock, step_size), "do_step")]

    def _turn(self, clock: ctypes.c_double, step_size: float) -> int:
        self.set_inputs()
        self.do_step(clock.value, step_size)
        self.get_outputs()
        return 0

    # -- life cycle ----------------------------------------------------------------------------------------------------

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._start_time = start_time

    def exit_initialization_mode(self) -> None:
        self._environment.update(0.0)
        self._environment.publish(0.0)

    def do_step(self, time: float, step_size: float) -> None:
        if step_size != self._step_size:
            self._set_step_size(time, step_size)
        if self._fleet.contacts.has_contacts:
            self._fleet.contacts.clear()
        try:
            if self._has_environment:
                self._advance_with_environment(time - self._start_time)
            else:
                for _ in range(self._step_count):
                    self._fleet.advance(1 / self._step_count)
        except InvalidStateError as error:
            raise ComponentError(self._name, "do_step", str(error), time) from None

    def _advance_with_environment(self, time: float) -> None:
        """The steps of Bullet in a world that is not calm, from a time since the start (s)."""
        for k in range(self._step_count):
            self._environment.update(time + k * self._step[0])
            self._fleet.advance(1 / self._step_count)
        self._environment.publish(time + self._step_size)

    def _set_step_size(self, time: float, step_size: float) -> None:
        """Split the component's step into equal steps of Bullet."""
        if not 0 < step_size < math.inf:
            raise ComponentError(self._name, "do_step", f"found step size {step_size}, expected a positive number", time)
        self._step_count = max(1, math.ceil(step_size / MAX_BULLET_STEP - 1e-9))
        self._step[0] = step_size / self._step_count
        pybullet.setPhysicsEngineParameter(fixedTimeStep=self._step[0], physicsClientId=self._client)
        self._step_size = step_size

    def terminate(self) -> None: ...

    def free(self) -> None:
        self._disconnect()

    # -- state ---------------------------------------------------------------------------------------------------------

    def get_state(self) -> WorldState:
        return WorldState(self._fleet.get_state(), self._environment.values.copy())

    def set_state(self, state: WorldState) -> None:
        self._fleet.set_state(state.fleet)
        self._environment.values[:] = state.environment

    def free_state(self, state: WorldState) -> None:
        if self._disconnect.alive:
            self._fleet.free_state(state.fleet)


def _variable_views(
    variables: Sequence[Variable], arrays: Mapping[np.dtype[Any], np.ndarray]
) -> Iterator[tuple[Variable, np.ndarray]]:
    """Each variable with its part of the array of its dtype, in which the variables lie in order."""
    filled = dict.fromkeys(arrays, 0)
    for variable in variables:
        first = filled[variable.dtype]
        filled[variable.dtype] = first + len(variable.scalar_names)
        yield variable, arrays[variable.dtype][first : filled[variable.dtype]]
