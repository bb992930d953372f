"""The controllers re-stated in Python from the equations of the paper and its repository, for
comparison with the FMUs.

The landing logic is this project's own: the original was stateless and never cut its motors.

Nothing here knows how the FMUs are made. Signs follow the project's frames: positive pitch = nose
down, yaw counter-clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

T = 0.01


def clamp(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)


def wrap(angle: float) -> float:
    return (angle + math.pi) % (2 * math.pi) - math.pi


@dataclass
class Pid:
    """u = P e + I int(e) + D N/(1 + N/s) e, its filter integrated over a period by ode3 with the
    error held.
    """

    P: float
    I: float = 0.0  # noqa: E741
    D: float = 0.0
    N: float = 100.0
    limits: tuple[float, float] = (-math.inf, math.inf)
    start: float = 0.0
    integral: float = field(init=False)
    filtered: float | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.integral = self.start

    def __call__(self, e: float, feed_forward: float = 0.0, reset: bool = False) -> float:
        if reset:
            self.integral, self.filtered = self.start, None
            return clamp(feed_forward + self.start, *self.limits)
        h = self.N * T
        filtered = self.D * e if self.filtered is None else self.filtered
        u = feed_forward + self.P * e + self.integral + self.N * (self.D * e - filtered)
        y = clamp(u, *self.limits)
        if not (u != y and self.I * e * (u - y) > 0):
            self.integral += T * self.I * e
        self.filtered = self.D * e + (filtered - self.D * e) * (1 - h + h**2 / 2 - h**3 / 6)
        return y


class PositionReference:
    """Errors are rotated into the heading frame (forward, left); tilt commands in degrees inside,
    rad outside.
    """

    def __init__(self, p: dict[str, float]):
        speed, tilt = (-p["speed_limit"], p["speed_limit"]), (-p["tilt_limit"], p["tilt_limit"])
        self.position = [Pid(p["position_P"], p["position_I"], limits=speed) for _ in "xy"]
        self.velocity = [
            Pid(p["velocity_P"], 0.0, p["velocity_D"], p["velocity_N"], tilt) for _ in "xy"
        ]

    def __call__(self, i: dict[str, Any]) -> dict[str, float]:
        heading = complex(math.cos(i["vehicle.attitude.yaw"]), -math.sin(i["vehicle.attitude.yaw"]))

        def body(name: str) -> tuple[float, float]:
            vector = complex(i[f"{name}.x"], i[f"{name}.y"]) * heading
            return vector.real, vector.imag

        pairs = zip(body("position_reference"), body("vehicle.position"), strict=True)
        commands = [
            pid(r - x, f, i["reset"])
            for pid, (r, x), f in zip(self.position, pairs, body("velocity_reference"), strict=True)
        ]
        forward, left = (
            pid(c - v, reset=i["reset"])
            for pid, c, v in zip(self.velocity, commands, body("vehicle.velocity"), strict=True)
        )
        return {"pitch_command": math.radians(forward), "roll_command": -math.radians(left)}


class AltitudeReference:
    """The integral starts at the throttle that carries the weight: 4 CT omega^2 = m g."""

    def __init__(self, p: dict[str, float]):
        hover = (
            math.sqrt(p["mass"] * 9.81 / (4 * p["thrust_coefficient"])) / (5000 * 0.10471976) * 100
        )
        limits = (p["throttle_min"], p["throttle_max"])
        self.pid = Pid(
            p["altitude_P"], p["altitude_I"], p["altitude_D"], p["altitude_N"], limits, hover
        )

    def __call__(self, i: dict[str, Any]) -> dict[str, float]:
        return {
            "throttle": self.pid(
                i["altitude_reference"] - i["vehicle.position.z"], reset=i["reset"]
            )
        }


class AttitudeReference:
    """All three loops work in degrees; the yaw error is taken the short way round."""

    def __init__(self, p: dict[str, float]):
        def pid(axis: str, band: str, limit: str) -> Pid:
            return Pid(
                p[f"{axis}_P"], p[f"{axis}_I"], p[f"{axis}_D"], p[band], (-p[limit], p[limit])
            )

        self.roll, self.pitch = (
            pid("roll", "tilt_N", "tilt_limit"),
            pid("pitch", "tilt_N", "tilt_limit"),
        )
        self.yaw = pid("yaw", "yaw_N", "yaw_limit")

    def __call__(self, i: dict[str, Any]) -> dict[str, float]:
        error = {
            axis: i[f"{axis}_command"] - i[f"vehicle.attitude.{axis}"]
            for axis in ("roll", "pitch", "yaw")
        }
        return {
            "roll_difference": self.roll(math.degrees(error["roll"]), reset=i["reset"]),
            "pitch_difference": self.pitch(math.degrees(error["pitch"]), reset=i["reset"]),
            "yaw_difference": self.yaw(math.degrees(wrap(error["yaw"])), reset=i["reset"]),
        }


def mix_rotor_speeds(i: dict[str, float]) -> dict[str, float]:
    """Rotors 1 front, 2 left, 3 rear, 4 right; throttle 0..100 % is 0..5000 rpm."""
    common, roll, pitch, yaw = (
        i[k] for k in ("throttle", "roll_difference", "pitch_difference", "yaw_difference")
    )
    rotors = (common - pitch + yaw, common + roll - yaw, common + pitch + yaw, common - roll - yaw)
    return {
        f"rotor_speed[{n}]": i["motor_share"] * clamp(throttle, 0, 100) / 100 * 5000 * 0.10471976
        for n, throttle in enumerate(rotors, 1)
    }


class Guidance:
    """Line of sight to the active waypoint; no speed after a list that ends with a stop."""

    def __init__(self, p: dict[str, Any]):
        self.p, self.active, self.finished, self.course = p, 1, False, 0.0

    def ahead(self, i: dict[str, float]) -> tuple[float, float]:
        k = self.active - 1
        return self.p["waypoint_x"][k] - i["vehicle.position.x"], self.p["waypoint_y"][k] - i[
            "vehicle.position.y"
        ]

    def __call__(self, i: dict[str, float]) -> dict[str, Any]:
        stop, repeat, _ = 1, 2, 3
        if not self.finished and math.hypot(*self.ahead(i)) <= self.p["acceptance_radius"]:
            if self.active < self.p["waypoint_count"]:
                self.active += 1
            elif self.p["end_policy"] == repeat:
                self.active = 1
            else:
                self.finished = True
        dx, dy = self.ahead(i)
        if not self.finished:
            self.course = math.atan2(dy, dx)
        return {
            "heading_reference": self.course,
            "speed_reference": 0.0
            if self.finished and self.p["end_policy"] == stop
            else self.p["speed_command"],
            "distance": math.hypot(dx, dy),
            "active_waypoint": self.active,
            "finished": self.finished,
        }


class SpeedReference:
    """Proportional thrust."""

    def __init__(self, p: dict[str, float]):
        self.pid = Pid(p["speed_P"], limits=(-p["thrust_limit"], p["thrust_limit"]))

    def __call__(self, i: dict[str, Any]) -> dict[str, float]:
        return {"thrust": self.pid(i["speed_reference"] - i["vehicle.velocity_body.u"])}


class HeadingReference:
    """PD rudder on heading minus reference, the short way round."""

    def __init__(self, p: dict[str, float]):
        limits = (-p["rudder_limit"], p["rudder_limit"])
        self.pid = Pid(p["heading_P"], 0.0, p["heading_D"], p["heading_N"], limits)

    def __call__(self, i: dict[str, Any]) -> dict[str, float]:
        return {"rudder_angle": self.pid(wrap(i["vehicle.attitude.yaw"] - i["heading_reference"]))}


class Autopilot:
    """Guidance, then both loops on its references."""

    def __init__(self, p: dict[str, Any]):
        self.guidance, self.loops = Guidance(p), (SpeedReference(p), HeadingReference(p))

    def __call__(self, i: dict[str, Any]) -> dict[str, Any]:
        references = self.guidance(i)
        outputs = {name: value for name, value in references.items() if name != "speed_reference"}
        for loop in self.loops:
            outputs |= loop(i | references)
        return outputs


def rate_limited(value: float, destination: float, rate: float) -> float:
    return value + clamp(destination - value, -rate * T, rate * T)


class Vtol:
    """One method per flight mode, which returns the next mode."""

    MODES = ("idle", "take_off", "follow", "approach", "descend", "landed")

    def __init__(self, p: dict[str, Any]):
        self.p, self.mode, self.tick, self.home = p, "idle", 0, (0.0, 0.0, 0.0, 0.0)
        self.share = self.altitude = 0.0
        self.steady = self.touching = self.aborts = 0

    def idle(self) -> str:
        self.home = (*self.position, self.yaw)
        return "take_off" if self.tick * T >= self.p["take_off_time"] else "idle"

    def take_off(self) -> str:
        return "follow" if self.position[2] > self.home[2] + self.p["clearance"] else "take_off"

    def follow(self) -> str:
        return (
            "approach"
            if self.p["landing_enabled"] and self.tick * T >= self.p["landing_time"]
            else "follow"
        )

    def approach(self) -> str:
        if not self.p["landing_enabled"]:
            return "follow"
        return "descend" if self.steady >= round(self.p["hold_time"] / T) else "approach"

    def descend(self) -> str:
        if self.touching >= round(self.p["contact_time"] / T):
            return "landed"
        if not self.p["landing_enabled"]:
            return "follow"
        if self.error <= self.p["abort_error"]:
            return "descend"
        self.aborts += 1
        return "approach"

    def landed(self) -> str:
        return "landed"

    def __call__(self, i: dict[str, Any]) -> dict[str, Any]:
        self.position, self.yaw = (
            tuple(i[f"vehicle.position.{a}"] for a in "xyz"),
            i["vehicle.attitude.yaw"],
        )
        deck = [i[f"target.position.{a}"] for a in "xyz"]
        down = deck[2] + self.p["resting_height"]
        self.error = math.dist(deck[:2], self.position[:2])
        high = abs(self.position[2] - down - self.p["approach_height"])
        inside = self.error <= self.p["landing_error"] and high <= self.p["approach_band"]
        self.steady = self.steady + 1 if inside and self.mode == "approach" else 0
        self.touching = self.touching + 1 if i["vehicle.contact.vessel"] else 0
        self.mode = getattr(self, self.mode)()
        self.tick += 1
        return self.references(i, deck, down)

    def references(self, i: dict[str, Any], deck: list[float], down: float) -> dict[str, Any]:
        on_ground, going_up = self.mode in ("idle", "landed"), self.mode in ("idle", "take_off")
        self.share = clamp(
            self.share + (-1 if on_ground else 1) * T / self.p["ramp_time"], 0.0, 1.0
        )
        destination, rate = i["altitude_command"], self.p["climb_rate"]
        if self.mode == "take_off":
            destination = max(destination, self.home[2] + 2 * self.p["clearance"])
        elif self.mode == "approach":
            destination = down + self.p["approach_height"]
        elif self.mode == "descend":
            destination, rate = (
                down - self.p["press_depth"],
                self.p["descent_rate"] * (self.error <= self.p["landing_error"]),
            )
        self.altitude = (
            self.position[2] if self.share < 1 else rate_limited(self.altitude, destination, rate)
        )
        speed = [
            i[f"target.velocity.{a}"] if self.p["velocity_feed_forward"] and not going_up else 0.0
            for a in "xy"
        ]
        return {
            "position_reference.x": self.home[0] if going_up else deck[0],
            "position_reference.y": self.home[1] if going_up else deck[1],
            "velocity_reference.x": speed[0],
            "velocity_reference.y": speed[1],
            "altitude_reference": self.altitude,
            "yaw_reference": self.home[3] if going_up else i["yaw_command"],
            "motor_share": self.share,
            "motors_on": self.share > 0,
            "reset": self.share < 1,
            "mode": 1 + self.MODES.index(self.mode),
            "horizontal_error": self.error,
            "aborts": self.aborts,
        }
