"""What components say while they run goes to standard error."""

from __future__ import annotations

import logging
import sys


def show(level: int = logging.INFO) -> None:
    """Print messages of components from now on."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(levelname)s %(message)s"))
    logger = logging.getLogger("cosim")
    logger.handlers[:] = [handler]
    logger.setLevel(level)
