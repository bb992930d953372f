"""Base class of the replica's PythonFMU classes.

Variables by name, and PID loops whose gains and states are variables.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

from .pid import Pid

_PARAMETER: dict[str, Any] = {
    "causality": Fmi2Causality.parameter,
    "variability": Fmi2Variability.tunable,
}
_STATE: dict[str, Any] = {"causality": Fmi2Causality.local}


class ReplicaFmu(Fmi2Slave):
    """PythonFMU class that stores its real variables in `values`, by name."""

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.values: dict[str, float] = {}

    def declare_inputs(self, *names: str) -> None:
        """Declare inputs with the start value 0."""
        self._register(names, causality=Fmi2Causality.input)

    def declare_outputs(self, *names: str) -> None:
        """Declare outputs with the start value 0."""
        self._register(names, causality=Fmi2Causality.output)

    def declare_parameters(self, **values: float) -> None:
        """Declare tunable parameters with their start values."""
        self._register(values, **_PARAMETER)
        self.values |= values

    def declare_states(self, **values: float) -> None:
        """Declare internal states with their start values."""
        self._register(values, **_STATE)
        self.values |= values

    def register_pid(self, name: str, loop: Pid) -> Pid:
        """Declare gains and states of a loop as variables below `name` and return the loop."""
        for field in ("P", "I", "D", "N", "integral", "filtered"):
            kind = _PARAMETER if field.isupper() else _STATE
            access = {
                "getter": partial(getattr, loop, field),
                "setter": partial(setattr, loop, field),
            }
            self.register_variable(Real(f"{name}.{field}", **access, **kind))
        return loop

    def _register(self, names: Iterable[str], **kind: Any) -> None:
        for name in names:
            self.values[name] = 0.0
            access = {
                "getter": partial(self.values.__getitem__, name),
                "setter": partial(self.values.__setitem__, name),
            }
            self.register_variable(Real(name, **access, **kind))
