"""Variables of a floating vessel that is given by data, in the order of the equations."""

from __future__ import annotations

from cosim.core.component import Variable

from ..common.interface import (
    EXTERNAL_LOADS,
    FLOATING_INITIAL_PARAMETERS,
    FLOATING_INPUTS,
    VESSEL_OUTPUTS,
    VESSEL_STATES,
    WAVE_PARAMETERS,
    attribute_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    matrix_parameter,
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
        *attribute_parameters(vessel.hull, _HULL_PARAMETERS),
        *actuator_parameters(vessel.propellers, vessel.rudders, slots),
        *WAVE_PARAMETERS,
        *EXTERNAL_LOADS,
        *actuator_inputs(vessel.propellers, vessel.rudders, slots),
        *FLOATING_INPUTS,
        *VESSEL_OUTPUTS,
    )


#: attribute, and name, unit, smallest value and description of its parameter
_HULL_PARAMETERS = (
    ("area", "waterplane_area", "m2", 0.0, "area of the waterplane of all hulls"),
    (
        "transverse_moment",
        "transverse_moment",
        "m4",
        0.0,
        "second moment of the waterplane about the x axis",
    ),
    (
        "longitudinal_moment",
        "longitudinal_moment",
        "m4",
        0.0,
        "second moment of the waterplane about the y axis through its centre",
    ),
    ("waterplane_centre", "waterplane_centre", "m", None, "centre of the waterplane ahead of O"),
    (
        "strip_beam",
        "strip_beam",
        "m",
        0.0,
        "beam of a strip: of each of two hulls, half of that of a single one",
    ),
    ("length", "hull_length", "m", 0.0, "length of the waterline"),
    ("depth", "hull_depth", "m", 0.0, "height of the hulls from the bottom to the deck edge"),
    ("bottom", "hull_bottom", "m", None, "height of the bottom of the hulls above O"),
    (
        "drag_point_ahead",
        "drag_point.x",
        "m",
        0.0,
        "distance of the points of the bottom drag ahead and aft of the waterplane's centre",
    ),
    (
        "drag_point_abeam",
        "drag_point.y",
        "m",
        0.0,
        "distance of the points of the bottom drag from the centre line",
    ),
    (
        "vertical_drag_coefficient",
        "vertical_drag_coefficient",
        "1",
        0.0,
        "drag coefficient of the bottoms",
    ),
    (
        "cross_flow_drag_coefficient",
        "cross_flow_drag_coefficient",
        "1",
        0.0,
        "drag coefficient of the immersed sides in cross-flow",
    ),
)


def states(propeller_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of a vessel, then the propeller speeds."""
    return (*VESSEL_STATES, *element_states("propeller_speed", propeller_slots))
