"""Standard manoeuvres of ships: turning circle, zig-zag, initial turning and stopping of IMO resolution MSC.137(76), section 5.

A manoeuvre begins with the order to rudder or engine at `start` (s); the original course is the heading at that time, `length`
(m) the vessel's length, by which the resolution's criteria go. Places are those of the point `midships` (m, body frame, from the
centre of mass; default: the centre of mass itself) in the x-y plane of the world. Between rows headings, speeds and places are
straight lines; what was not reached is NaN.

The criteria, made for ships of 100 m and more: advance <= 4.5 lengths, tactical diameter <= 5, initial turning <= 2.5, track
reach <= 15; first overshoot of the 10/10 zig-zag <= 10 deg at length/speed < 10 s, second <= 25 deg; of the 20/20 <= 25 deg.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.core.errors import InputError
from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import Prefix, better, first_crossing_time, units

DEGREE = math.pi / 180

Point = Sequence[float]
CENTRE_OF_MASS: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Track:
    """A motion from the order on, each array with shape (rows,), the first row at the order itself."""

    #: s, of the result
    time: np.ndarray
    #: m, ahead + i * left, from the place of the order along the original course
    position: np.ndarray
    #: rad from the original course, counter-clockwise, beyond a full turn too
    heading_change: np.ndarray
    #: m, along the track
    distance: np.ndarray

    def interpolate(self, values: np.ndarray, time: float) -> complex:
        return complex(np.interp(time, self.time, values)) if math.isfinite(time) else complex(math.nan, math.nan)

    def time_of_heading_change(self, angle: float) -> float:
        """When the heading is first off the original course by `angle` (rad), to whichever side it turns."""
        return first_crossing_time(self.time, self.turn_direction(angle) * self.heading_change, angle)

    def turn_direction(self, angle: float) -> int:
        """1 when the heading is off by `angle` (rad) to the left first, -1 to the right."""
        beyond = self.heading_change[np.abs(self.heading_change) >= angle]
        return -1 if beyond.size and beyond[0] < 0 else 1


def track(result: Result, vehicle: str, start: float, midships: Point = CENTRE_OF_MASS) -> Track:
    """The motion of `vehicle` ("plant.usv") from `start` (s) on; not a number when the run ended before.

    Raises InputError for a start before the first row.
    """
    time = result.time
    if not time.size or start < time[0]:
        raise InputError(f"the manoeuvre starts at {start:g} s, where nothing was recorded")
    if start > time[-1]:
        return Track(*(np.full(1, math.nan, dtype) for dtype in (float, complex, float, float)))
    later = time > start
    place = result[f"{vehicle}.position.x"] + 1j * result[f"{vehicle}.position.y"] + _point_offset(result, vehicle, midships)
    place, heading = (
        np.concatenate([[np.interp(start, time, values)], values[later]])
        for values in (place, np.unwrap(result[f"{vehicle}.attitude.yaw"]))
    )
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place)))])
    ahead_and_left = (place - place[0]) * np.exp(-1j * heading[0])
    return Track(np.concatenate([[start], time[later]]), ahead_and_left, heading - heading[0], travelled)


def _point_offset(result: Result, vehicle: str, point: Point) -> np.ndarray:
    """Where a point of the vehicle (body frame) is from its centre of mass, x + i * y in the world."""
    if not any(point):
        return np.zeros(len(result.time), complex)
    w, x, y, z = (result[f"{vehicle}.orientation.{axis}"] for axis in "wxyz")
    ahead = 1 - 2 * (y * y + z * z) + 2j * (x * y + w * z)
    left = 2 * (x * y - w * z) + 1j * (1 - 2 * (x * x + z * z))
    up = 2 * (x * z + w * y) + 2j * (y * z - w * x)
    return np.asarray(point[0] * ahead + point[1] * left + point[2] * up)


@better(advance="lower", transfer="lower", tactical_diameter="lower", advance_lengths="lower", tactical_diameter_lengths="lower")
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
def turning_circle(
    result: Result, vehicle: Prefix, start: float, length: float, midships: Point = CENTRE_OF_MASS
) -> dict[str, Number]:
    """The turning circle of `vehicle`, to either side, rudder hard over from `start` on (MSC.137(76), 5.2.1).

    advance                     m    way made good along the original course until the heading has changed by 90 deg
    transfer                    m    way made good to the side of the turn until then
    tactical_diameter           m    way made good to the side of the turn until the heading has changed by 180 deg
    steady_diameter             m    of the circle of the last full turn: length of its track over pi
    advance_lengths             1    advance in lengths of the vessel
    tactical_diameter_lengths   1    tactical diameter in lengths of the vessel
    time_to_90, time_to_180     s    from the order until the heading has changed so far
    period                      s    of the last full turn
    steady_speed                m/s  mean speed over the last full turn
    speed_loss                  1    share of the speed at the order that is lost by then
    """
    own = track(result, vehicle, start, midships)
    quarter, half = own.time_of_heading_change(math.pi / 2), own.time_of_heading_change(math.pi)
    advance, transfer = own.interpolate(own.position, quarter).real, own.interpolate(own.position, quarter).imag
    tactical = own.interpolate(own.position, half).imag
    period, way = _last_full_turn(own)
    speed = way / period
    return {
        "advance": advance,
        "transfer": abs(transfer),
        "tactical_diameter": abs(tactical),
        "steady_diameter": way / math.pi,
        "advance_lengths": advance / length,
        "tactical_diameter_lengths": abs(tactical) / length,
        "time_to_90": quarter - start,
        "time_to_180": half - start,
        "period": period,
        "steady_speed": speed,
        "speed_loss": 1 - speed / _speed_over_ground(result, vehicle, start),
    }


def _last_full_turn(own: Track) -> tuple[float, float]:
    """Time (s) and length of track (m) of the last full turn, NaN when there is none."""
    turned = own.heading_change * math.copysign(1, own.heading_change[-1])
    if not turned[-1] >= 2 * math.pi:
        return math.nan, math.nan
    begin = first_crossing_time(own.time, turned, turned[-1] - 2 * math.pi)
    return float(own.time[-1]) - begin, float(own.distance[-1]) - own.interpolate(own.distance, begin).real


def _speed_over_ground(result: Result, vehicle: str, time: float) -> float:
    """Speed over ground (m/s)."""
    u, v = (np.interp(time, result.time, result[f"{vehicle}.velocity.{axis}"]) for axis in "xy")
    return math.hypot(u, v)


@better(overshoot="lower", initial_turning_time="lower", reach="lower")
@units(overshoot="rad", execute="s", initial_turning_time="s", reach="s", period="s")
def zigzag(result: Result, vehicle: Prefix, start: float, angle: float = 10 * DEGREE, overshoots: int = 2) -> dict[str, Number]:
    """The zig-zag of `vehicle` from `start` on: the rudder is reversed whenever the heading is `angle` (rad) off the original
    course on the side to which the vessel turns (MSC.137(76), 5.2.3).

    overshoot[1] ... overshoot[`overshoots`]  rad  how far the heading goes on beyond `angle` after each reversal
    execute[1] ...                            s    from the order until the heading was off by `angle`, one side after the other
    initial_turning_time                      s    the first of them
    reach                                     s    from the order until the heading first is back on the original course
    period                                    s    from one reversal to the next but one, to the same side
    """
    own = track(result, vehicle, start)
    times, excesses = _reversals(own, angle, max(overshoots, 3))
    executes = [time - start for time in times]
    return {
        **{f"overshoot[{i}]": excess for i, excess in enumerate(excesses[:overshoots], 1)},
        **{f"execute[{i}]": time for i, time in enumerate(executes[:overshoots], 1)},
        "initial_turning_time": executes[0],
        "reach": _time_back_on_course(own, times[0]) - start,
        "period": executes[2] - executes[0],
    }


def _reversals(own: Track, angle: float, count: int) -> tuple[list[float], list[float]]:
    """When the heading passes `angle` on alternating sides (s), and how far it goes beyond until it does so on the other.

    The excess is NaN where the heading had not begun to come back by the end.
    """
    times, excesses, rows = [], [], slice(0, None)
    side = own.turn_direction(angle)
    for _ in range(count):
        when = first_crossing_time(own.time[rows], side * own.heading_change[rows], angle)
        rows = slice(int(np.searchsorted(own.time, when)), None)
        back = first_crossing_time(own.time[rows], -side * own.heading_change[rows], angle)
        swing = side * own.heading_change[rows][own.time[rows] <= (back if math.isfinite(back) else math.inf)]
        turned_back = swing.size > 0 and swing[-1] < swing.max()
        times.append(when)
        excesses.append(float(swing.max()) - angle if turned_back else math.nan)
        side = -side
    return times, excesses


def _time_back_on_course(own: Track, reversal: float) -> float:
    rows = own.time > reversal
    if not rows.any():
        return math.nan
    side = math.copysign(1, own.heading_change[rows][0])
    return first_crossing_time(own.time[rows], -side * own.heading_change[rows], 0.0)


@better(distance="lower", distance_lengths="lower", time="lower")
@units(distance="m", time="s")
def initial_turning(
    result: Result, vehicle: Prefix, start: float, length: float, angle: float = 10 * DEGREE, midships: Point = CENTRE_OF_MASS
) -> dict[str, Number]:
    """How quickly `vehicle` answers 10 deg of rudder from `start` on (MSC.137(76), 5.2.2).

    distance          m  along the track until the heading has changed by `angle` (rad)
    distance_lengths  1  the same in lengths of the vessel
    time              s  from the order until then
    """
    own = track(result, vehicle, start, midships)
    when = own.time_of_heading_change(angle)
    distance = own.interpolate(own.distance, when).real
    return {"distance": distance, "distance_lengths": distance / length, "time": when - start}


@better(track_reach="lower", track_reach_lengths="lower", head_reach="lower", lateral_deviation="lower", time="lower")
@units(track_reach="m", head_reach="m", lateral_deviation="m", time="s")
def stopping(
    result: Result, vehicle: Prefix, start: float, length: float, speed: float = 0.0, midships: Point = CENTRE_OF_MASS
) -> dict[str, Number]:
    """How `vehicle` stops after the engine's order at `start` (MSC.137(76), 5.2.4).

    It has stopped when its forward speed through `velocity_body.u` is first at `speed` (m/s) or below: more than zero for a
    vessel that coasts.

    track_reach          m  along the track until then
    track_reach_lengths  1  the same in lengths of the vessel
    head_reach           m  way made good along the original course
    lateral_deviation    m  from the line of the original course, to either side
    time                 s  from the order until then
    """
    own = track(result, vehicle, start, midships)
    forward = np.interp(own.time, result.time, result[f"{vehicle}.velocity_body.u"])
    when = first_crossing_time(own.time, -forward, -speed)
    place, reach = own.interpolate(own.position, when), own.interpolate(own.distance, when).real
    return {
        "track_reach": reach,
        "track_reach_lengths": reach / length,
        "head_reach": place.real,
        "lateral_deviation": abs(place.imag),
        "time": when - start,
    }
