"""Sensors that measure at a rate of their own and tell it some time later."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from cosim.core.component import Variable

from .signal_component import SignalComponent, real_parameter, real_variable

#: part of a sample, and s, by which a moment may seem to lie before its time
_SAMPLE_TOLERANCE, _TIME_TOLERANCE = 1e-6, 1e-9

Measurement = tuple[Sequence[float], Sequence[bool]]


class SampledSensor(SignalComponent):
    """Sample n is taken at the first step that ends at or after start + n / rate, and is put out `latency` (s) later.

    Sample 0 is there from the start. The last real output is the `time` (s) at which the sample that is shown was taken.
    """

    state_attributes: tuple[str, ...] = ("_number", "_sample_time", "_pending")

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Real outputs (without `time`) and flags of sample `number`, `elapsed` (s) after the last sample (0: the first one).

        Without real outputs those of the last sample that had some stay, with their time.
        """
        raise NotImplementedError

    def initialise(self) -> None:
        self._number, self._sample_time, self._pending = 0, self.start_time, deque[tuple[float, float, Measurement]]()
        self.outputs = (0.0,) * len(self.outputs)
        self._publish(self.start_time, self.measure(0, 0.0))

    def advance(self, now: float, step_size: float) -> None:
        number = int((now - self.start_time) * self.parameters["rate"] + _SAMPLE_TOLERANCE)
        if number > self._number:
            measurement = self.measure(number, now - self._sample_time)
            self._number, self._sample_time = number, now
            self._pending.append((now + self.parameters["latency"] - _TIME_TOLERANCE, now, measurement))
        while self._pending and self._pending[0][0] <= now:
            _, taken, measurement = self._pending.popleft()
            self._publish(taken, measurement)

    def _publish(self, taken: float, measurement: Measurement) -> None:
        values, self.flags = measurement
        if values:
            self.outputs = (*values, taken)


def timing_variables(rate: float, latency: float = 0.0) -> list[Variable]:
    """The parameters of a sampled sensor, and its output `time`, which comes last."""
    return [
        real_variable("rate", "Hz", "parameter", rate, "samples per second", minimum=1e-3, variability="fixed"),
        real_parameter("latency", "s", latency, "from the sample to its output"),
        real_variable("time", "s", "output", description="when the sample was taken"),
    ]
