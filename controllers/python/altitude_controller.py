"""Altitude loop: from altitude reference to the common throttle of the rotors."""

from __future__ import annotations

import math
from typing import Any

from .fleet import GRAVITY, MAX_ROTOR_SPEED
from .fleet.pid import Pid
from .fleet.sampled_controller import SampledController


class AltitudeController(SampledController):
    """PID from altitude error (m) to throttle (%); its integral starts at the hover throttle.

    Gains of the published simulator, the same in controllers/modelica/AltitudeController.mo.
    """

    description = "Altitude loop: from altitude reference to the common throttle of the rotors"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter("altitude_P", 170.242040782586, "%/m", "Throttle per altitude error")
        self.parameter("altitude_I", 28.86184465251, "%/(m.s)", "Throttle rate per altitude error")
        self.parameter("altitude_D", 50.0, "%.s/m", "Throttle per rate of the altitude error")
        self.parameter("altitude_N", 50.0, "rad/s", "Bandwidth of the derivative filter")
        self.parameter("throttle_min", 35.0, "%")
        self.parameter("throttle_max", 90.0, "%")
        self.parameter("mass", 0.441, "kg", "Of the quadcopter, as the controller believes it")
        self.parameter(
            "thrust_coefficient", 8.24e-6, "N.s2/rad2", "Thrust of a rotor over its squared speed"
        )
        self.calculated_parameter(
            "hover_throttle",
            self._hover_throttle,
            "%",
            "Throttle that carries the weight: the integral starts there",
        )
        self.input("vehicle.position.z", 0.0, "m", "Up")
        self.input("altitude_reference", 0.0, "m", "Of the centre of mass")
        self.input("reset", False, description="Holds the loop in its start state: hover throttle")
        self.output("throttle", 0.0, "%")
        self.climb = self.add_block("climb", Pid())

    def tick(self, time: float) -> None:
        """Compute the throttle."""
        self.throttle = self.climb(
            self.altitude_reference - self.vehicle.position.z,
            reset=self.reset,
            P=self.altitude_P,
            I=self.altitude_I,
            D=self.altitude_D,
            N=self.altitude_N,
            limits=(self.throttle_min, self.throttle_max),
            start=self._hover_throttle(),
        )

    def _hover_throttle(self) -> float:
        """Return the throttle (%) at which four rotors carry the weight."""
        return (
            100 / MAX_ROTOR_SPEED * math.sqrt(self.mass * GRAVITY / (4 * self.thrust_coefficient))
        )
