"""Contact bodies: vehicles that move by their own equations, with contact resolved by Bullet.

A step of the world has three parts:

1. `predict`: the equations integrate each vehicle over the step without contact. Bullet receives
   the constant velocity and angular velocity that lead a rigid body to the predicted pose.
2. Bullet makes one step. Contact changes the velocities.
3. `correct`: the change of velocity times Bullet's mass and inertia is the contact impulse. The
   equations apply it to the predicted velocity and take over the pose to which Bullet's motion
   leads.

Gravity is part of the equations and zero in Bullet. A vehicle far from everything else needs no
contact solution, and its motion is known without Bullet: Bullet steps only bodies that are near
something (`clearance.py`). Inactive bodies wait in a remote row.

Vessels float in six degrees of freedom, or move in the horizontal plane.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..vehicles.common.interface import MAX_STATE_NORM
from ..vehicles.common.shapes import Body
from .bullet import create_compound_shape, pybullet, set_dynamics
from .clearance import BoundingBox

if TYPE_CHECKING:
    from ..catalogue import Model
    from ..placement import VehiclePlacement
    from .compiled_equations import CompiledEquations

#: first x coordinate of inactive bodies (m), beyond the reach of any vehicle, and distance between
#: them (m)
INACTIVE_POSITION, INACTIVE_SPACING = 2 * MAX_STATE_NORM, 100.0
IDENTITY_QUATERNION = (0.0, 0.0, 0.0, 1.0)


#: arrays of the compiled equations that are no state of a vehicle, or a part of another array
_FIXED_ARRAYS = ("constants", "principal_axes", "step_size", "motion")


class InvalidStateError(Exception):
    """An input or the motion of a vehicle is not finite or too large.

    The text names the variable.
    """


class ContactBody:
    """One vehicle in a world.

    Its body in Bullet and its compiled equations (`vehicles/common/contact_maps.py`).

    Twists are (velocity, angular velocity) in m/s and rad/s, world frame.

    Attributes:
        name: Name of the vehicle.
        model: Model of the vehicle.
        equations: Its compiled equations.
        body_id: Number of the body in Bullet.
        inputs: Real inputs of the model in order, in one or several parts.
        outputs: Real outputs in order; `correct` writes the motion, `contacts.py` the contact
            force.
        environment_inputs: Inputs that the environment writes, in order.
        commanded_twist: Twist to set in Bullet before its step, shape (6,).
        bullet_twist: Twist that Bullet computed, shape (6,). `predict` writes the one expected
            without contact.
        compensating_torque: Torque (N m, world frame) that cancels Bullet's gyroscopic torque, or
            None.
        predict: Function without arguments: integrate the equations over the step without contact.
        correct: Function without arguments: apply Bullet's twist and publish the outputs.
    """

    #: maximal coordinates halve Bullet's time, but its saved states lack the inertia of such a body
    #: in world axes
    USE_MAXIMAL_COORDINATES = False

    def __init__(
        self,
        client: int,
        vehicle: VehiclePlacement,
        equations: CompiledEquations,
        arrays: Mapping[str, np.ndarray],
    ):
        """Create the body in Bullet and initialize the equations.

        Args:
            client: Number of the Bullet client.
            vehicle: Vehicle to create.
            equations: Compiled equations of its model.
            arrays: Arrays of the sizes that `state_sizes` returns, and "step_size" (s), which all
                vehicles share.
        """
        self.name, self.model, self._client = vehicle.name, vehicle.model, client
        self.equations = equations
        self._arrays = arrays = {
            **arrays,
            "parameters": np.array(vehicle.model.equation_parameters(vehicle.parameters)),
            "principal_axes": np.array(vehicle.body.axes),
            "constants": np.zeros(equations.sizes["constants"]),
            "motion": arrays["outputs"][: equations.sizes["motion"]],
        }
        self.inputs = [arrays["inputs"][place] for place in vehicle.model.input_places]
        self.outputs = arrays["outputs"]
        self.environment_inputs = arrays["environment_inputs"]
        self.environment_inputs[:] = [
            variable.start for variable in vehicle.model.environment_inputs
        ]
        # memoryviews: access to a few numbers is faster than with NumPy
        self.bullet_twist: Any = arrays["bullet_twist"].data
        self.commanded_twist: Any = arrays["commanded_twist"].data
        self.compensating_torque: Any = (
            arrays["compensating_torque"].data if "compensating_torque" in arrays else None
        )
        self.predict = equations.bind("contact_predict", arrays)
        self.correct = equations.bind("contact_correct", arrays)
        equations.bind("contact_initialize", arrays)()
        self.correct()
        self.body_id = self._create_body(vehicle)
        self.reset_pose()

    def _create_body(self, vehicle: VehiclePlacement) -> int:
        """Create the body in Bullet and return its number."""
        body = vehicle.body
        shape, maximal = (
            create_compound_shape(body.boxes, self._client),
            self.USE_MAXIMAL_COORDINATES,
        )
        number = pybullet.createMultiBody(
            body.mass, shape, -1, useMaximalCoordinates=maximal, physicsClientId=self._client
        )
        set_dynamics(self._client, number, -1, vehicle.surface, body)
        return int(number)

    @staticmethod
    def bounding_box(body: Body) -> BoundingBox:
        """Return a box around the centre of mass that contains the body at every attitude."""
        radius = float(max(np.linalg.norm(box.corners(), axis=1).max() for box in body.boxes))
        return BoundingBox((-radius, -radius, -radius), (radius, radius, radius))

    def reset_pose(self) -> None:
        """Move the body in Bullet to its pose at the start of the step."""
        pose = self._arrays["bullet_pose"].tolist()
        pybullet.resetBasePositionAndOrientation(self.body_id, pose[0:3], pose[3:7], self._client)

    def set_active(self, active: bool) -> None:
        """Move the body in Bullet to its pose, or out of the reach of all vehicles."""
        if active:
            self.reset_pose()
        else:
            position = [INACTIVE_POSITION + INACTIVE_SPACING * self.body_id, 0.0, 0.0]
            pybullet.resetBasePositionAndOrientation(
                self.body_id, position, IDENTITY_QUATERNION, self._client
            )

    def describe_invalid_state(self) -> str:
        """Return a message about the first input that is not finite, or the largest state."""
        names = [
            *self.model.slots("input"),
            *(variable.name for variable in self.model.environment_inputs),
        ]
        for name, value in zip(
            names, np.concatenate([*self.inputs, self.environment_inputs]), strict=True
        ):
            if not math.isfinite(value):
                return f"{self.name}.{name} is {value}, expected a finite number"
        predicted = self._arrays["predicted_state"]
        worst = int(np.argmax(np.nan_to_num(np.abs(predicted), nan=np.inf)))
        return (
            f"{self.name}.{self.model.states[worst]} became {predicted[worst]:g}: the motion has "
            "diverged"
        )


def state_sizes(model: Model, equations: CompiledEquations) -> dict[str, int]:
    """Return the arrays that hold the state of a vehicle in a world, as name to size."""
    functions = equations.functions
    sizes = functions["contact_predict"].sizes | functions["contact_correct"].sizes
    own = {name: size for name, size in sizes.items() if name not in _FIXED_ARRAYS}
    return own | {"outputs": len(model.slots("output"))}


#: tolerated vertical speed of a planar vessel in Bullet (m/s), and tolerated change of its height
#: before a reset (m)
MAX_SINK_RATE, MAX_HEAVE = 1e-4, 1e-9

_VERTICAL_VELOCITY = 2  # index in a twist
_MIN_SLOPE = 0.01  # of sink rate over lift: M / (m + M) for a load of mass m on a vessel of mass M
_pack_vector = struct.Struct("3d").pack_into


class FloatingBody(ContactBody):
    """A vessel in six degrees of freedom.

    Its equations predict with the contact impulse of the previous step.
    """

    def elevation_function(self, wave_count: int, waves: np.ndarray) -> Callable[[float], float]:
        """Return the elevation of the water at the vessel (m) as a function of the time (s).

        Args:
            wave_count: Number of wave components.
            waves: Table of the components, see `environment.sea.Sea.component_table`.
        """
        place_and_time, result = np.zeros(3), np.zeros(1)
        arrays = {
            "place_and_time": place_and_time,
            "wave_count": np.full(1, float(wave_count)),
            "waves": waves,
            "elevation": result,
        }
        call = self.equations.bind("water_elevation", arrays)
        arguments, elevations, outputs = place_and_time.data, result.data, self.outputs.data

        def elevation(time: float) -> float:
            _pack_vector(arguments, 0, outputs[0], outputs[1], time)
            call()
            return elevations[0]

        return elevation


class PlanarBody(ContactBody):
    """A vessel in the horizontal plane: heave, roll and pitch are zero under any load.

    Infinite moments of inertia lock roll and pitch in Bullet. Heave cannot be locked: the body
    receives a lift velocity that cancels the sink rate due to the load on the deck. The lift is
    predicted from the previous steps. If Bullet's body still sinks, the step is repeated with a
    lift improved by the secant method.
    """

    USE_MAXIMAL_COORDINATES = True  # the inertia about the world's z axis is constant

    @staticmethod
    def bounding_box(body: Body) -> BoundingBox:
        """Return a box around the centre of mass that contains the body at every yaw angle."""
        corners = np.concatenate([box.corners() for box in body.boxes])
        radius = float(np.hypot(corners[:, 0], corners[:, 1]).max())
        low, high = float(corners[:, 2].min()), float(corners[:, 2].max())
        return BoundingBox((-radius, -radius, low), (radius, radius, high))

    def _create_body(self, vehicle: VehiclePlacement) -> int:
        self._previous_vertical_load: Any = self._arrays["previous_vertical_load"].data
        #: lift and sink rate (m/s) of the previous attempt
        self._last_attempt = 0.0, 0.0
        infinite = 0.0  # Bullet's convention for an infinite moment of inertia
        body = vehicle.body._replace(inertia=(infinite, infinite, vehicle.body.inertia[2]))
        return super()._create_body(replace(vehicle, body=body))

    def height_converged(self, repeats: int) -> bool:
        """Return whether the vessel keeps its height in Bullet's step.

        If not, improve the lift for the next attempt.

        Args:
            repeats: Number of attempts before this one.
        """
        lift, sink_rate = (
            self.commanded_twist[_VERTICAL_VELOCITY],
            -self.bullet_twist[_VERTICAL_VELOCITY],
        )
        (last_lift, last_sink_rate), self._last_attempt = self._last_attempt, (lift, sink_rate)
        if not MAX_SINK_RATE < abs(sink_rate) < math.inf:
            return True
        slope = (
            (last_sink_rate - sink_rate) / (lift - last_lift)
            if repeats and lift != last_lift
            else 1.0
        )
        self.commanded_twist[_VERTICAL_VELOCITY] = lift + sink_rate / min(
            max(slope, _MIN_SLOPE), 1.0
        )
        return False

    def reset_height(self) -> None:
        """Remove the heave that has accumulated in Bullet over the previous steps."""
        if abs(self._previous_vertical_load[1]) > MAX_HEAVE:
            self.reset_pose()
            self._previous_vertical_load[1] = 0.0


def body_class(model: Model) -> type[ContactBody]:
    """Return the contact body class for the motion of `model`."""
    if model.motion == "planar":
        return PlanarBody
    return FloatingBody if model.is_vessel else ContactBody
