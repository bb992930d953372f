"""Interface of the integrators of Model Exchange FMUs."""

from __future__ import annotations

import ctypes
from enum import IntFlag
from typing import NamedTuple, Protocol

from ....core.component import PreparedCall


class EventKind(IntFlag):
    """Reasons why an integration stops before the end of a communication step.

    The same numbers as in `_fixed_step.c`.
    """

    STATE = 1
    TIME = 2
    STEP = 4
    TERMINATION = 8


class StepEvent(NamedTuple):
    """Event at `time` (s)."""

    kind: EventKind
    time: float


class Integrator(Protocol):
    """Integrator of one FMU instance in Continuous-Time Mode."""

    @property
    def time(self) -> float:
        """Time (s) to which the FMU has been integrated."""

    def prepare_step(self, current_time: ctypes.c_double, step_size: float) -> PreparedCall:
        """Prepare a call that integrates one communication step.

        The call returns OK at its end and discard at an event or after a failure; called again, it
        continues.

        Args:
            current_time: Memory from which the call reads the start of the step (s).
            step_size: Length of the step (s).
        """

    def restart(self, time: float, next_event_time: float) -> None:
        """Continue after a discontinuity.

        Args:
            time: Time of the discontinuity (s).
            next_event_time: Time of the next time event (s); infinity if there is none.
        """

    def inputs_changed(self) -> None:
        """Take into account that the inputs of the next step are not those of the last one."""

    def take_event(self) -> StepEvent:
        """Return the event at which the last call stopped.

        Raises:
            IntegrationError: The last call failed.
        """

    def close(self) -> None:
        """Release the resources of the integrator."""
        return
