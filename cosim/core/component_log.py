"""Messages of components on their way to the user, through Python's logging. A flood of them is cut and counted."""

from __future__ import annotations

import logging
import time

INFO, WARNING, ERROR = logging.INFO, logging.WARNING, logging.ERROR

#: messages per second that are passed on, and characters of one
MAX_MESSAGES_PER_SECOND, MAX_MESSAGE_LENGTH = 1000, 4000

_current_second, _passed_count, _dropped_count = 0, 0, 0


def log_message(component: str, level: int, text: str) -> None:
    """Pass on what a component said; control characters are made harmless."""
    if not _is_within_rate_limit():
        return
    if len(text) > MAX_MESSAGE_LENGTH:
        text = f"{text[:MAX_MESSAGE_LENGTH]} ... and {len(text) - MAX_MESSAGE_LENGTH} characters more"
    printable = "".join(c if c.isprintable() or c in "\n\t" else "\N{REPLACEMENT CHARACTER}" for c in text).rstrip()
    logging.getLogger("cosim.component").log(level, "%s: %s", component, printable)


def _is_within_rate_limit() -> bool:
    """Whether one more message may pass in this second; tells how many were cut when the next second begins."""
    global _current_second, _passed_count, _dropped_count
    now = int(time.monotonic())
    if now != _current_second:
        _current_second, _passed_count = now, 0
        report_dropped_messages()
    if _passed_count >= MAX_MESSAGES_PER_SECOND:
        _dropped_count += 1
        return False
    _passed_count += 1
    return True


def report_dropped_messages() -> None:
    """Say how many messages were not passed on since it was said last."""
    global _dropped_count
    if _dropped_count:
        logging.getLogger("cosim.component").warning("%d messages of components were not shown", _dropped_count)
        _dropped_count = 0
