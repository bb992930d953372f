"""Printing of log messages of components and of warnings about the scenario to standard error."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable

from ..core.errors import Problem

#: number of warnings collected for the report
MAX_WARNINGS = 200


class _WarningCollector(logging.Handler):
    """Handler that collects the texts of warnings and errors."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Collect a message unless there are too many."""
        if len(self.texts) < MAX_WARNINGS:
            self.texts.append(f"{record.levelname} {record.getMessage()}")


def print_log(level: int = logging.INFO) -> list[str]:
    """Print all following messages of the logger "cosim"; return the list that collects the texts of warnings and errors."""
    handler, collector = logging.StreamHandler(sys.stderr), _WarningCollector()
    handler.setFormatter(logging.Formatter("%(levelname)s %(message)s"))
    logger = logging.getLogger("cosim")
    logger.handlers[:] = [handler, collector]
    logger.setLevel(level)
    return collector.texts


def log_problems(problems: Iterable[Problem]) -> None:
    """Log problems that do not prevent a run as warnings."""
    for problem in problems:
        logging.getLogger("cosim").warning("%s", problem)
