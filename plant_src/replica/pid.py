"""PID controller of all loops, with the integration method of the published simulator."""

from __future__ import annotations

import math
from dataclasses import dataclass


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
