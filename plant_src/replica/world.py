"""The plant of the published simulator: a physics engine that integrates the forces it is given.

Forces are held over a step and fixed in the world frame, like the published ones; Bullet divides the step into `sub_steps`
(published: two of 5 ms) and has gravity. `plant_src/world.py` is the accurate plant; this one is there for comparison.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.core.component import Component, Ports, Variable
from cosim.core.errors import ComponentError, InputError, Problem, did_you_mean

from .. import world_settings
from ..physics.body import MAX_STATE_NORM, create_compound_shape, set_dynamics
from ..physics.client import connect, pybullet
from ..placement import Platform, VehiclePlacement
from ..scene import replay
from ..vehicles.ar_drone.parameters import GRAVITY
from ..vehicles.common.shapes import Box
from .bodies import Quadcopter, Vessel
from .interface import INPUTS, OUTPUTS

VEHICLE_MODELS = {"uav": "ar_drone", "usv": "strider"}

#: bodies may not overlap deeper than this at the start (m)
MAX_INITIAL_OVERLAP = 1e-3

_DISTANCE = 8  # field of Bullet's contact points


@dataclass(frozen=True)
class ReplicaState:
    """The state of a world: Bullet's, which Bullet keeps under a number, and ours."""

    bullet: int
    outputs: np.ndarray
    acceleration_integral: np.ndarray


class World(Component):
    """The quadcopter `uav`, the vessel `usv` and fixed platforms in one PyBullet client: 14 inputs, 22 outputs (`interface.py`).

    `vehicles`: {"uav": {"position": [x, y, z]}, "usv": {"position": [x, y]}} (m; the origin of the quadcopter's model frame, the
    vessel's centre of mass), each with "yaw" (rad, counter-clockwise), "velocity_body" (m/s) and "rates" (rad/s) in
    forward-left-up body axes, as the other world reads them. `platforms`: name -> {"size", "position"} (m).
    `sub_steps`: steps of Bullet per step of the component. Raises InputError with all problems.
    """

    binds_everything = True
    has_state = True
    variables = (*INPUTS, *OUTPUTS)

    def __init__(
        self,
        instance_name: str,
        vehicles: Mapping[str, Any],
        platforms: Mapping[str, Any] | None = None,
        sub_steps: int = 2,
    ):
        spawns, boxes = _read_arguments(vehicles, {} if platforms is None else platforms, sub_steps)
        self._name, self._sub_steps, self._step_size = instance_name, sub_steps, math.nan
        self._inputs, self._outputs = np.zeros(len(INPUTS)), np.zeros(len(OUTPUTS))
        self._bound_inputs, self._bound_outputs = np.zeros(len(INPUTS)), np.zeros(len(OUTPUTS))
        self._client, self._disconnect = connect(self)
        try:
            self._populate(spawns, boxes)
        except BaseException:
            self.free()
            raise

    @staticmethod
    def scene(name: str, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """What the 3-D replay draws of this world, see `scene.replay`."""
        return replay.published_simulator_scene(name, scenario)

    def _populate(self, spawns: Mapping[str, VehiclePlacement], platforms: list[Platform]) -> None:
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=self._client)
        for platform in platforms:
            _add_platform(self._client, platform)
        self._quadcopter = Quadcopter(self._client, spawns["uav"].parameters)
        self._vessel = Vessel(self._client, spawns["usv"].parameters)
        self._check_overlaps()
        self._acceleration_integral = np.zeros(3)
        self._publish(math.inf)

    def _check_overlaps(self) -> None:
        pybullet.performCollisionDetection(self._client)
        depth = max((-point[_DISTANCE] for point in pybullet.getContactPoints(physicsClientId=self._client)), default=0.0)
        if depth > MAX_INITIAL_OVERLAP:
            raise InputError(Problem(f"bodies overlap by {depth:.3g} m at the start", "vehicles", ("arguments", "vehicles")))

    # -- values --------------------------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        array, place = self._find(name, "set")
        if array is self._outputs:
            raise ComponentError(self._name, "set", f"{name} is an output")
        self._inputs[place] = self._bound_inputs[place] = value

    def get(self, name: str) -> Any:
        array, place = self._find(name, "get")
        return array.item(place)

    def _find(self, name: str, function: str) -> tuple[np.ndarray, int]:
        for variables, array in ((INPUTS, self._inputs), (OUTPUTS, self._outputs)):
            for place, variable in enumerate(variables):
                if variable.name == name:
                    return array, place
        names = [variable.name for variable in self.variables]
        raise ComponentError(self._name, function, f'no variable "{name}"{did_you_mean(name, names)}')

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        (self._bound_inputs,), (self._bound_outputs,) = inputs.arrays.values(), outputs.arrays.values()

    def set_inputs(self) -> None:
        self._inputs[:] = self._bound_inputs

    def get_outputs(self) -> None:
        self._bound_outputs[:] = self._outputs

    # -- life cycle ----------------------------------------------------------------------------------------------------

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None: ...

    def exit_initialization_mode(self) -> None: ...

    def do_step(self, time: float, step_size: float) -> None:
        if step_size != self._step_size:
            self._set_step_size(time, step_size)
        self._check_finite(INPUTS, self._inputs, time)
        self._quadcopter.apply(self._inputs[0:8])
        self._vessel.apply(self._inputs[8:14])
        pybullet.stepSimulation(self._client)
        self._publish(step_size)
        self._check_finite(OUTPUTS, self._outputs, time)

    def _set_step_size(self, time: float, step_size: float) -> None:
        if not 0 < step_size < math.inf:
            raise ComponentError(self._name, "do_step", f"found step size {step_size}, expected a positive number", time)
        options = {"fixedTimeStep": step_size, "numSubSteps": self._sub_steps, "physicsClientId": self._client}
        pybullet.setPhysicsEngineParameter(**options)
        self._step_size = step_size

    def _publish(self, step_size: float) -> None:
        motion, moved = self._quadcopter.measure()
        self._outputs[:] = np.concatenate((motion, (moved - self._acceleration_integral) / step_size, self._vessel.measure()))
        self._acceleration_integral = moved

    def _check_finite(self, variables: tuple[Variable, ...], values: np.ndarray, time: float) -> None:
        sizes = np.abs(values)
        if not sizes.max() < MAX_STATE_NORM:
            worst = int(np.nan_to_num(sizes, nan=np.inf).argmax())
            raise ComponentError(self._name, "do_step", f"{variables[worst].name} is {values[worst]:g}", time)

    def terminate(self) -> None: ...

    def free(self) -> None:
        self._disconnect()

    # -- state ---------------------------------------------------------------------------------------------------------

    def get_state(self) -> ReplicaState:
        return ReplicaState(pybullet.saveState(self._client), self._outputs.copy(), self._acceleration_integral.copy())

    def set_state(self, state: ReplicaState) -> None:
        pybullet.restoreState(state.bullet, physicsClientId=self._client)
        self._outputs[:], self._acceleration_integral = state.outputs, state.acceleration_integral.copy()

    def free_state(self, state: ReplicaState) -> None:
        pybullet.removeState(state.bullet, physicsClientId=self._client)


def _read_arguments(vehicles: Any, platforms: Any, sub_steps: Any) -> tuple[dict[str, VehiclePlacement], list[Platform]]:
    found = vehicles if isinstance(vehicles, Mapping) else {}
    problems = [
        Problem(f'expected the vehicles "uav" and "usv", found {sorted(found)}', "vehicles", ("arguments", "vehicles"))
        for _ in range(found.keys() != VEHICLE_MODELS.keys())
    ]
    if not isinstance(sub_steps, int) or isinstance(sub_steps, bool) or sub_steps < 1:
        problems.append(
            Problem(f"found {sub_steps!r}, expected an integer of at least 1", "sub_steps", ("arguments", "sub_steps"))
        )
    if problems:
        raise InputError(problems)
    modelled = {
        name: {**spec, "model": VEHICLE_MODELS[name]} if isinstance(spec, Mapping) else spec for name, spec in vehicles.items()
    }
    read = world_settings.read_world_settings(modelled, platforms, {})
    return {spawn.name: spawn for spawn in read.vehicles}, list(read.platforms)


def _add_platform(client: int, platform: Platform) -> None:
    x, y, z = platform.size
    shape = create_compound_shape([Box((x / 2, y / 2, z / 2), (0.0, 0.0, 0.0))], client)
    body = pybullet.createMultiBody(0, shape, -1, platform.position, physicsClientId=client)
    set_dynamics(client, body, -1)
