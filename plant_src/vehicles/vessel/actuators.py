"""Propellers and rudders of vessels that are given by data: values, parameters and inputs.

A propeller is anything that pushes along an axis: a propeller, a thruster in a tunnel, an azimuth
thruster. The arrays have as many elements as the vessel has propellers or rudders, or more: the
equations of all vessels of a family are compiled once, for MAX_PROPELLERS and MAX_RUDDERS. Elements
without a propeller or rudder are 0.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cosim.core.component import Variable

from ..common.interface import element_commands, element_labels, element_parameters, parameter
from ..common.shapes import Vector

#: largest numbers of propellers and rudders
MAX_PROPELLERS, MAX_RUDDERS = 16, 16

#: shortest time constant of a propeller with a lag (s), because the integration steps take 5 ms
MIN_TIME_CONSTANT = 0.01


@dataclass(frozen=True)
class Propeller:
    """One propeller or thruster.

    Positions and directions are in the body frame from the origin O of the vessel.

    Attributes:
        label: Place of the propeller in words.
        position: Centre of the propeller (m).
        axis: Unit vector of the thrust at a positive speed and the azimuth angle 0.
        thrust_coefficient: Thrust over squared speed at positive speeds (N s2/rad2).
        reverse_thrust_coefficient: The same at negative speeds.
        max_speed: Largest speed (rad/s).
        max_reverse_speed: Largest magnitude of negative speeds (rad/s).
        time_constant: Time constant of the speed (s); 0: no lag.
        radius: Radius (m): thrust fades as the propeller emerges, and a rudder feels its race; 0:
            always immersed, no race.
        advance_coefficient: Loss of thrust over speed and axial velocity of the water (kg/rad).
        max_azimuth: Largest azimuth angle about the z axis (rad); 0: the axis is fixed.
    """

    label: str
    position: Vector
    axis: Vector
    thrust_coefficient: float
    reverse_thrust_coefficient: float
    max_speed: float
    max_reverse_speed: float
    time_constant: float = 0.0
    radius: float = 0.0
    advance_coefficient: float = 0.0
    max_azimuth: float = 0.0


@dataclass(frozen=True)
class Rudder:
    """One rudder.

    Attributes:
        label: Place of the rudder in words.
        position: Centre of pressure (m, body frame from O).
        area: Area (m2).
        max_lift_coefficient: Lift coefficient at and beyond the stall angle.
        stall_angle: Angle of attack beyond which the lift is constant (rad).
        max_angle: Largest rudder angle (rad).
        propeller: Number of the propeller in whose race the rudder is; 0: none.
    """

    label: str
    position: Vector
    area: float
    max_lift_coefficient: float
    stall_angle: float
    max_angle: float
    propeller: int = 0


#: attribute of a propeller, and name, unit and description of its parameter
_PROPELLER_COLUMNS = (
    ("position", "propeller_position", "m", "position, from O"),
    ("axis", "propeller_axis", "1", "direction of the thrust"),
    (
        "thrust_coefficient",
        "thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at positive speeds",
    ),
    (
        "reverse_thrust_coefficient",
        "reverse_thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at negative speeds",
    ),
    ("max_speed", "max_propeller_speed", "rad/s", "largest speed"),
    (
        "max_reverse_speed",
        "max_reverse_speed",
        "rad/s",
        "largest magnitude of negative speeds",
    ),
    (
        "time_constant",
        "propeller_time_constant",
        "s",
        f"time constant of the speed, at least {MIN_TIME_CONSTANT}; 0: no lag",
    ),
    ("radius", "propeller_radius", "m", "radius; 0: always immersed, no race"),
    (
        "advance_coefficient",
        "advance_coefficient",
        "kg/rad",
        "loss of thrust over speed and axial velocity of the water",
    ),
    ("max_azimuth", "max_azimuth", "rad", "largest azimuth angle; 0: fixed"),
)
#: the same of a rudder
_RUDDER_COLUMNS = (
    ("position", "rudder_position", "m", "position, from O"),
    ("area", "rudder_area", "m2", "area"),
    (
        "max_lift_coefficient",
        "rudder_lift_coefficient",
        "1",
        "lift coefficient at and beyond the stall angle",
    ),
    (
        "stall_angle",
        "stall_angle",
        "rad",
        "angle of attack beyond which the lift is constant",
    ),
    ("max_angle", "max_rudder_angle", "rad", "largest rudder angle"),
    (
        "propeller",
        "rudder_propeller",
        "1",
        "number of the propeller in whose race the rudder is; 0: none",
    ),
)


def actuator_parameters(
    propellers: Sequence[Propeller], rudders: Sequence[Rudder], slots: tuple[int, int]
) -> Iterator[Variable]:
    """Yield the parameters.

    `slots` are the numbers of elements of the arrays of propellers and of rudders.
    """
    kinds: tuple[tuple[str, Sequence[object], tuple[tuple[str, str, str, str], ...]], ...] = (
        ("propeller", propellers, _PROPELLER_COLUMNS),
        ("rudder", rudders, _RUDDER_COLUMNS),
    )
    for (kind, elements, columns), count in zip(kinds, slots, strict=True):
        if count:
            number, text = float(len(elements)), f"number of {kind}s"
            yield parameter(f"{kind}_count", "1", number, text, 0.0, float(count))
            yield from element_parameters(kind, elements, columns, count)


def actuator_inputs(
    propellers: Sequence[Propeller], rudders: Sequence[Rudder], slots: tuple[int, int]
) -> Iterator[Variable]:
    """Yield the commands.

    A vessel without azimuth thrusters or rudders, and without slots for more, has no such commands.
    """
    labels = element_labels([each.label for each in propellers], slots[0], "propeller_count")
    angles = element_labels([each.label for each in rudders], slots[1], "rudder_count")
    yield element_commands(
        "propeller_speed", "rad/s", f"commanded propeller speeds ({labels})", slots[0]
    )
    if slots[0] > len(propellers) or any(propeller.max_azimuth for propeller in propellers):
        text = (
            f"azimuth angles ({labels}), without lag; positive: the thrust turns to port, at the "
            "stern the bow to starboard"
        )
        yield element_commands("azimuth", "rad", text, slots[0])
    if slots[1]:
        text = (
            f"rudder angles ({angles}); positive: trailing edge to starboard, bow to starboard, "
            "yaw decreases"
        )
        yield element_commands("rudder_angle", "rad", text, slots[1])
