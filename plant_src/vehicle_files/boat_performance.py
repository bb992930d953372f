"""Top speed and turning moments of a vessel with fixed propellers, from its data alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..vehicles.surface_vessel.surface_vessel import SurfaceVessel
from ..vehicles.vessel.actuators import Propeller
from ..vehicles.vessel.boat import Boat
from .vessel_plausibility import surge_damping

#: smallest lever (m) of a propeller or rudder that turns the vessel
_MIN_LEVER = 1e-6


def boat_properties(boat: Boat) -> Iterator[tuple[str, str]]:
    """Yield name and text of the draught, the top speed, and the inputs that turn the vessel to either side."""
    if isinstance(boat, SurfaceVessel):
        yield "draught", f"{boat.draught:.4g} m"
    if speed := top_speed(boat):
        yield "top speed", f"{speed:.3g} m/s in calm water, all propellers at their largest speed"
    levers = list(_turning_levers(boat))
    for side, sign in (("port", 1), ("starboard", -1)):
        if names := [name for name, lever in levers if sign * lever > _MIN_LEVER]:
            yield f"to {side}", f"positive {', '.join(names)}"


def _turning_levers(boat: Boat) -> Iterator[tuple[str, float]]:
    """Yield name and lever (m) of each input that turns the vessel.

    A positive rudder angle pushes the hull there to port.
    """
    for i, propeller in enumerate(boat.propellers, 1):
        yield f"propeller_speed[{i}] ({propeller.label})", turning_lever(boat, propeller)
    for i, rudder in enumerate(boat.rudders, 1):
        if rudder.max_angle > 0:  # no keel
            yield f"rudder_angle[{i}] ({rudder.label})", rudder.position[0] - boat.centre_of_mass[0]


def top_speed(boat: Boat) -> float:
    """Return the speed ahead (m/s) at which thrust and resistance balance; 0 if there is none.

    All propellers are immersed and have their largest speed, the vessel is level and keeps its
    course:

        sum a_i (c_i n_i^2 - k_i n_i a_i u) = d_1 u + d_2 u^2 + d_3 u^3

    a_i is the x component of the axis. Propellers that push aft at a positive speed are left out.
    """
    linear, quadratic, cubic = surge_damping(boat)
    ahead = [each for each in boat.propellers if each.axis[0] > 0]
    thrust = sum(each.axis[0] * each.thrust_coefficient * each.max_speed**2 for each in ahead)
    loss = sum(each.axis[0] ** 2 * each.advance_coefficient * each.max_speed for each in ahead)
    roots = np.roots([-cubic, -quadratic, -linear - loss, thrust])
    return float(min((root.real for root in roots if root.imag == 0 < root.real), default=0.0))


def turning_lever(boat: Boat, propeller: Propeller) -> float:
    """Return the yaw moment about the centre of mass over the thrust (m) at the azimuth angle 0.

    Positive: to port.
    """
    x, y = (propeller.position[k] - boat.centre_of_mass[k] for k in (0, 1))
    return x * propeller.axis[1] - y * propeller.axis[0]
