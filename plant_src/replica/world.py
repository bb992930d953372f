"""Plant of the published simulator: a physics engine that integrates given forces.

Forces are constant over a step and fixed in the world frame, as published. Bullet divides a step
into `sub_steps` (published: two of 5 ms) and applies gravity. This plant is for comparison only;
`plant_src/world.py` is the accurate one.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.component import Component, Ports, Variable
from cosim.core.errors import ComponentError, InputError, Problem, did_you_mean

from .. import world_settings
from ..physics.bullet import connect, create_platform, pybullet
from ..placement import DRY, Platform, VehiclePlacement
from ..scene import replay
from ..variable_views import recorded_others
from ..vehicles.common.interface import MAX_STATE_NORM
from .bodies import Quadcopter, Vessel
from .bus import INPUTS, OUTPUTS

VEHICLE_MODELS = {"uav": "ar_drone", "usv": "strider"}

#: largest allowed overlap of bodies at the start (m)
MAX_INITIAL_OVERLAP = 1e-3

_DISTANCE = 8  # field of Bullet's contact points


@dataclass(frozen=True)
class ReplicaState:
    """State of a world.

    The number of a state saved in Bullet, the outputs, and the integral of the published
    acceleration.
    """

    bullet: int
    outputs: np.ndarray
    acceleration_integral: np.ndarray


class World(Component):
    """Quadcopter `uav`, vessel `usv` and fixed platforms in one PyBullet client.

    14 inputs, 22 outputs (`bus.py`).

    Args:
        instance_name: Name of the component.
        vehicles: {"uav": {"position": [x, y, z]}, "usv": {"position": [x, y]}}: origin of the
            quadcopter's model frame and centre of mass of the vessel (m). Each may have "yaw" (rad,
            counter-clockwise), "velocity_body" (m/s) and "rates" (rad/s) in forward-left-up body
            axes, as in `plant_src/world.py`.
        platforms: {NAME: {"size": [x, y, z], "position": [x, y, z]}}, edges and centre (m).
        sub_steps: Steps of Bullet per step of the component.

    Raises:
        InputError: One or more arguments are invalid or bodies overlap at the start; lists all
            problems.
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
        placements, boxes = _read_arguments(
            vehicles, {} if platforms is None else platforms, sub_steps
        )
        self._name, self._sub_steps, self._step_size = instance_name, sub_steps, math.nan
        self._inputs, self._outputs = np.zeros(len(INPUTS)), np.zeros(len(OUTPUTS))
        self._bound_inputs, self._bound_outputs = np.zeros(len(INPUTS)), np.zeros(len(OUTPUTS))
        self._client, self._release = connect(self)
        try:
            self._populate(placements, boxes)
        except BaseException:
            self.free()
            raise

    @staticmethod
    def scene(name: str, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """Return the scene of the 3-D replay for the component `name` (`scene/replay.py`)."""
        return replay.published_simulator_scene(name, scenario)

    def _populate(
        self, vehicles: Mapping[str, VehiclePlacement], platforms: list[Platform]
    ) -> None:
        pybullet.setGravity(0, 0, -9.81, physicsClientId=self._client)
        for platform in platforms:
            create_platform(self._client, replace(platform, surface=DRY))
        self._quadcopter = Quadcopter(self._client, tuple(vehicles["uav"].parameters.values()))
        self._vessel = Vessel(self._client, tuple(vehicles["usv"].parameters.values()))
        self._check_overlaps()
        self._acceleration_integral = np.zeros(3)
        self._publish(math.inf)  # an infinite step makes the first difference quotient zero

    def _check_overlaps(self) -> None:
        """Raise InputError if bodies overlap by more than `MAX_INITIAL_OVERLAP`."""
        pybullet.performCollisionDetection(self._client)
        depth = max(
            (
                -point[_DISTANCE]
                for point in pybullet.getContactPoints(physicsClientId=self._client)
            ),
            default=0.0,
        )
        if depth > MAX_INITIAL_OVERLAP:
            raise InputError(
                Problem(
                    f"bodies overlap by {depth:.3g} m at the start",
                    "vehicles",
                    ("arguments", "vehicles"),
                )
            )

    # -- values

    def set(self, name: str, value: Any) -> None:
        """Set an input. Raises ComponentError for an output or an unknown name."""
        array, index = self._find(name, "set")
        if array is self._outputs:
            raise ComponentError(self._name, "set", f"{name} is an output")
        self._inputs[index] = self._bound_inputs[index] = value

    def get(self, name: str) -> Any:
        """Return the present value of a variable. Raises ComponentError for an unknown name."""
        array, index = self._find(name, "get")
        return array.item(index)

    def _find(self, name: str, function: str) -> tuple[np.ndarray, int]:
        """Return the array and the index of a variable.

        Raises ComponentError for an unknown name.
        """
        for variables, array in ((INPUTS, self._inputs), (OUTPUTS, self._outputs)):
            for index, variable in enumerate(variables):
                if variable.name == name:
                    return array, index
        names = [variable.name for variable in self.variables]
        raise ComponentError(
            self._name, function, f'no variable "{name}"{did_you_mean(name, names)}'
        )

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Take the arrays of the engine."""
        (self._bound_inputs,), (self._bound_outputs,) = (
            inputs.arrays.values(),
            outputs.arrays.values(),
        )
        self._recorded_others = recorded_others(outputs)

    def set_inputs(self) -> None:
        """Read the inputs."""
        self._inputs[:] = self._bound_inputs

    def get_outputs(self) -> None:
        """Write the outputs."""
        self._bound_outputs[: len(OUTPUTS)] = self._outputs
        for name, recorded in self._recorded_others:
            recorded[:] = self.get(name)

    # -- life cycle

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Do nothing: the initial outputs follow from the arguments."""

    def exit_initialization_mode(self) -> None:
        """Do nothing."""

    def do_step(self, time: float, step_size: float) -> None:
        """Advance from `time` (s) by `step_size` (s).

        Raises ComponentError if a signal is not finite.
        """
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
            raise ComponentError(
                self._name,
                "do_step",
                f"found step size {step_size}, expected a positive number",
                time,
            )
        options = {
            "fixedTimeStep": step_size,
            "numSubSteps": self._sub_steps,
            "physicsClientId": self._client,
        }
        pybullet.setPhysicsEngineParameter(**options)
        self._step_size = step_size

    def _publish(self, step_size: float) -> None:
        motion, integral = self._quadcopter.measure()
        acceleration = (integral - self._acceleration_integral) / step_size
        self._outputs[:] = np.concatenate((motion, acceleration, self._vessel.measure()))
        self._acceleration_integral = integral

    def _check_finite(
        self, variables: tuple[Variable, ...], values: np.ndarray, time: float
    ) -> None:
        sizes = np.abs(values)
        if not sizes.max() < MAX_STATE_NORM:
            worst = int(np.nan_to_num(sizes, nan=np.inf).argmax())
            raise ComponentError(
                self._name, "do_step", f"{variables[worst].name} is {values[worst]:g}", time
            )

    def terminate(self) -> None:
        """Do nothing: there is nothing to end."""

    def free(self) -> None:
        """Release the Bullet client."""
        self._release()

    # -- state

    def get_state(self) -> ReplicaState:
        """Return a copy of the state."""
        return ReplicaState(
            pybullet.saveState(self._client),
            self._outputs.copy(),
            self._acceleration_integral.copy(),
        )

    def set_state(self, state: ReplicaState) -> None:
        """Restore a state; it stays valid."""
        pybullet.restoreState(state.bullet, physicsClientId=self._client)
        self._outputs[:], self._acceleration_integral = (
            state.outputs,
            state.acceleration_integral.copy(),
        )

    def free_state(self, state: ReplicaState) -> None:
        """Delete the state saved in Bullet."""
        pybullet.removeState(state.bullet, physicsClientId=self._client)


def _read_arguments(
    vehicles: Any, platforms: Any, sub_steps: Any
) -> tuple[dict[str, VehiclePlacement], list[Platform]]:
    """Return the vehicles by name and the platforms. Raises InputError with all problems."""
    names = vehicles.keys() if isinstance(vehicles, Mapping) else set()
    problems = []
    if names != VEHICLE_MODELS.keys():
        expectation = f'expected the vehicles "uav" and "usv", found {sorted(names)}'
        problems.append(Problem(expectation, "vehicles", ("arguments", "vehicles")))
    if not isinstance(sub_steps, int) or isinstance(sub_steps, bool) or sub_steps < 1:
        problems.append(
            Problem(
                f"found {sub_steps!r}, expected an integer of at least 1",
                "sub_steps",
                ("arguments", "sub_steps"),
            )
        )
    if problems:
        raise InputError(problems)
    specs = {
        name: {**spec, "model": VEHICLE_MODELS[name]} if isinstance(spec, Mapping) else spec
        for name, spec in vehicles.items()
    }
    settings = world_settings.read_world_settings(specs, platforms, {}, {})
    return {vehicle.name: vehicle for vehicle in settings.vehicles}, list(settings.platforms)
