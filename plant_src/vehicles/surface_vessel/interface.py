"""Variables of a floating vessel that is given by data, in the order of the equations."""

from __future__ import annotations

from collections.abc import Iterator

from cosim.core.component import Variable

from ..common.interface import (
    CURRENT_INPUTS,
    DECK_OUTPUTS,
    EXTERNAL_LOADS,
    FLOATING_INITIAL_PARAMETERS,
    MOTION_OUTPUTS,
    VESSEL_STATES,
    WAVE_GAIN_INPUT,
    WAVE_PARAMETERS,
    WIND_INPUTS,
    WORLD_OUTPUTS,
    element_states,
    inertia_variables,
    initial_variables,
    matrix_parameter,
    parameter,
)
from ..vessel.actuators import actuator_inputs, actuator_parameters
from ..vessel.boat import boat_parameters
from .surface_vessel import SurfaceVessel

_INITIAL_PARAMETERS = (*initial_variables("xy", "uvw", "pqr"), *FLOATING_INITIAL_PARAMETERS)


def variables(vessel: SurfaceVessel, slots: tuple[int, int] | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs.

    Parameters other than `initial.*` start at the values of the vessel.

    Args:
        vessel: Data of the vessel.
        slots: Numbers of elements of the arrays of propellers and rudders. None means the numbers
            of the vessel.
    """
    slots = slots or vessel.slots
    velocities = "u, v, w, p, q, r"
    return (
        *_INITIAL_PARAMETERS,
        *inertia_variables(vessel.mass, vessel.inertia, "total mass"),
        *boat_parameters(vessel, velocities),
        matrix_parameter(
            "quadratic_damping",
            f"load over squared velocity relative to the water, for {velocities}",
            vessel.quadratic_damping,
        ),
        *_hull_parameters(vessel),
        *actuator_parameters(vessel.propellers, vessel.rudders, slots),
        *WAVE_PARAMETERS,
        *EXTERNAL_LOADS,
        *actuator_inputs(vessel.propellers, vessel.rudders, slots),
        *WIND_INPUTS,
        *CURRENT_INPUTS,
        *WAVE_GAIN_INPUT,
        *MOTION_OUTPUTS,
        *DECK_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def _hull_parameters(vessel: SurfaceVessel) -> Iterator[Variable]:
    hull = vessel.hull
    yield parameter("waterplane_area", "m2", hull.area, "area of the waterplane of all hulls", 0.0)
    text = "second moment of the waterplane about the x axis"
    yield parameter("transverse_moment", "m4", hull.transverse_moment, text, 0.0)
    text = "second moment of the waterplane about the y axis through its centre"
    yield parameter("longitudinal_moment", "m4", hull.longitudinal_moment, text, 0.0)
    text = "centre of the waterplane ahead of O"
    yield parameter("waterplane_centre", "m", hull.waterplane_centre, text)
    text = "beam of a strip: of each of two hulls, half of that of a single one"
    yield parameter("strip_beam", "m", hull.strip_beam, text, 0.0)
    yield parameter("hull_length", "m", hull.length, "length of the waterline", 0.0)
    text = "height of the hulls from the bottom to the deck edge"
    yield parameter("hull_depth", "m", hull.depth, text, 0.0)
    yield parameter("hull_bottom", "m", hull.bottom, "height of the bottom of the hulls above O")
    x, y = hull.drag_point
    text = "distance of the points of the bottom drag"
    ahead, side = "ahead and aft of the waterplane's centre", "from the centre line"
    yield parameter("drag_point.x", "m", x, f"{text} {ahead}", 0.0)
    yield parameter("drag_point.y", "m", y, f"{text} {side}", 0.0)
    vertical, text = hull.vertical_drag_coefficient, "drag coefficient of the bottoms"
    yield parameter("vertical_drag_coefficient", "1", vertical, text, 0.0)
    text = "drag coefficient of the immersed sides in cross-flow"
    yield parameter("cross_flow_drag_coefficient", "1", hull.cross_flow_drag_coefficient, text, 0.0)


def states(propeller_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of a vessel, then the propeller speeds."""
    return (*VESSEL_STATES, *element_states("propeller_speed", propeller_slots))
