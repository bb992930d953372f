"""Messages of components on their way to the user, through Python's logging. A flood of them is cut and counted."""

from __future__ import annotations

import logging
import time

INFO, WARNING, ERROR = logging.INFO, logging.WARNING, logging.ERROR

#: messages per second that are passed on, and characters of one
PER_SECOND, LONGEST = 1000, 4000

_second, _passed, _cut = 0, 0, 0


def message(component: str, level: int, text: str) -> None:
    """Pass on what a component said; control characters are made harmless."""
    if not _has_room():
        return
    if len(text) > LONGEST:
        text = f"{text[:LONGEST]} ... and {len(text) - LONGEST} characters more"
    printable = "".join(c if c.isprintable() or c in "\n\t" else "\N{REPLACEMENT CHARACTER}" for c in text).rstrip()
    logging.getLogger("cosim.component").log(level, "%s: %s", component, printable)


def _has_room() -> bool:
    """Whether one more message may pass in this second; tells how many were cut when the next second begins."""
    global _second, _passed, _cut
    now = int(time.monotonic())
    if now != _second:
        _second, _passed = now, 0
        tell_what_was_cut()
    if _passed >= PER_SECOND:
        _cut += 1
        return False
    _passed += 1
    return True


def tell_what_was_cut() -> None:
    """Say how many messages were not passed on since it was said last."""
    global _cut
    if _cut:
        logging.getLogger("cosim.component").warning("%d messages of components were not shown", _cut)
        _cut = 0
