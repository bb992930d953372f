"""One component's turn in a macro step, and how it may end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from ..core.component import GOOD, Call
from ..process import float_mode
from .plan import Step

#: components or outputs shown in messages about several
SHOWN = 8


def shown(names: Iterable[str]) -> str:
    """The names, each once; of many the first ones and how many there are."""
    different = list(dict.fromkeys(names))
    return ", ".join(different[:SHOWN]) + (f", ... ({len(different)} in all)" if len(different) > SHOWN else "")


class Turn(NamedTuple):
    """One component's turn as calls that return an FMI status; `first` is the number of the first call."""

    step: Step
    calls: Sequence[Call]
    first: int


class Ending(NamedTuple):
    """A turn that stopped: after which of its calls, and its status; None: the floating-point mode was changed."""

    turn: Turn
    place: int
    status: int | None

    @property
    def call(self) -> Call:
        return self.turn.calls[self.place]


def take(turns: Sequence[Turn], n: int) -> list[Ending]:
    """Take the turns that are due in macro step n, one after the other; those that stopped are returned."""
    return [ending for turn in turns if n % turn.step.divisor == 0 for ending in _take(turn)]


def _take(turn: Turn) -> Iterator[Ending]:
    for place, call in enumerate(turn.calls):
        status = call.function(*call.arguments)
        if status not in GOOD:
            yield Ending(turn, place, status)
            break
    if float_mode.changed():
        yield Ending(turn, -1, None)
