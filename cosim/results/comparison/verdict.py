"""Verdicts of a comparison with a reference."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from ...core.text import count_noun

#: largest number of failures that `Comparison.shortened` lists
MAX_LISTED_FAILURES = 10


class Verdict(NamedTuple):
    """Verdict on one signal.

    Attributes:
        signal: Name of the signal.
        problem: Description of the first deviation; "" if the signal passes.
        time: Time of the first deviation (s): -inf if it has no time, inf if there is none.
        excess: Largest distance outside the tube in half heights of the tube; inf if nothing can be
            compared or the height is 0. If no point is outside, a number from -1 (on the reference)
            to 0 (half a height from it).
    """

    signal: str
    problem: str = ""
    time: float = -math.inf
    excess: float = math.inf

    @property
    def passed(self) -> bool:
        """True if the signal has no problem."""
        return not self.problem

    def __str__(self) -> str:
        return f"{self.signal} {self.problem or 'stays in its tube'}"


@dataclass(frozen=True)
class Comparison:
    """Verdicts on the whole comparison and on patterns, followed by those on all signals in the order of the reference."""

    verdicts: tuple[Verdict, ...]

    @property
    def passed(self) -> bool:
        """True if at least one signal was compared and all passed."""
        return bool(self.verdicts) and all(verdict.passed for verdict in self.verdicts)

    @property
    def failures(self) -> list[Verdict]:
        """Verdicts that failed, the earliest first."""
        return sorted(
            (verdict for verdict in self.verdicts if not verdict.passed),
            key=lambda verdict: verdict.time,
        )

    @property
    def worst(self) -> list[Verdict]:
        """Verdicts on all signals that were compared with a tube, the largest excess first."""
        return sorted(
            (verdict for verdict in self.verdicts if verdict.time > -math.inf),
            key=lambda verdict: -verdict.excess,
        )

    def __str__(self) -> str:
        """Return a summary in one line, and one line per failure."""
        return "\n".join(self._lines(len(self.verdicts)))

    def shortened(self) -> str:
        """Return the same with the earliest failures only, and the number of those left out."""
        return "\n".join(self._lines(MAX_LISTED_FAILURES))

    def _lines(self, listed: int) -> list[str]:
        failures = self.failures
        if not self.verdicts:
            return ["nothing was compared"]
        if not failures:
            return [f"{count_noun(len(self.verdicts), 'signal')} compared, none leaves its tube"]
        more = [f"... and {len(failures) - listed} more"] if len(failures) > listed else []
        return [
            f"{len(failures)} of {count_noun(len(self.verdicts), 'signal')} failed",
            *map(str, failures[:listed]),
            *more,
        ]
