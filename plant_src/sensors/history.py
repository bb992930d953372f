"""Short-term memory of estimates, for measurements that arrive with a latency."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

_TIME_TOLERANCE = 1e-9  # s, rounding error of times


class History:
    """Values of the last `span` (s) by time."""

    def __init__(self, span: float = 1.0):
        self._span, self._entries = span, deque[tuple[float, Sequence[float]]]()

    def add(self, now: float, values: Sequence[float]) -> None:
        """Append the values at `now` (s), which must be later than all stored times."""
        self._entries.append((now, values))
        if self._entries[0][0] < now - self._span:
            self._entries.popleft()

    def at(self, time: float) -> Sequence[float]:
        """Return the oldest values stored at or after `time` (s).

        The newest ones if all are older.
        """
        result = self._entries[-1]
        for entry in reversed(self._entries):
            if entry[0] < time - _TIME_TOLERANCE:
                break
            result = entry
        return result[1]
