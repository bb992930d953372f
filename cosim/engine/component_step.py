"""One component's turn in a macro step, and how it may end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..core.component import SUCCESS_STATUSES, PreparedCall
from ..process import float_mode
from .plan import Step


class ScheduledStep(NamedTuple):
    """One component's turn as calls that return an FMI status; `first` is the number of the first call."""

    step: Step
    calls: Sequence[PreparedCall]
    first_call: int


class StepFailure(NamedTuple):
    """A turn that stopped: after which of its calls, and its status; None: the floating-point mode was changed."""

    step: ScheduledStep
    call_index: int
    status: int | None

    @property
    def call(self) -> PreparedCall:
        return self.step.calls[self.call_index]


def run_due(turns: Sequence[ScheduledStep], n: int) -> list[StepFailure]:
    """Take the turns that are due in macro step n, one after the other; those that stopped are returned."""
    return [ending for turn in turns if n % turn.step.divisor == 0 for ending in _run_calls(turn)]


def _run_calls(turn: ScheduledStep) -> Iterator[StepFailure]:
    for place, call in enumerate(turn.calls):
        status = call.function(*call.arguments)
        if status not in SUCCESS_STATUSES:
            yield StepFailure(turn, place, status)
            break
    if float_mode.is_changed():
        yield StepFailure(turn, -1, None)
