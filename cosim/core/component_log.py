"""Log messages of components, passed to Python's logging with a limited rate."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

from .text import SPACES, escape_control_characters, shorten

#: logger of the messages of components
LOGGER_NAME = "cosim.component"
INFO, WARNING, ERROR = logging.INFO, logging.WARNING, logging.ERROR

#: maximum number of messages per second, and of characters per message
MAX_MESSAGES_PER_SECOND, MAX_MESSAGE_LENGTH = 1000, 4000

_current_second, _passed_count, _dropped_count = 0, 0, 0


def log_message(component: str, level: int, text: str) -> None:
    """Log a message of a component as one line; line breaks and control characters are escaped.

    Args:
        component: Name of the component.
        level: `INFO`, `WARNING` or `ERROR`.
        text: The message, which foreign code may have written.
    """
    if not _is_within_rate_limit():
        return
    text = escape_control_characters(shorten(text, MAX_MESSAGE_LENGTH).rstrip(), keep=SPACES)
    logging.getLogger(LOGGER_NAME).log(level, "%s: %s", component, text)


def discard_messages() -> None:
    """Discard all messages of components in this process."""
    logging.getLogger(LOGGER_NAME).disabled = True


@contextmanager
def discarding_messages() -> Iterator[None]:
    """Discard the messages of components within the block."""
    logger = logging.getLogger(LOGGER_NAME)
    disabled, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = disabled


def _is_within_rate_limit() -> bool:
    """Return whether one more message is permitted in this second.

    Report the dropped ones when a new second begins.
    """
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
    """Warn of the number of messages that were dropped since the last report."""
    global _dropped_count
    if _dropped_count:
        logging.getLogger(LOGGER_NAME).warning(
            "%d messages of components were not shown", _dropped_count
        )
        _dropped_count = 0
