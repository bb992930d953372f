"""Estimator of the motion of a landing deck from the vessel's GNSS receiver and from a marker on the deck."""

from __future__ import annotations

from collections.abc import Sequence

from .history import History
from .rotations import Vector, to_world
from .signal_component import SignalComponent
from .variable_declarations import pose_inputs, real_parameter, real_variable, vector_variables

#: inputs by quantity
_VEHICLE_POSE, _FIX_POSITION, _FIX_VELOCITY, _FIX_TIME = (
    slice(0, 7),
    slice(7, 10),
    slice(10, 13),
    13,
)
_SIGHT_POSITION, _SIGHT_TIME = slice(14, 17), 17
#: entries of the history by quantity
_POSITION, _VELOCITY, _VEHICLE_POSITION, _VEHICLE_ORIENTATION = (
    slice(0, 3),
    slice(3, 6),
    slice(6, 9),
    slice(9, 13),
)


class DeckTracker(SignalComponent):
    """Filter with fixed gains for position and velocity of a deck (an alpha-beta filter for delayed measurements).

    Between measurements the position is extrapolated with the velocity. A GNSS fix corrects position and velocity, a marker
    measurement corrects the position, each by its gain times the error at the time of the sample. The pose of the vehicle at
    that time converts the marker measurement to the world frame. Near the marker the estimate is therefore relative to the
    estimated pose of the vehicle.

    Inputs: `vehicle.position` (m, world) and `vehicle.orientation` (estimated pose), `gnss.position`, `.velocity`, `.time` (of
    the deck), `marker.position`, `.time` (of a `MarkerCamera`). Outputs: `position.x|y|z` (m, world), `velocity.x|y|z` (m/s,
    world).

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
                real_parameter(
                    "fix_gain",
                    "1",
                    0.2,
                    "share of the position error that a fix takes away",
                    0.0,
                    1.0,
                ),
                real_parameter(
                    "velocity_gain",
                    "1",
                    0.6,
                    "share of the velocity error that a fix takes away",
                    0.0,
                    1.0,
                ),
                real_parameter(
                    "sight_gain",
                    "1",
                    0.2,
                    "share of the position error that a sight takes away",
                    0.0,
                    1.0,
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
        i, (x, y, z), (u, v, w) = self.inputs, self._position, self._velocity
        self._position = x + step_size * u, y + step_size * v, z + step_size * w
        self._history.add(now, (*self._position, *self._velocity, *i[_VEHICLE_POSE]))
        for time in sorted({i[_FIX_TIME], i[_SIGHT_TIME]} - {self._fix_time, self._sight_time}):
            past = self._history.at(time)
            if time == i[_FIX_TIME]:
                self._correct_position(i[_FIX_POSITION], past, self.parameters["fix_gain"])
                self._velocity = _corrected(
                    self._velocity,
                    i[_FIX_VELOCITY],
                    past[_VELOCITY],
                    self.parameters["velocity_gain"],
                )
            if time == i[_SIGHT_TIME]:
                offset = to_world(past[_VEHICLE_ORIENTATION], i[_SIGHT_POSITION])
                position = [
                    own + part for own, part in zip(past[_VEHICLE_POSITION], offset, strict=True)
                ]
                self._correct_position(position, past, self.parameters["sight_gain"])
        self._fix_time, self._sight_time = i[_FIX_TIME], i[_SIGHT_TIME]
        self.outputs = (*self._position, *self._velocity)

    def _correct_position(
        self, measured: Sequence[float], past: Sequence[float], gain: float
    ) -> None:
        self._position = _corrected(self._position, measured, past[_POSITION], gain)


def _corrected(
    present: Sequence[float], measured: Sequence[float], past: Sequence[float], gain: float
) -> Vector:
    """Return the present estimate plus `gain` times the error of the past estimate at the time of the measurement."""
    x, y, z = (a + gain * (b - c) for a, b, c in zip(present, measured, past, strict=True))
    return x, y, z
