"""Contact bodies of vessels: floating in six degrees of freedom, or in the horizontal plane."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..vehicles.common.shapes import Body
from .body import ContactBody
from .clearance import BoundingBox

if TYPE_CHECKING:
    from ..placement import VehiclePlacement
    from ..vehicles.model import Model

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
        """Return a function of time (s) for the water elevation (m, above still water) at the vessel.

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
