"""The PyBullet world as one component.

All vehicles, platforms and environment, with contact between them.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cosim.core import component_log
from cosim.core.component import DTYPES, Component, Ports, PreparedCall, Variable
from cosim.core.errors import ComponentError, InputError, Problem, did_you_mean

from . import world_settings
from .catalogue import BINARIES
from .environment.environment_model import EnvironmentModel
from .physics.body import InvalidStateError
from .physics.bullet import connect, create_fixed_bodies, preconnect, pybullet
from .physics.compiled_equations import library_path
from .physics.contacts import FLAG_COUNT, overlap_depths
from .physics.fleet import Fleet, FleetState
from .placement import VehiclePlacement
from .variable_views import recorded_others, variable_views, views_in_parts
from .vehicles.otter.parameters import MAX_PROPELLER_SPEED, MIN_PROPELLER_SPEED
from .world_settings import INITIAL_PREFIX, WAVE_PREFIX, WorldSettings, placement_warnings

if TYPE_CHECKING:
    from cosim.results import Result

#: command -> parameters with the magnitude of its lower limit ("": the limit is 0) and with its
#: upper limit
_PARAMETERS = {
    "rotor_speed": ("", "max_rotor_speed"),
    "thruster_speed": ("max_thruster_speed", "max_thruster_speed"),
    "propeller_speed": ("max_reverse_speed", "max_propeller_speed"),
    "azimuth": ("max_azimuth", "max_azimuth"),
    "rudder_angle": ("max_rudder_angle", "max_rudder_angle"),
}
#: limits of commands for which a model has no parameter; a rudder beyond a right angle is in the
#: wrong unit
_FIXED = {
    "propeller_speed": (MIN_PROPELLER_SPEED, MAX_PROPELLER_SPEED),
    "rudder_angle": (-math.pi / 2, math.pi / 2),
}


def vehicle_constants(
    vehicle: VehiclePlacement, pointer: str
) -> Iterator[tuple[Variable, np.ndarray]]:
    """Yield the parameters of a vehicle as constants that `pointer` sets.

    Those of initial state and waves are left out.
    """
    for variable in vehicle.model.real_variables("parameter"):
        if not variable.name.startswith((INITIAL_PREFIX, WAVE_PREFIX)):
            values = np.array([vehicle.parameters[name] for name in variable.scalar_names])
            value = values.tolist() if variable.shape else values.item()
            text = f"{variable.description}; set by {pointer}/{variable.name}"
            constant = replace(
                variable,
                name=f"{vehicle.name}.{variable.name}",
                causality="local",
                variability="constant",
                start=value,
                description=text,
            )
            yield constant, values


def input_limits(vehicle: VehiclePlacement) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield name and limits of each limited scalar input of a vehicle, in its unit.

    Inputs without an actuator, such as the angle of a fixed rudder, are left out.
    """
    for variable in vehicle.model.real_variables("input"):
        if variable.name in _PARAMETERS:
            for scalar in variable.scalar_names:
                subscript = scalar.removeprefix(variable.name)
                low, high = _limits(variable.name, subscript, vehicle.parameters)
                if low < high:
                    yield f"{vehicle.name}.{scalar}", (low, high)


def _limits(command: str, subscript: str, parameters: Mapping[str, float]) -> tuple[float, float]:
    lower, upper = (
        parameters.get(name + subscript, parameters.get(name)) for name in _PARAMETERS[command]
    )
    return _FIXED[command] if upper is None else (0.0 - (lower or 0.0), upper)


#: upper limit of a Bullet step (s); a longer `do_step` is split into equal steps
MAX_BULLET_STEP = 0.01

#: tolerated initial overlap of vehicles and platforms (m)
MAX_INITIAL_OVERLAP = 1e-3

_FLOAT, _FLAG = DTYPES["Float64"], DTYPES["Boolean"]


class WorldState(NamedTuple):
    """Saved state of a world: vehicles, and inputs and outputs of the environment."""

    fleet: FleetState
    environment: np.ndarray


class World(Component):
    """Vehicles and fixed platforms in one PyBullet client, with wind, waves and current.

    The variables of a vehicle have its name as prefix, those of the environment the prefix
    "environment.".

    Args:
        instance_name: Name of the component.
        vehicles: Name to object with the keys "model" (in `catalogue.VEHICLE_MODELS`), "position"
            of the centre of mass ([x, y, z], of vessels [x, y], m) and, optionally, "motion"
            ("planar" or "6dof"), "hull" ("paper" for the Strider of the paper), "yaw" (rad),
            "velocity_body" ([u, v, w], m/s), "rates" ([p, q, r], rad/s), "parameters" (name to
            value) and "crash_speed" (m/s), the change of velocity by a collision above which it has
            crashed. "friction" (default
            1) and "restitution" (default 0) are those of its surface; the values of two bodies in
              contact are multiplied.
        platforms: Name to object with "size" (edges [x, y, z], m), "position" (centre, m),
            optionally "friction", "restitution".
        environment: Object that `environment/settings.py` describes; waves and gusts start with the
            run.
        obstacles: Name to object with the key "mesh" and those of `placement.py`.

    Raises:
        InputError: With all problems; their subjects are paths of the arguments.
    """

    binds_everything = True
    has_state = True

    def __init__(
        self,
        instance_name: str,
        vehicles: Mapping[str, Any],
        platforms: Mapping[str, Any] | None = None,
        environment: Mapping[str, Any] | None = None,
        obstacles: Mapping[str, Any] | None = None,
    ):
        settings = world_settings.read_world_settings(
            vehicles,
            *(
                {} if argument is None else argument
                for argument in (platforms, environment, obstacles)
            ),
        )
        self._name = instance_name
        self._bullet_step, self._step_size, self._start_time = np.zeros(1), math.nan, 0.0
        self._step_fractions: Sequence[float] = ()
        self._flags = np.zeros((len(settings.vehicles), FLAG_COUNT), _FLAG)
        self._flags_data = self._flags.reshape(-1).data
        self._bound_inputs: dict[str, np.ndarray] = {}
        self._client, self._release = connect(self, settings.body_count)
        try:
            self._populate(settings)
        except BaseException:
            self.free()
            raise
        self._variables_by_name = {
            variable.name: (variable, values)
            for variable, values in self._variables_with_values(settings.vehicles)
        }
        self.variables = [variable for variable, _ in self._variables_by_name.values()]

    @classmethod
    def warm(cls, **arguments: Any) -> None:
        """Construct a world and preconnect a Bullet client, which forked processes inherit.

        The equations of all vehicle models are unpacked too, because a run may have other vehicles.
        """
        for binary in BINARIES:
            library_path(binary)
        with component_log.discarding_messages():
            cls("warm", **arguments).free()
        preconnect()

    @staticmethod
    def scene(name: str, scenario: Mapping[str, Any]) -> dict[str, Any]:
        """Return the scene of the 3-D replay, see `scene.replay`."""
        from .scene.replay import world_scene  # only pages need it

        return world_scene(name, scenario)

    @staticmethod
    def video_frames(
        result: Result, camera: str, times: np.ndarray, size: tuple[int, int]
    ) -> Iterator[np.ndarray]:
        """Render the frames of a video, see `scene.render`."""
        from .scene.render import frames

        return frames(result, camera, times, size)

    def _populate(self, settings: WorldSettings) -> None:
        fixed = create_fixed_bodies(self._client, settings.platforms, settings.obstacles)
        self._fleet = Fleet(
            self._client,
            settings.vehicles,
            fixed.boxes,
            self._bullet_step,
            self._flags,
            fixed.names,
        )
        self._advance, self._contacts, self._failures = (
            self._fleet.advance,
            self._fleet.contacts,
            self._fleet.failures,
        )
        self._check_overlaps(
            fixed.paths | {body.body_id: f"vehicles.{body.name}" for body in self._fleet.bodies}
        )
        self._environment = EnvironmentModel(
            settings.environment,
            settings.sea,
            settings.vehicles,
            settings.platforms,
            self._fleet.bodies,
        )
        self._has_environment = bool(self._environment.update_functions)
        self.input_limits, self.warnings = {}, []
        for vehicle in settings.vehicles:
            self.input_limits |= dict(input_limits(vehicle))
            self.warnings += placement_warnings(vehicle)
        for name in self._environment.vessels_without_wave_motion:
            component_log.log_message(
                self._name,
                component_log.WARNING,
                f"the planar vessel {name} does not move with the waves",
            )
        if self._environment.wind_is_without_effect:
            text = (
                "the wind acts on no vehicle, because their air drag (air_drag, body_drag, "
                "rotor_drag) is 0"
            )
            component_log.log_message(self._name, component_log.WARNING, text)

    def _check_overlaps(self, names: Mapping[int, str]) -> None:
        """Raise InputError if vehicles or platforms overlap initially."""
        problems = [
            Problem(
                f"{names[b]} overlaps {names[a]} by {depth:.3g} m",
                subject=("arguments", *names[b].split("."), "position"),
            )
            for (a, b), depth in overlap_depths(self._client).items()
            if depth > MAX_INITIAL_OVERLAP
        ]
        if problems:
            raise InputError(problems)

    def _variables_with_values(
        self, vehicles: Sequence[VehiclePlacement]
    ) -> Iterator[tuple[Variable, np.ndarray]]:
        """Yield every variable with a view of its values."""
        for vehicle, body, flags in zip(vehicles, self._fleet.bodies, self._flags, strict=True):
            prefixed = body.model.variables_of(body.name)
            yield from views_in_parts([v for v in prefixed if v.causality == "input"], body.inputs)
            yield from variable_views(
                [v for v in prefixed if v.causality == "output"],
                {_FLOAT: body.outputs, _FLAG: flags},
            )
            yield from vehicle_constants(
                vehicle, f"/components/{self._name}/arguments/vehicles/{body.name}/parameters"
            )
        environment = self._environment
        yield from variable_views(environment.input_variables, {_FLOAT: environment.inputs})
        yield from variable_views(environment.output_variables, {_FLOAT: environment.outputs})

    def set(self, name: str, value: Any) -> None:
        """Set an input."""
        variable, values = self._variable(name, "set")
        if variable.causality != "input":
            raise ComponentError(self._name, "set", f"{name} is an output, expected an input")
        values[:] = value
        if name in self._bound_inputs:
            self._bound_inputs[name][:] = value

    def get(self, name: str) -> Any:
        """Return the value of a variable, a list for an array."""
        variable, values = self._variable(name, "get")
        return values.tolist() if variable.shape else values.item()

    def _variable(self, name: str, function: str) -> tuple[Variable, np.ndarray]:
        if name not in self._variables_by_name:
            raise ComponentError(
                self._name,
                function,
                f'no variable "{name}"{did_you_mean(name, self._variables_by_name)}',
            )
        return self._variables_by_name[name]

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Bind the arrays from which inputs are read and to which outputs are written."""
        self._bound_inputs = {
            variable.name: values
            for variable, values in variable_views(inputs.variables, inputs.arrays)
        }
        bound_inputs, bound_outputs = inputs.arrays[_FLOAT].data, outputs.arrays[_FLOAT].data
        # memoryviews: copying a few numbers is faster than with NumPy
        own_outputs = self._fleet.outputs.data
        parts: list[np.ndarray] = []
        for body in self._fleet.bodies:
            parts += body.inputs
        ends = list(accumulate(map(len, parts)))
        self._input_copies = [
            (part.data, bound_inputs[end - len(part) : end])
            for part, end in zip(parts, ends, strict=True)
        ]
        self._output_copies = [
            (bound_outputs[: len(own_outputs)], own_outputs),
            (outputs.arrays[_FLAG].data, self._flags.reshape(-1).data),
        ]
        self._recorded_others = recorded_others(outputs)
        if self._has_environment:
            self._input_copies.append((self._environment.inputs.data, bound_inputs[ends[-1] :]))
            end = len(own_outputs) + len(self._environment.outputs)
            self._output_copies.append(
                (bound_outputs[len(own_outputs) : end], self._environment.outputs.data)
            )

    def set_inputs(self) -> None:
        """Copy the bound inputs."""
        for own, bound in self._input_copies:
            own[:] = bound

    def get_outputs(self) -> None:
        """Copy the outputs to the bound arrays."""
        for bound, own in self._output_copies:
            bound[:] = own
        for name, recorded in self._recorded_others:
            recorded[:] = self.get(name)

    def prepare_step_calls(
        self, clock: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Return one call that copies inputs, makes a step and copies outputs."""
        return [PreparedCall(self._step, (clock, step_size), "do_step")]

    def _step(self, clock: ctypes.c_double, step_size: float) -> int:
        self.set_inputs()
        self.do_step(clock.value, step_size)
        self.get_outputs()
        return 0

    def enter_initialization_mode(self, start_time: float, _stop_time: float) -> None:
        """Set the start time (s), at which waves and gusts start."""
        self._start_time = start_time

    def exit_initialization_mode(self) -> None:
        """Compute the outputs of the environment at the start."""
        self._environment.update(0.0)
        self._environment.publish(0.0)

    def do_step(self, time: float, step_size: float) -> None:
        """Advance from `time` (s) by `step_size` (s), in equal Bullet steps.

        Each is at most MAX_BULLET_STEP.
        """
        if step_size != self._step_size:
            self._set_step_size(time, step_size)
        if self._contacts.has_contacts:
            self._contacts.clear()
        try:
            if self._has_environment:
                elapsed = time - self._start_time
                for k, fraction in enumerate(self._step_fractions):
                    self._environment.update(elapsed + k * self._bullet_step[0])
                    self._advance(fraction)
                self._environment.publish(elapsed + step_size)
            else:
                for fraction in self._step_fractions:
                    self._advance(fraction)
        except InvalidStateError as error:
            hint = (
                f"; probable cause: the step of {step_size:g} s, {MAX_BULLET_STEP:g} s is usual"
                if step_size > 0.05
                else ""
            )
            raise ComponentError(self._name, "do_step", f"{error}{hint}", time) from None
        if self._failures.alarm:
            self._report_failures(time + step_size)

    def _report_failures(self, time: float) -> None:
        """Find and log the vehicles that have failed until `time` (s)."""
        level = partial(self._environment.water_level, time=time - self._start_time)
        for message in self._failures.examine(level):
            component_log.log_message(
                self._name, component_log.WARNING, f"t = {time:g} s: {message}"
            )

    def _set_step_size(self, time: float, step_size: float) -> None:
        """Split the component's step into equal Bullet steps."""
        if not 0 < step_size < math.inf:
            raise ComponentError(
                self._name,
                "do_step",
                f"found step size {step_size}, expected a positive number",
                time,
            )
        step_count = max(1, math.ceil(step_size / MAX_BULLET_STEP - 1e-9))
        self._step_fractions = (1 / step_count,) * step_count
        self._bullet_step[0] = step_size / step_count
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._bullet_step[0], physicsClientId=self._client
        )
        self._step_size = step_size

    def terminate(self) -> None:
        """Do nothing."""

    def free(self) -> None:
        """Release the Bullet client."""
        self._release()

    def get_state(self) -> WorldState:
        """Return a copy of the state, which also takes memory in Bullet until `free_state`."""
        return WorldState(self._fleet.get_state(), self._environment.values.copy())

    def set_state(self, state: WorldState) -> None:
        """Restore a state."""
        self._fleet.set_state(state.fleet)
        self._environment.values[:] = state.environment

    def free_state(self, state: WorldState) -> None:
        """Release the memory of a state in Bullet."""
        if self._release.alive:
            self._fleet.free_state(state.fleet)
