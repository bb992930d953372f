"""The product of a run: its signals and figures of merit, and the files they are kept in."""

from .result import Result, SignalError, write_run

__all__ = ["Result", "SignalError", "write_run"]
