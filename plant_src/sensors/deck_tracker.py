"""Estimator of the motion of a landing deck.

Its measurements come from the vessel's GNSS receiver and from a marker on the deck.
"""

from collections.abc import Sequence

from .navigation import History
from .rotations import add_scaled, difference, to_world
from .signal_component import SignalComponent
from .variable_declarations import pose_inputs, real_variable, share_parameter, vector_variables

#: inputs by quantity
_VEHICLE_POSE, _FIX_POSITION, _FIX_VELOCITY = slice(0, 7), slice(7, 10), slice(10, 13)
_FIX_TIME, _SIGHT_POSITION, _SIGHT_TIME = 13, slice(14, 17), 17
#: entries of the history by quantity
_POSITION, _VELOCITY = slice(0, 3), slice(3, 6)
_VEHICLE_POSITION, _VEHICLE_ORIENTATION = slice(6, 9), slice(9, 13)


class DeckTracker(SignalComponent):
    """Filter with fixed gains for position and velocity of a deck.

    It is an alpha-beta filter for delayed measurements (Bar-Shalom, Li and Kirubarajan, "Estimation
    with Applications to Tracking and Navigation", 2001, chapter 6). Between measurements the
    position is extrapolated with the velocity. A GNSS fix corrects position and velocity, a marker
    measurement corrects the position, each by its gain times the error at the time of the sample.
    The pose of the vehicle at that time converts the marker measurement to the world frame. Near
    the marker the estimate is therefore relative to the estimated pose of the vehicle.

    Inputs: `vehicle.position` (m, world) and `vehicle.orientation` (estimated pose),
    `gnss.position`, `.velocity`, `.time` (of the deck), `marker.position`, `.time` (of a
    `MarkerCamera`). Outputs: `position.x|y|z` (m, world), `velocity.x|y|z` (m/s, world).

    Args:
        instance_name: Name of the component.
    """

    state_attributes = ("_position", "_velocity", "_history", "_fix_time", "_sight_time")
    _position: Sequence[float]
    _velocity: Sequence[float]

    def __init__(self, instance_name: str):
        super().__init__(
            instance_name,
            [
                *pose_inputs("vehicle"),
                *vector_variables("gnss.position", "xyz", "m", "input"),
                *vector_variables("gnss.velocity", "xyz", "m/s", "input"),
                real_variable("gnss.time", "s", "input"),
                *vector_variables("marker.position", "xyz", "m", "input"),
                real_variable("marker.time", "s", "input"),
                share_parameter(
                    "fix_gain", 0.2, "share of the position error that a fix takes away"
                ),
                share_parameter(
                    "velocity_gain", 0.6, "share of the velocity error that a fix takes away"
                ),
                share_parameter(
                    "sight_gain", 0.2, "share of the position error that a sight takes away"
                ),
                *vector_variables("position", "xyz", "m", "output"),
                *vector_variables("velocity", "xyz", "m/s", "output"),
            ],
        )

    def initialise(self) -> None:
        """Start from the first fix."""
        i = self.inputs
        self._position, self._velocity = i[_FIX_POSITION], i[_FIX_VELOCITY]
        self._history, self._fix_time, self._sight_time = History(), i[_FIX_TIME], i[_SIGHT_TIME]
        self.outputs = (*self._position, *self._velocity)

    def advance(self, now: float, step_size: float) -> None:
        """Extrapolate by one step, then apply new measurements in the order of their times."""
        i, p = self.inputs, self.parameters
        self._position = add_scaled(self._position, step_size, self._velocity)
        self._history.add(now, (*self._position, *self._velocity, *i[_VEHICLE_POSE]))
        for time in sorted({i[_FIX_TIME], i[_SIGHT_TIME]} - {self._fix_time, self._sight_time}):
            past = self._history.at(time)
            if time == i[_FIX_TIME]:
                self._correct_position(i[_FIX_POSITION], past, p["fix_gain"])
                self._velocity = _corrected(
                    self._velocity, i[_FIX_VELOCITY], past[_VELOCITY], p["velocity_gain"]
                )
            if time == i[_SIGHT_TIME]:
                offset = to_world(past[_VEHICLE_ORIENTATION], i[_SIGHT_POSITION])
                position = add_scaled(past[_VEHICLE_POSITION], 1.0, offset)
                self._correct_position(position, past, p["sight_gain"])
        self._fix_time, self._sight_time = i[_FIX_TIME], i[_SIGHT_TIME]
        self.outputs = (*self._position, *self._velocity)

    def _correct_position(
        self, measured: Sequence[float], past: Sequence[float], gain: float
    ) -> None:
        self._position = _corrected(self._position, measured, past[_POSITION], gain)


def _corrected(
    present: Sequence[float], measured: Sequence[float], past: Sequence[float], gain: float
) -> Sequence[float]:
    """Return the estimate plus `gain` times the error of the estimate when it was measured."""
    return add_scaled(present, gain, difference(measured, past))
