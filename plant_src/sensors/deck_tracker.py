"""Where the deck is, from the vessel's own satellite receiver and, when it is seen, from the marker on it."""

from __future__ import annotations

from collections.abc import Sequence

from .history import History
from .rotations import Vector, to_world
from .signal_component import SignalComponent, pose_inputs, real_parameter, real_variable, vector_variables


class DeckTracker(SignalComponent):
    """`position.x|y|z` (m), `velocity.x|y|z` (m/s) of the deck: a filter with fixed gains.

    Between measurements the deck goes on with its velocity. A fix that the vessel radios, and a sight of the marker, which the
    vehicle's own pose at the time of the picture turns into a place, each take away a share of the error that there was at their
    time; the fix also that of the velocity. So near the marker what counts is the place of the deck relative to where the
    vehicle believes to be. Inputs: `vehicle` (the pose that navigation gives), `gnss` (of the deck) and `marker`, by their names.
    """

    state_attributes = ("_position", "_velocity", "_history", "_fix_time", "_sight_time")
    _position: Vector
    _velocity: Vector

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
                real_parameter("fix_gain", "1", 0.2, "share of the position error that a fix takes away", 0.0, 1.0),
                real_parameter("velocity_gain", "1", 0.6, "share of the velocity error that a fix takes away", 0.0, 1.0),
                real_parameter("sight_gain", "1", 0.2, "share of the position error that a sight takes away", 0.0, 1.0),
                *vector_variables("position", "xyz", "m", "output"),
                *vector_variables("velocity", "xyz", "m/s", "output"),
            ],
        )

    def initialise(self) -> None:
        i = self.inputs
        self._position, self._velocity = (i[7], i[8], i[9]), (i[10], i[11], i[12])
        self._history, self._fix_time, self._sight_time = History(), i[13], i[17]
        self.outputs = (*self._position, *self._velocity)

    def advance(self, now: float, step_size: float) -> None:
        i, (x, y, z), (u, v, w) = self.inputs, self._position, self._velocity
        self._position = x + step_size * u, y + step_size * v, z + step_size * w
        self._history.add(now, (*self._position, *self._velocity, *i[:7]))
        times = sorted({i[13], i[17]} - {self._fix_time, self._sight_time})
        for time in times:
            then = self._history.at(time)
            if time == i[13]:
                self._correct(i[7:10], then, self.parameters["fix_gain"])
                self._velocity = _corrected(self._velocity, i[10:13], then[3:6], self.parameters["velocity_gain"])
            if time == i[17]:
                a, b, c = to_world(then[9:13], i[14:17])
                self._correct((then[6] + a, then[7] + b, then[8] + c), then, self.parameters["sight_gain"])
        self._fix_time, self._sight_time = i[13], i[17]
        self.outputs = (*self._position, *self._velocity)

    def _correct(self, place: Sequence[float], then: Sequence[float], share: float) -> None:
        self._position = _corrected(self._position, place, then, share)


def _corrected(old: Sequence[float], wanted: Sequence[float], found: Sequence[float], share: float) -> Vector:
    """Old values, changed by a share of how far what was found is from what was wanted."""
    x, y, z = (a + share * (b - c) for a, b, c in zip(old, wanted, found[:3], strict=True))
    return x, y, z
