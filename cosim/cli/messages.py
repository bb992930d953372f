"""What components say while they run, and warnings about the scenario, go to standard error."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable

from ..core.errors import Problem

#: warnings that are kept for the report
MAX_WARNINGS = 200


class _WarningCollector(logging.Handler):
    """Keeps the texts of warnings and errors."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if len(self.texts) < MAX_WARNINGS:
            self.texts.append(f"{record.levelname} {record.getMessage()}")


def print_log(level: int = logging.INFO) -> list[str]:
    """Print messages of components from now on; the list returned grows by the text of each warning and error among them."""
    handler, keeper = logging.StreamHandler(sys.stderr), _WarningCollector()
    handler.setFormatter(logging.Formatter("%(levelname)s %(message)s"))
    logger = logging.getLogger("cosim")
    logger.handlers[:] = [handler, keeper]
    logger.setLevel(level)
    return keeper.texts


def log_problems(problems: Iterable[Problem]) -> None:
    """Print problems that do not keep anything from running, as `show` prints the warnings of components."""
    for problem in problems:
        logging.getLogger("cosim").warning("%s", problem)
