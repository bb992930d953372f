"""Vessel autopilot with names and units of its own.

North-east-down axes, degrees, knots and kilonewtons, no declared units.
"""

from __future__ import annotations

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class NedAutopilot(Fmi2Slave):
    """Line-of-sight guidance along a line to the north-east, with proportional control."""

    description = "Follows the line north = east"

    def __init__(self, **arguments: object):
        super().__init__(**arguments)
        self.pos_north, self.pos_east, self.vel_u_kn, self.psi_deg, self.r_deg_s = (
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        )
        self.speed_kn, self.lookahead = 2.0, 6.0
        self.tau_kN, self.delta_deg = 0.0, 0.0
        for name in ("pos_north", "pos_east", "vel_u_kn", "psi_deg", "r_deg_s"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in ("speed_kn", "lookahead"):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
            )
        for name in ("tau_kN", "delta_deg"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute thrust and rudder angle from the inputs at the start of the step."""
        cross_track = (self.pos_east - self.pos_north) / 2**0.5
        reference = 45.0 - 45.0 * max(-1.0, min(1.0, cross_track / self.lookahead))
        error = (reference - self.psi_deg + 180.0) % 360.0 - 180.0
        self.delta_deg = max(-35.0, min(35.0, 1.5 * error - 0.8 * self.r_deg_s))
        self.tau_kN = max(-0.003, min(0.003, 0.04 * (self.speed_kn - self.vel_u_kn)))
        return True
