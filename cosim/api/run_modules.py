"""Modules that a run imports, for processes from which runs are forked."""

from __future__ import annotations

RUN_MODULES = (
    "cosim.api.execution",
    "cosim.components.fmi.isolated",
    "cosim.components.python_class",
    "cosim.components.python_fmu",
    "cosim.engine.native_executor",
    "cosim.kpis",
    "cosim.scenario.plausibility",
    "fmpy.fmi1",
    "fmpy.fmi2",
    "fmpy.fmi3",
    "numpy.random",
)
