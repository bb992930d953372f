"""Results of a run: signals, KPIs, checks, their files, and comparison with a reference."""

from .result import KpiError, Kpis, Result, RunMetadata, SignalError, write_run

__all__ = ["KpiError", "Kpis", "Result", "RunMetadata", "SignalError", "write_run"]
