"""Control mixing: from throttle and its differences to the rotor speeds of a "+" frame."""

from __future__ import annotations

from typing import Any

from .fleet import MAX_ROTOR_SPEED, limit
from .fleet.sampled_controller import SampledController


class Mixer(SampledController):
    """Mixer for rotors 1 front, 2 left, 3 rear, 4 right.

    The reaction of front and rear turns the body counter-clockwise.
    """

    description = "Throttle and its differences to the rotor speeds of a '+' frame"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.input("throttle", 0.0, "%", "Common to all rotors")
        self.input("roll_difference", 0.0, "%", "Positive: raises the left side")
        self.input("pitch_difference", 0.0, "%", "Positive: lowers the nose")
        self.input("yaw_difference", 0.0, "%", "Positive: turns counter-clockwise")
        self.input(
            "motor_share", 0.0, "1", "Share of the commanded rotor speeds; 0: motors stopped"
        )
        self.output("rotor_speed", [0.0] * 4, "rad/s", "Front, left, rear, right")

    def tick(self, time: float) -> None:
        """Compute the rotor speeds."""
        throttle, roll, pitch, yaw = (
            self.throttle,
            self.roll_difference,
            self.pitch_difference,
            self.yaw_difference,
        )
        rotors = (
            throttle - pitch + yaw,
            throttle + roll - yaw,
            throttle + pitch + yaw,
            throttle - roll - yaw,
        )
        self.rotor_speed[:] = [
            self.motor_share * MAX_ROTOR_SPEED / 100 * limit(rotor, 0, 100) for rotor in rotors
        ]
