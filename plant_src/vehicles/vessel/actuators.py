"""Propellers and rudders of vessels that are given by data: values, parameters and inputs.

A propeller is anything that pushes along an axis: a propeller, a thruster in a tunnel, an azimuth
thruster. The arrays have as many elements as the vessel has propellers or rudders, or more: the
equations of all vessels of a family are compiled once, for MAX_PROPELLERS and MAX_RUDDERS. Elements
without a propeller or rudder are 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cosim.core.component import Variable
from cosim.core.units import parse_unit

from ..common.interface import element_labels, parameter
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


#: attribute of a propeller -> parameter, unit, description
PROPELLER_ARRAYS = {
    "thrust_coefficient": (
        "thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at positive speeds",
    ),
    "reverse_thrust_coefficient": (
        "reverse_thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at negative speeds",
    ),
    "max_speed": ("max_propeller_speed", "rad/s", "largest speed"),
    "max_reverse_speed": ("max_reverse_speed", "rad/s", "largest magnitude of negative speeds"),
    "time_constant": (
        "propeller_time_constant",
        "s",
        f"time constant of the speed, at least {MIN_TIME_CONSTANT}; 0: no lag",
    ),
    "radius": ("propeller_radius", "m", "radius; 0: always immersed, no race"),
    "advance_coefficient": (
        "advance_coefficient",
        "kg/rad",
        "loss of thrust over speed and axial velocity of the water",
    ),
    "max_azimuth": ("max_azimuth", "rad", "largest azimuth angle; 0: fixed"),
}
#: the same of a rudder
RUDDER_ARRAYS = {
    "area": ("rudder_area", "m2", "area"),
    "max_lift_coefficient": (
        "rudder_lift_coefficient",
        "1",
        "lift coefficient at and beyond the stall angle",
    ),
    "stall_angle": ("stall_angle", "rad", "angle of attack beyond which the lift is constant"),
    "max_angle": ("max_rudder_angle", "rad", "largest rudder angle"),
    "propeller": (
        "rudder_propeller",
        "1",
        "number of the propeller in whose race the rudder is; 0: none",
    ),
}


def actuator_parameters(
    propellers: Sequence[Propeller], rudders: Sequence[Rudder], slots: tuple[int, int]
) -> Iterator[Variable]:
    """Yield the parameters.

    `slots` are the numbers of elements of the arrays of propellers and of rudders.
    """
    yield from _kind_parameters(
        "propeller", propellers, PROPELLER_ARRAYS, ("position", "axis"), slots[0]
    )
    yield from _kind_parameters("rudder", rudders, RUDDER_ARRAYS, ("position",), slots[1])


def _kind_parameters(
    kind: str,
    elements: Sequence[Propeller | Rudder],
    arrays: dict[str, tuple[str, str, str]],
    vectors: tuple[str, ...],
    slots: int,
) -> Iterator[Variable]:
    if not slots:
        return
    yield parameter(
        f"{kind}_count", "1", float(len(elements)), f"number of {kind}s", 0.0, float(slots)
    )
    for name in vectors:
        unit, text = (
            ("m", f"{name}, from O") if name == "position" else ("1", "direction of the thrust")
        )
        for k, letter in enumerate("xyz"):
            values = [getattr(element, name)[k] for element in elements]
            yield _array(
                f"{kind}_{name}.{letter}",
                unit,
                f"{kind}s: {text}: {letter}, body frame",
                values,
                slots,
            )
    for attribute, (name, unit, text) in arrays.items():
        yield _array(
            name,
            unit,
            f"{kind}s: {text}",
            [float(getattr(element, attribute)) for element in elements],
            slots,
        )


def _array(name: str, unit: str, description: str, values: Sequence[float], slots: int) -> Variable:
    start = (*values, *[0.0] * (slots - len(values)))
    return Variable(
        name, "Float64", "parameter", "fixed", start, parse_unit(unit), (slots,), description
    )


def actuator_inputs(
    propellers: Sequence[Propeller], rudders: Sequence[Rudder], slots: tuple[int, int]
) -> Iterator[Variable]:
    """Yield the commands.

    A vessel without azimuth thrusters or rudders, and without slots for more, has no such commands.
    """
    labels = element_labels([each.label for each in propellers], slots[0], "propeller_count")
    angles = element_labels([each.label for each in rudders], slots[1], "rudder_count")
    yield _command("propeller_speed", "rad/s", f"commanded propeller speeds ({labels})", slots[0])
    if slots[0] > len(propellers) or any(propeller.max_azimuth for propeller in propellers):
        text = (
            f"azimuth angles ({labels}), without lag; positive: the thrust turns to port, at the "
            "stern the bow to starboard"
        )
        yield _command("azimuth", "rad", text, slots[0])
    if slots[1]:
        text = (
            f"rudder angles ({angles}); positive: trailing edge to starboard, bow to starboard, "
            "yaw decreases"
        )
        yield _command("rudder_angle", "rad", text, slots[1])


def _command(name: str, unit: str, description: str, slots: int) -> Variable:
    start, shape = (0.0,) * slots, (slots,)
    return Variable(
        name,
        "Float64",
        "input",
        start=start,
        unit=parse_unit(unit),
        shape=shape,
        description=description,
    )
