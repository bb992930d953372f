"""Path command of the quadcopter: take-off, pursuit of a vessel and landing on its deck."""

from __future__ import annotations

from typing import Any

from .fleet import SAMPLE_PERIOD, FlightMode, horizontal_norm, limit
from .fleet.sampled_controller import SampledController


class Vtol(SampledController):
    """State machine of six flight modes, the same as in controllers/modelica/Vtol.mo.

    The table of modes is in controllers/modelica/README.md.
    """

    description = (
        "Path command of the quadcopter: take-off, pursuit of a vessel and landing on its deck"
    )
    mode: int
    altitude_command: float
    altitude_reference: float
    approach_height: float
    clearance: float
    climb_rate: float
    descent_rate: float
    home_z: float
    horizontal_error: float
    landing_error: float
    motor_share: float
    press_depth: float
    resting_height: float
    steady: float
    touching: float

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self._declare_parameters()
        self._declare_inputs()
        self._declare_outputs()
        for name in ("home_x", "home_y", "home_z"):
            self.local(name, 0.0, "m", "Last position before take-off")
        self.local("home_yaw", 0.0, "rad", "Last heading before take-off")
        self.local("steady", 0.0, "s", "Time spent in the window that allows the descent")
        self.local("touching", 0.0, "s", "Time spent in contact with the vessel")
        self.local(
            "committed", False, description="To the touchdown: a calm deck at the waiting height"
        )

    def _declare_parameters(self) -> None:
        self.parameter("take_off_time", 0.0, "s", "Earliest start of the motors")
        self.parameter(
            "landing_enabled",
            True,
            description="False: keep following, also out of an approach or descent",
        )
        self.parameter("landing_time", 5.0, "s", "Earliest start of the approach")
        self.parameter(
            "velocity_feed_forward",
            True,
            description="Follow with the velocity of the deck as feed-forward",
        )
        self.parameter("ramp_time", 0.3, "s", "In which the motors spin up or down")
        self.parameter(
            "clearance", 0.4, "m", "Climb above the starting point before the pursuit begins"
        )
        self.parameter(
            "resting_height", 0.056, "m", "Of the centre of mass above the deck when landed"
        )
        self.parameter("approach_height", 0.675, "m", "Above the resting height")
        self.parameter(
            "waiting_height",
            0.15,
            "m",
            "Above the resting height: the descent waits there until the deck is calm",
        )
        self.parameter(
            "press_depth",
            0.1,
            "m",
            "Below the resting height: end of the descent, which keeps the contact",
        )
        self.parameter("approach_band", 0.1, "m", "Altitude error that allows the descent")
        self.parameter(
            "landing_error",
            0.05,
            "m",
            "Horizontal error that allows the descent to begin and to go on",
        )
        self.parameter("abort_error", 0.15, "m", "Horizontal error that aborts the descent")
        self.parameter(
            "hold_time", 0.3, "s", "In which both errors must stay small before the descent"
        )
        self.parameter("contact_time", 0.03, "s", "Of unbroken contact that counts as touchdown")
        self.parameter("climb_rate", 1.0, "m/s", "Of the altitude reference, up and down")
        self.parameter("descent_rate", 0.3, "m/s", "Of the altitude reference onto the deck")

    def _declare_inputs(self) -> None:
        for thing in ("vehicle", "target"):
            for axis, direction in (("x", "East"), ("y", "North"), ("z", "Up")):
                self.input(f"{thing}.position.{axis}", 0.0, "m", direction)
        self.input("vehicle.attitude.yaw", 0.0, "rad", "Counter-clockwise from east")
        self.input("vehicle.contact.vessel", False, description="The quadcopter touches a vessel")
        self.input("target.velocity.x", 0.0, "m/s", "East")
        self.input("target.velocity.y", 0.0, "m/s", "North")
        self.input("altitude_command", 2.0, "m", "Of the centre of mass, for the pursuit")
        self.input("yaw_command", 0.0, "rad", "Counter-clockwise from east, for the pursuit")
        self.input("calm", True, description="Quiescent window: the deck permits a touchdown")

    def _declare_outputs(self) -> None:
        for name, unit in (("position_reference", "m"), ("velocity_reference", "m/s")):
            self.output(f"{name}.x", 0.0, unit, "East")
            self.output(f"{name}.y", 0.0, unit, "North")
        self.output("altitude_reference", 0.0, "m")
        self.output("yaw_reference", 0.0, "rad")
        self.output(
            "motor_share",
            0.0,
            "1",
            "Of the commanded rotor speeds: ramps at take-off and touchdown",
        )
        self.output("motors_on", False)
        self.output(
            "reset",
            True,
            description="Controllers hold their start state: the motors are not at full share",
        )
        self.output(
            "mode",
            int(FlightMode.IDLE),
            description="1 idle, 2 take-off, 3 follow, 4 approach, 5 descend, 6 landed",
        )
        self.output("horizontal_error", 0.0, "m", "Distance to the centre of the deck")
        self.output("aborts", 0, description="Aborted descents")

    def exit_initialization_mode(self) -> None:
        """Compute the initial horizontal error."""
        self.horizontal_error = self._horizontal_distance()

    def tick(self, time: float) -> None:
        """Update the flight mode, then the references."""
        self.horizontal_error = self._horizontal_distance()
        if self.mode == FlightMode.IDLE:
            self._store_home_pose()
        self._update_timers()
        self.mode = int(self._next_mode(time))
        self._update_motor_share()
        self._set_horizontal_references()
        self.committed = self._is_committed()
        self._set_altitude_reference()

    def _horizontal_distance(self) -> float:
        target, vehicle = self.target.position, self.vehicle.position
        return horizontal_norm(target.x - vehicle.x, target.y - vehicle.y)

    def _store_home_pose(self) -> None:
        position = self.vehicle.position
        self.home_x, self.home_y, self.home_z = position.x, position.y, position.z
        self.home_yaw = self.vehicle.attitude.yaw

    # -- flight modes ------------------------------------------------------------------------------

    @property
    def _landed_altitude(self) -> float:
        deck_altitude: float = self.target.position.z
        return deck_altitude + self.resting_height

    @property
    def _is_centred(self) -> bool:
        return self.horizontal_error <= self.landing_error

    def _update_timers(self) -> None:
        level = (
            abs(self.vehicle.position.z - self._landed_altitude - self.approach_height)
            <= self.approach_band
        )
        holding = self._is_centred and level and self.mode == FlightMode.APPROACH
        self.steady = self.steady + SAMPLE_PERIOD if holding else 0.0
        self.touching = self.touching + SAMPLE_PERIOD if self.vehicle.contact.vessel else 0.0

    def _next_mode(self, time: float) -> int:
        match self.mode:
            case FlightMode.IDLE if time >= self.take_off_time:
                return FlightMode.TAKE_OFF
            case FlightMode.TAKE_OFF if self.vehicle.position.z > self.home_z + self.clearance:
                return FlightMode.FOLLOW
            case FlightMode.FOLLOW if self.landing_enabled and time >= self.landing_time:
                return FlightMode.APPROACH
            case FlightMode.APPROACH:
                return self._after_approach()
            case FlightMode.DESCEND:
                return self._after_descent()
        return self.mode

    def _after_approach(self) -> FlightMode:
        if not self.landing_enabled:
            return FlightMode.FOLLOW
        return (
            FlightMode.DESCEND if _has_elapsed(self.steady, self.hold_time) else FlightMode.APPROACH
        )

    def _after_descent(self) -> FlightMode:
        if _has_elapsed(self.touching, self.contact_time):
            return FlightMode.LANDED
        if not self.landing_enabled:
            return FlightMode.FOLLOW
        if self.horizontal_error <= self.abort_error:
            return FlightMode.DESCEND
        self.aborts += 1
        return FlightMode.APPROACH

    def _is_committed(self) -> bool:
        """Return True from a calm deck at the waiting height until the end of the descent."""
        lowest = self._landed_altitude + self.waiting_height + self.descent_rate * SAMPLE_PERIOD
        return self.mode == FlightMode.DESCEND and (
            self.committed or (self.calm and self.altitude_reference <= lowest)
        )

    # -- outputs -----------------------------------------------------------------------------------

    def _update_motor_share(self) -> None:
        direction = -1 if self.mode in (FlightMode.IDLE, FlightMode.LANDED) else 1
        self.motor_share = limit(
            self.motor_share + direction * SAMPLE_PERIOD / self.ramp_time, 0.0, 1.0
        )
        self.motors_on, self.reset = self.motor_share > 0, self.motor_share < 1

    def _set_horizontal_references(self) -> None:
        position, speed = self.position_reference, self.velocity_reference
        if self.mode in (FlightMode.IDLE, FlightMode.TAKE_OFF):
            position.x, position.y, self.yaw_reference = self.home_x, self.home_y, self.home_yaw
            speed.x, speed.y = 0.0, 0.0
        else:
            position.x, position.y, self.yaw_reference = (
                self.target.position.x,
                self.target.position.y,
                self.yaw_command,
            )
            velocity = self.target.velocity
            speed.x, speed.y = (
                (velocity.x, velocity.y) if self.velocity_feed_forward else (0.0, 0.0)
            )

    def _set_altitude_reference(self) -> None:
        if self.reset:
            self.altitude_reference = self.vehicle.position.z
            return
        step = self._altitude_rate() * SAMPLE_PERIOD
        difference = self._altitude_destination() - self.altitude_reference
        self.altitude_reference = self.altitude_reference + limit(difference, -step, step)

    def _altitude_destination(self) -> float:
        match self.mode:
            case FlightMode.TAKE_OFF:
                return max(self.altitude_command, self.home_z + 2 * self.clearance)
            case FlightMode.APPROACH:
                return self._landed_altitude + self.approach_height
            case FlightMode.DESCEND:
                return self._landed_altitude + (
                    -self.press_depth if self.committed else self.waiting_height
                )
        return self.altitude_command

    def _altitude_rate(self) -> float:
        if self.mode != FlightMode.DESCEND:
            return self.climb_rate
        return self.descent_rate if self._is_centred else 0.0


def _has_elapsed(elapsed: float, duration: float) -> bool:
    """Return True if a sum of sample periods has reached a duration (s).

    The tolerance is half a period, for rounding.
    """
    return elapsed >= duration - SAMPLE_PERIOD / 2
