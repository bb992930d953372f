"""KPIs of standard ship manoeuvres after IMO resolution MSC.137(76).

Turning circle, zig-zag, initial turning and stopping.

Definitions are those of section 5 of the annex. A manoeuvre begins with the order to rudder or
engine; the original course is the heading at that time. Positions are those of one point of the
vessel in the x-y plane of the world. Headings, speeds and positions are interpolated linearly
between rows. A value that was not reached is NaN.

The criteria of the resolution are made for ships of at least 100 m:

- advance at most 4.5 ship lengths, tactical diameter at most 5
- initial turning: at most 2.5 ship lengths of track
- track reach of the full astern stopping test at most 15 ship lengths
- 10/10 zig-zag: first overshoot at most 10 deg if length / speed < 10 s, second at most 25 deg
- 20/20 zig-zag: first overshoot at most 25 deg
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.core.errors import InputError
from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import Prefix, better, no_value, units
from cosim.results.signal_analysis import first_crossing_time, require

Point = Sequence[float]
CENTRE_OF_MASS: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Track:
    """Motion of a vessel from the order on.

    Arrays of shape (rows,), the first row at the time of the order.
    """

    #: time of the result (s)
    time: np.ndarray
    #: position relative to that at the order, complex: along the original course + i * to the left
    #: of it (m)
    position: np.ndarray
    #: heading relative to the original course, counter-clockwise, not wrapped (rad)
    heading_change: np.ndarray
    #: length of the track since the order (m)
    distance: np.ndarray

    def interpolate(self, values: np.ndarray, time: float) -> complex:
        """Return `values` (rows,), real or complex, at `time` (s); NaN if `time` is NaN."""
        return (
            complex(np.interp(time, self.time, values))
            if math.isfinite(time)
            else complex(math.nan, math.nan)
        )

    def time_of_heading_change(self, angle: float) -> float:
        """Return the first time (s) at which the heading has changed by `angle` (rad)."""
        return first_crossing_time(
            self.time, self.turn_direction(angle) * self.heading_change, angle
        )

    def turn_direction(self, angle: float) -> int:
        """Return 1 if the heading first differs by `angle` (rad) to port, -1 if to starboard."""
        beyond = self.heading_change[np.abs(self.heading_change) >= angle]
        return -1 if beyond.size and beyond[0] < 0 else 1


def track(result: Result, vehicle: str, start: float, midships: Point = CENTRE_OF_MASS) -> Track:
    """Return the motion of a vessel from the order on.

    Args:
        result: Recorded run.
        vehicle: Signal prefix of the vessel ("plant.usv").
        start: Time of the order (s).
        midships: Point whose position is evaluated, relative to the centre of mass (m, body frame).

    Returns:
        The track; one row of NaN if the run ended before `start`.

    Raises:
        InputError: `start` is before the first row.
    """
    time = result.time
    if not time.size or start < time[0]:
        raise InputError(f"the manoeuvre starts at {start:g} s, before the first recorded row")
    if start > time[-1]:
        return Track(*(np.full(1, math.nan, dtype) for dtype in (float, complex, float, float)))
    later = time > start
    centre_of_mass = result[f"{vehicle}.position.x"] + 1j * result[f"{vehicle}.position.y"]
    position, heading = (
        np.concatenate([[np.interp(start, time, values)], values[later]])
        for values in (
            centre_of_mass + _point_offset(result, vehicle, midships),
            np.unwrap(result[f"{vehicle}.attitude.yaw"]),
        )
    )
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])
    ahead_and_left = (position - position[0]) * np.exp(-1j * heading[0])
    return Track(
        np.concatenate([[start], time[later]]), ahead_and_left, heading - heading[0], travelled
    )


def _point_offset(result: Result, vehicle: str, point: Point) -> np.ndarray:
    """Return the horizontal offset x + i * y (m, world) of a body-fixed point.

    It is that from the centre of mass, shape (rows,).
    """
    if not any(point):
        return np.zeros(len(result.time), complex)
    w, x, y, z = (result[f"{vehicle}.orientation.{axis}"] for axis in "wxyz")
    ahead = 1 - 2 * (y * y + z * z) + 2j * (x * y + w * z)
    left = 2 * (x * y - w * z) + 1j * (1 - 2 * (x * x + z * z))
    up = 2 * (x * z + w * y) + 2j * (y * z - w * x)
    return np.asarray(point[0] * ahead + point[1] * left + point[2] * up)


DEGREE = math.pi / 180  # rad


@better(
    advance="lower",
    transfer="lower",
    tactical_diameter="lower",
    advance_lengths="lower",
    tactical_diameter_lengths="lower",
)
@units(
    advance="m",
    transfer="m",
    tactical_diameter="m",
    steady_diameter="m",
    time_to_90="s",
    time_to_180="s",
    period="s",
    steady_speed="m/s",
)
@no_value("{vehicle} did not turn far enough")
def turning_circle(
    result: Result, vehicle: Prefix, start: float, length: float, midships: Point = CENTRE_OF_MASS
) -> dict[str, Number]:
    """Evaluate a turning circle with the rudder hard over (IMO MSC.137(76), 5.2.1).

    It may turn to port or starboard.

    Args:
        result: Recorded run.
        vehicle: Signal prefix of the vessel ("plant.usv").
        start: Time of the rudder order (s).
        length: Length of the vessel (m).
        midships: Point whose position is evaluated, relative to the centre of mass (m, body frame).

    Returns:
        Values by name:

        - `advance`: distance along the original course until the heading has changed by 90 deg (m)
        - `transfer`: distance perpendicular to the original course until then (m)
        - `tactical_diameter`: distance perpendicular to the original course until the heading has
          changed by 180 deg (m)
        - `steady_diameter`: diameter of the last full turn, its track length over pi (m)
        - `advance_lengths`, `tactical_diameter_lengths`: the same in lengths of the vessel
        - `time_to_90`, `time_to_180`: time from the order until the heading has changed by 90 and
          180 deg (s)
        - `period`: duration of the last full turn (s)
        - `steady_speed`: mean speed over the last full turn (m/s)
        - `speed_loss`: 1 - `steady_speed` / speed at the order
    """
    require(length > 0, f"expected a positive length (m); found {length:g}")
    motion = track(result, vehicle, start, midships)
    quarter, half = map(motion.time_of_heading_change, (math.pi / 2, math.pi))
    position = motion.interpolate(motion.position, quarter)
    tactical = abs(motion.interpolate(motion.position, half).imag)
    period, track_length = _last_full_turn(motion)
    speed = track_length / period
    u, v = (np.interp(start, result.time, result[f"{vehicle}.velocity.{axis}"]) for axis in "xy")
    return {
        "advance": position.real,
        "transfer": abs(position.imag),
        "tactical_diameter": tactical,
        "steady_diameter": track_length / math.pi,
        "advance_lengths": position.real / length,
        "tactical_diameter_lengths": tactical / length,
        "time_to_90": quarter - start,
        "time_to_180": half - start,
        "period": period,
        "steady_speed": speed,
        "speed_loss": 1 - speed / math.hypot(u, v),
    }


def _last_full_turn(motion: Track) -> tuple[float, float]:
    """Return duration (s) and track length (m) of the last full turn; NaN without a full turn."""
    turned = motion.heading_change * math.copysign(1, motion.heading_change[-1])
    if not turned[-1] >= 2 * math.pi:
        return math.nan, math.nan
    begin = first_crossing_time(motion.time, turned, turned[-1] - 2 * math.pi)
    return float(motion.time[-1]) - begin, float(motion.distance[-1]) - motion.interpolate(
        motion.distance, begin
    ).real


@better(overshoot="lower", initial_turning_time="lower", reach="lower")
@units(overshoot="rad", execute="s", initial_turning_time="s", reach="s", period="s")
@no_value("the heading of {vehicle} did not change far enough")
def zigzag(
    result: Result, vehicle: Prefix, start: float, angle: float = 10 * DEGREE, overshoots: int = 2
) -> dict[str, Number]:
    """Evaluate a zig-zag test (IMO MSC.137(76), 5.2.3).

    The rudder is reversed whenever the heading differs by `angle` from the original course,
    alternately to both sides.

    Args:
        result: Recorded run.
        vehicle: Signal prefix of the vessel ("plant.usv").
        start: Time of the first rudder order (s).
        angle: Heading change at which the rudder is reversed (rad).
        overshoots: Number of overshoots and execute times that are returned.

    Returns:
        Values by name:

        - `overshoot[1]`, `overshoot[2]`, ...: heading change beyond `angle` after each reversal
          (rad)
        - `execute[1]`, `execute[2]`, ...: time from the first order until each reversal (s)
        - `initial_turning_time`: `execute[1]` (s)
        - `reach`: time from the first order until the heading is first back on the original course
          (s)
        - `period`: time between the first and the third reversal (s)
    """
    require(angle > 0, f"expected a positive angle (rad); found {angle:g}")
    motion = track(result, vehicle, start)
    times, overshoot_angles = _reversals(motion, angle, max(overshoots, 3))
    executes = [time - start for time in times]
    return {
        **{
            f"overshoot[{i}]": overshoot
            for i, overshoot in enumerate(overshoot_angles[:overshoots], 1)
        },
        **{f"execute[{i}]": time for i, time in enumerate(executes[:overshoots], 1)},
        "initial_turning_time": executes[0],
        "reach": _time_back_on_course(motion, times[0]) - start,
        "period": executes[2] - executes[0],
    }


def _reversals(motion: Track, angle: float, count: int) -> tuple[list[float], list[float]]:
    """Return the reversals of a zig-zag and the overshoots after them.

    A reversal is the time (s) at which the heading passes `angle` (rad) on alternating sides. An
    overshoot is an angle (rad).

    An overshoot is NaN if the heading has not begun to return by the end of the track.
    """
    # From each reversal on, the heading first swings on to its largest angle and then returns until
    # it passes `angle` on the other side, which is the next reversal.
    times, overshoots, rows = [], [], slice(0, None)
    side = motion.turn_direction(angle)
    for _ in range(count):
        reversal = first_crossing_time(motion.time[rows], side * motion.heading_change[rows], angle)
        rows = slice(int(np.searchsorted(motion.time, reversal)), None)
        following = first_crossing_time(
            motion.time[rows], -side * motion.heading_change[rows], angle
        )
        # no time is later than NaN: without a next reversal, all rows are part of the swing
        swing = side * motion.heading_change[rows][~(motion.time[rows] > following)]
        is_returning = swing.size > 0 and swing[-1] < swing.max()
        times.append(reversal)
        overshoots.append(float(swing.max()) - angle if is_returning else math.nan)
        side = -side
    return times, overshoots


def _time_back_on_course(motion: Track, reversal: float) -> float:
    """Return the time (s) after `reversal` (s) at which the heading is first back on course."""
    rows = motion.time > reversal
    if not rows.any():
        return math.nan
    side = math.copysign(1, motion.heading_change[rows][0])
    return first_crossing_time(motion.time[rows], -side * motion.heading_change[rows], 0.0)


@better(distance="lower", distance_lengths="lower", time="lower")
@units(distance="m", time="s")
@no_value("the heading of {vehicle} did not change far enough")
def initial_turning(
    result: Result,
    vehicle: Prefix,
    start: float,
    length: float,
    angle: float = 10 * DEGREE,
    midships: Point = CENTRE_OF_MASS,
) -> dict[str, Number]:
    """Evaluate the initial turning ability.

    The response to 10 deg of rudder (IMO MSC.137(76), 5.2.2).

    Args:
        result: Recorded run.
        vehicle: Signal prefix of the vessel ("plant.usv").
        start: Time of the rudder order (s).
        length: Length of the vessel (m).
        angle: Heading change until which the vessel is followed (rad).
        midships: Point whose position is evaluated, relative to the centre of mass (m, body frame).

    Returns:
        Values by name:

        - `distance`: track length until the heading has changed by `angle` (m)
        - `distance_lengths`: the same in lengths of the vessel
        - `time`: time from the order until then (s)
    """
    require(length > 0, f"expected a positive length (m); found {length:g}")
    motion = track(result, vehicle, start, midships)
    time = motion.time_of_heading_change(angle)
    distance = motion.interpolate(motion.distance, time).real
    return {"distance": distance, "distance_lengths": distance / length, "time": time - start}


@better(
    track_reach="lower",
    track_reach_lengths="lower",
    head_reach="lower",
    lateral_deviation="lower",
    time="lower",
)
@units(track_reach="m", head_reach="m", lateral_deviation="m", time="s")
@no_value("{vehicle} did not slow down far enough")
def stopping(
    result: Result,
    vehicle: Prefix,
    start: float,
    length: float,
    speed: float = 0.0,
    midships: Point = CENTRE_OF_MASS,
) -> dict[str, Number]:
    """Evaluate a stopping test (IMO MSC.137(76), 5.2.4).

    Args:
        result: Recorded run.
        vehicle: Signal prefix of the vessel ("plant.usv").
        start: Time of the engine order (s).
        length: Length of the vessel (m).
        speed: Forward speed `velocity_body.u` at or below which the vessel counts as stopped (m/s);
            positive for a vessel that coasts.
        midships: Point whose position is evaluated, relative to the centre of mass (m, body frame).

    Returns:
        Values by name:

        - `track_reach`: track length until the vessel has stopped (m)
        - `track_reach_lengths`: the same in lengths of the vessel
        - `head_reach`: distance along the original course (m)
        - `lateral_deviation`: distance from the line of the original course, to port or starboard
          (m)
        - `time`: time from the order until the vessel has stopped (s)
    """
    require(length > 0, f"expected a positive length (m); found {length:g}")
    motion = track(result, vehicle, start, midships)
    forward = np.interp(motion.time, result.time, result[f"{vehicle}.velocity_body.u"])
    time = first_crossing_time(motion.time, -forward, -speed)
    position = motion.interpolate(motion.position, time)
    reach = motion.interpolate(motion.distance, time).real
    return {
        "track_reach": reach,
        "track_reach_lengths": reach / length,
        "head_reach": position.real,
        "lateral_deviation": abs(position.imag),
        "time": time - start,
    }
