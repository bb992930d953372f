"""The force models between controllers and plant, the paper's "output processing"; they are stepped before the plant."""

from __future__ import annotations

import math
import sys
from typing import Any

from ..vehicles.ar_drone.parameters import THRUST_COEFFICIENT, TORQUE_COEFFICIENT
from ..vehicles.strider import parameters as p
from .interface import ROTORS
from .unit import Unit

MAX_SPEED = 5000.0  # 1/min
SPEED_UNIT = 0.10471976  # rad/s per 1/min, rounded as published


class RotorMap(Unit):
    """Throttle (%) to thrust (N) and propeller torque (N m) of each rotor: T = CT w^2, Q = CD w^2."""

    description = "Thrust and torque of four rotors"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.inputs(*(f"throttle[{i}]" for i in ROTORS))
        self.outputs(*(f"{load}[{i}]" for load in ("thrust", "torque") for i in ROTORS))

    def do_step(self, current_time: float, step_size: float) -> bool:
        for i in ROTORS:
            share = min(100.0, max(0.0, self.value[f"throttle[{i}]"])) / 100
            speed = share * MAX_SPEED * SPEED_UNIT
            self.value[f"thrust[{i}]"] = THRUST_COEFFICIENT * speed**2
            self.value[f"torque[{i}]"] = TORQUE_COEFFICIENT * speed**2
        return True


class VesselForces(Unit):
    """Loads of water, air and rudder on the vessel, from what the bus says about its motion.

    Body velocity (u, v) follows from the world velocity and the yaw angle. `rudder_inflow_sign` is that of r in the inflow angle
    of the rudder: +1 as published, -1 for a rudder behind the centre of mass as physics has it.
    """

    description = "Rudder force, and hydrodynamic and air forces on two hulls"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.inputs("vehicle.velocity.x", "vehicle.velocity.y", "vehicle.angular_velocity.z", "vehicle.attitude.yaw")
        self.inputs("rudder_angle")
        self.parameters(rudder_inflow_sign=1.0, hulls=float(p.HULLS))
        self.outputs("rudder.x", "rudder.y", "water.x", "water.y", "water.n")

    def do_step(self, current_time: float, step_size: float) -> bool:
        value = self.value
        u, v = body_velocity(value)
        r, hulls = value["vehicle.angular_velocity.z"], value["hulls"]
        inflow_rate = value["rudder_inflow_sign"] * r
        value["rudder.x"], value["rudder.y"] = rudder(u, v, inflow_rate, value["rudder_angle"])
        value["water.x"] = -p.AIR_DRAG * abs(u) * u
        value["water.y"] = hulls * (p.Y_V * v + p.Y_R * r) - p.AIR_DRAG * abs(v) * v
        value["water.n"] = hulls * (p.N_V * v + p.N_R * r)
        return True


def body_velocity(value: dict[str, float]) -> tuple[float, float]:
    """Surge and sway velocity (m/s) from the world velocity and the yaw angle of "vehicle"."""
    cos, sin = math.cos(value["vehicle.attitude.yaw"]), math.sin(value["vehicle.attitude.yaw"])
    x, y = value["vehicle.velocity.x"], value["vehicle.velocity.y"]
    return cos * x + sin * y, cos * y - sin * x


def rudder(u: float, v: float, inflow_rate: float, angle: float) -> tuple[float, float]:
    """X and Y (N) of the rudder for the body velocity (m/s), the rate (rad/s) in its inflow angle and its deflection (rad)."""
    inflow = math.atan((v + p.RUDDER_ARM * inflow_rate) / (u or sys.float_info.epsilon))
    attack = min(1.0, max(-1.0, (angle - inflow) / p.STALL_ANGLE))
    largest = 0.5 * p.WATER_DENSITY * p.RUDDER_MAX_LIFT_COEFFICIENT * p.RUDDER_AREA * u**2
    lift = largest * math.sin(math.pi / 2 * attack)
    return -lift * math.sin(angle), lift * math.cos(angle)
