"""The controller of all loops: parallel PID with filtered derivative, integrated like the published one."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass
class Pid:
    """u = P e + I int(e) + D N/(1 + N/s) e, limited; N in rad/s.

    Between samples e is constant and the filter is integrated by the third-order method of the published simulator. With
    `clamping` the integral stops while the output is limited and e drives it further.
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
        """The limited output at this sample; then the states advance by `step_size` (s)."""
        damped = self.D * error
        wanted = self.P * error + self.integral + self.N * (damped - self.filtered)
        limited = min(self.upper, max(self.lower, wanted))
        if not (self.clamping and self.I * error * (wanted - limited) > 0):
            self.integral += step_size * self.I * error
        h = self.N * step_size
        self.filtered = damped + (self.filtered - damped) * (1 - h + h**2 / 2 - h**3 / 6)
        return limited
