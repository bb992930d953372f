"""Past values of the arguments of delay(), for the interpreter; see past.h."""

from __future__ import annotations

#: number of stored values
PAST_VALUES = 2048


class PastValues:
    """Ring buffer of the values of the argument of a delay()."""

    def __init__(self) -> None:
        self._values: list[tuple[float, float]] = []

    def record(self, time: float, value: float, spacing: float) -> None:
        """Append a value; see `record_value` in past.h."""
        values = self._values
        if values and values[-1] == (time, value):
            return
        if (
            len(values) > 1
            and values[-1][0] < time
            and time - values[-2][0] < spacing
            and values[-2][0] < values[-1][0]
        ):
            values[-1] = (time, value)
            return
        values.append((time, value))
        del values[:-PAST_VALUES]

    def value(self, time: float) -> float:
        """Return the value at a time by linear interpolation; see `past_value` in past.h."""
        low, high, at = 0, len(self._values), time + 1e-12 * (1 + abs(time))
        while high - low > 1:
            middle = (low + high) // 2
            if self._values[middle][0] <= at:
                low = middle
            else:
                high = middle
        start, value = self._values[low]
        if low + 1 >= len(self._values) or time <= start:
            return value
        end, next_value = self._values[low + 1]
        return value + (next_value - value) * ((time - start) / (end - start))
