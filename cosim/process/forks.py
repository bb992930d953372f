"""Forks of this process by foreign code.

They are reported, and a copy that returns from the foreign call is ended.

A copy must not continue the run: it would write the same files. In a supervised process the journal
is not mapped in copies (see `Journal.exclude_from_forks`), so that the first access to it, which
follows each call, ends them. Elsewhere a copy ends with the block of `attributing_forks` in which
it was made.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from functools import cache

from ..core import component_log

#: returns component and function of the present call
CallDescription = Callable[[], tuple[str, str]]

_describe_call: CallDescription | None = None
#: calls that have forked this process, and whether they were reported
_noted_calls: dict[tuple[str, str], bool] = {}


class attributing_forks:  # noqa: N801  # a generator as context manager would take twice as long
    """Attribute forks in the block to the present call, and end a copy of this process that reaches the end of the block."""

    def __init__(self, describe_call: CallDescription | None):
        """Prepare the block.

        Args:
            describe_call: Returns component and function of the present call; None for forks that
                are not made by foreign code.
        """
        self._inner = describe_call

    def __enter__(self) -> None:
        global _describe_call
        self._process, self._outer, _describe_call = os.getpid(), _describe_call, self._inner

    def __exit__(self, *error: object) -> None:
        global _describe_call
        _describe_call = self._outer
        if os.getpid() != self._process:
            os._exit(1)


def report_forks() -> None:
    """Warn once of each call that has forked this process."""
    for (component, function), reported in _noted_calls.items():
        if not reported:
            text = f"{function} forked the process; a copy that returns from the call is ended"
            component_log.log_message(component, component_log.WARNING, text)
            _noted_calls[component, function] = True


@cache
def watch_forks() -> None:
    """Note the present call at each fork from now on.

    For processes that end without finalizing the interpreter.
    """
    library = ctypes.CDLL(None)
    register = getattr(library, "pthread_atfork", None) or getattr(
        library, "__register_atfork", None
    )
    if register:
        register(None, _note_fork_callback, None, None)


def _note_fork() -> None:
    """Note the present call; called in the process that forks, after the fork."""
    if _describe_call:
        _noted_calls.setdefault(_describe_call(), False)


_note_fork_callback = ctypes.CFUNCTYPE(None)(_note_fork)
