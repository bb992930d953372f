"""Measurement of wall time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter


class Stopwatch:
    """Accumulated wall time (s) by name of the measured part."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def measure(self, part: str) -> Iterator[None]:
        """Add the duration of the block to `part`, also if the block raises."""
        began = perf_counter()
        try:
            yield
        finally:
            self.add(part, perf_counter() - began)

    def add(self, part: str, seconds: float) -> None:
        """Add a duration (s) to `part`."""
        self.seconds[part] = self.seconds.get(part, 0.0) + seconds
