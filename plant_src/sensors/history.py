"""What was known at past moments: measurements that come late are compared with that."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

_TIME_TOLERANCE = 1e-9  # s, by which a moment may seem to lie before its time


class History:
    """Values by time, the newest `span` (s) of them."""

    def __init__(self, span: float = 1.0):
        self._span, self._entries = span, deque[tuple[float, Sequence[float]]]()

    def add(self, now: float, values: Sequence[float]) -> None:
        """Append the values at `now` (s), which is later than all before."""
        self._entries.append((now, values))
        if self._entries[0][0] < now - self._span:
            self._entries.popleft()

    def at(self, time: float) -> Sequence[float]:
        """The values at the first known moment that is not before `time` (s); the newest ones when all are."""
        found = self._entries[-1]
        for entry in reversed(self._entries):
            if entry[0] < time - _TIME_TOLERANCE:
                break
            found = entry
        return found[1]
