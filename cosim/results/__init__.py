"""The product of a run: its signals and figures of merit, and the files they are kept in."""

from .result import KpiError, Kpis, Result, SignalError, write_run

__all__ = ["KpiError", "Kpis", "Result", "SignalError", "write_run"]
