"""Base class of sensors with their own sample rate and latency."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from cosim.core.component import Variable

from .signal_component import SignalComponent
from .variable_declarations import real_parameter, real_variable

#: rounding errors of a sample number and of a time (s)
_SAMPLE_TOLERANCE, _TIME_TOLERANCE = 1e-6, 1e-9

#: values of the real outputs without `time`, and of the Boolean outputs
Measurement = tuple[Sequence[float], Sequence[bool]]


class SampledSensor(SignalComponent):
    """Sensor with a sample rate and a latency.

    The last real output is the `time` (s) of the sample.

    Sample n is taken at the end of the first step that reaches start + n / `rate` and is published
    `latency` (s) later. Sample 0 is published at the start.
    """

    state_attributes: tuple[str, ...] = ("_number", "_sample_time", "_pending")

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Take a sample.

        Args:
            number: Number of the sample; selects the row of random numbers.
            elapsed: Time since the last sample (s), 0 for the first one.

        Returns:
            Real outputs without `time`, and Boolean outputs. Empty real outputs leave the last
            values and their time.
        """
        raise NotImplementedError

    def initialise(self) -> None:
        """Take and publish sample 0."""
        self._number, self._sample_time, self._pending = (
            0,
            self.start_time,
            deque[tuple[float, float, Measurement]](),
        )
        self.outputs = (0.0,) * len(self.outputs)
        self._publish(self.start_time, self.measure(0, 0.0))

    def advance(self, now: float, step_size: float) -> None:
        """Take a sample that is due and publish those whose latency has passed."""
        number = int((now - self.start_time) * self.parameters["rate"] + _SAMPLE_TOLERANCE)
        if number > self._number:
            measurement = self.measure(number, now - self._sample_time)
            self._number, self._sample_time = number, now
            self._pending.append(
                (now + self.parameters["latency"] - _TIME_TOLERANCE, now, measurement)
            )
        while self._pending and self._pending[0][0] <= now:
            _, taken, measurement = self._pending.popleft()
            self._publish(taken, measurement)

    def _publish(self, taken: float, measurement: Measurement) -> None:
        values, self.flags = measurement
        if values:
            self.outputs = (*values, taken)


def timing_variables(rate: float, latency: float = 0.0) -> list[Variable]:
    """Declare the parameters `rate` (Hz) and `latency` (s) and the output `time`, which must be the last real output."""
    return [
        real_variable(
            "rate", "Hz", "parameter", rate, "samples per second", minimum=1e-3, variability="fixed"
        ),
        real_parameter("latency", "s", latency, "from the sample to its output"),
        real_variable("time", "s", "output", description="when the sample was taken"),
    ]
