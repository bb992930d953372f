"""Messages of components on their way to the user, through Python's logging: one logger "cosim.NAME" per component."""

from __future__ import annotations

import logging

INFO, WARNING, ERROR = logging.INFO, logging.WARNING, logging.ERROR


def message(component: str, level: int, text: str) -> None:
    """Pass on what a component said; control characters are made harmless."""
    printable = "".join(c if c.isprintable() or c in "\n\t" else "\N{REPLACEMENT CHARACTER}" for c in text).rstrip()
    logging.getLogger("cosim.component").log(level, "%s: %s", component, printable)
