"""Base class of the replica's PythonFMU classes, with variables by name, and their PID loops."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


@dataclass
class Pid:
    """Parallel PID controller u = P e + I int(e) + D N/(1 + N/s) e with output limits; N in rad/s.

    The error e is constant between samples. The derivative filter is integrated by the third-order
    Runge-Kutta method of the published simulator. With `clamping` the integral stops while the
    output is limited and e would drive it further.
    """

    P: float
    I: float = 0.0  # noqa: E741
    D: float = 0.0
    N: float = 100.0
    lower: float = -math.inf
    upper: float = math.inf
    clamping: bool = False
    integral: float = 0.0
    filtered: float = 0.0

    def step(self, error: float, step_size: float) -> float:
        """Return the limited output at this sample, then advance the states by `step_size` (s)."""
        damped = self.D * error
        unlimited = self.P * error + self.integral + self.N * (damped - self.filtered)
        limited = min(self.upper, max(self.lower, unlimited))
        if not (self.clamping and self.I * error * (unlimited - limited) > 0):
            self.integral += step_size * self.I * error
        h = self.N * step_size
        self.filtered = damped + (self.filtered - damped) * (1 - h + h**2 / 2 - h**3 / 6)
        return limited


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
