"""One component's step within a macro step, as a sequence of prepared calls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..core.component import SUCCESS_STATUSES, PreparedCall
from ..process import float_mode
from .plan import Step


class ScheduledStep(NamedTuple):
    """A component's step as calls that return an FMI status.

    `first_call` is the number of the first call.
    """

    step: Step
    calls: Sequence[PreparedCall]
    first_call: int


class StepFailure(NamedTuple):
    """Call `call_index` of a step that returned `status`.

    A status None means that it changed the floating-point mode.
    """

    step: ScheduledStep
    call_index: int
    status: int | None

    @property
    def call(self) -> PreparedCall:
        """The call that failed."""
        return self.step.calls[self.call_index]


def run_due(steps: Sequence[ScheduledStep], n: int) -> list[StepFailure]:
    """Run the steps that are due in macro step `n`, in order, and return those that stopped early."""
    return [failure for step in steps if n % step.step.divisor == 0 for failure in _run_calls(step)]


def _run_calls(step: ScheduledStep) -> Iterator[StepFailure]:
    for index, call in enumerate(step.calls):
        status = call.function(*call.arguments)
        if status not in SUCCESS_STATUSES:
            yield StepFailure(step, index, status)
            break
    if float_mode.is_changed() or float_mode.enabled_traps():
        float_mode.set_default()
        yield StepFailure(step, -1, None)
