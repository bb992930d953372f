"""Summary and description of a vehicle file.

Mass, inertia, dimensions, actuators, top speed and turning of a vessel, parameters of a controller,
mistakes.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import Problem

from ..catalogue import Model, model_from_data
from ..vehicles.multirotor.airframe import Airframe
from ..vehicles.surface_vessel.surface_vessel import SurfaceVessel
from ..vehicles.vessel.actuators import Propeller
from ..vehicles.vessel.boat import Boat
from ..vehicles.vessel_plausibility import surge_damping

#: smallest lever (m) of a propeller or rudder that turns the vessel
_MIN_LEVER = 1e-6


def boat_properties(boat: Boat) -> Iterator[tuple[str, str]]:
    """Yield name and text of draught, top speed, and the inputs that turn the vessel."""
    if isinstance(boat, SurfaceVessel):
        yield "draught", f"{boat.draught:.4g} m"
    if speed := top_speed(boat):
        yield "top speed", f"{speed:.3g} m/s in calm water, all propellers at their largest speed"
    levers = [
        (f"propeller_speed[{i}] ({each.label})", turning_lever(boat, each))
        for i, each in enumerate(boat.propellers, 1)
    ]
    for i, rudder in enumerate(boat.rudders, 1):
        if rudder.max_angle > 0:  # no keel; a positive angle pushes the hull there to port
            lever = rudder.position[0] - boat.centre_of_mass[0]
            levers.append((f"rudder_angle[{i}] ({rudder.label})", lever))
    for side, sign in (("port", 1), ("starboard", -1)):
        if names := [name for name, lever in levers if sign * lever > _MIN_LEVER]:
            yield f"to {side}", f"positive {', '.join(names)}"


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


#: length of the arrays of `multirotor_controller`, and smallest z component of the axes of rotors
#: that it controls
_CONTROLLED_ROTORS, _UPWARDS = 8, 0.95


class VehicleSummary(NamedTuple):
    """Summary of a vehicle.

    Attributes:
        mass: Mass (kg).
        inertia: Moments of inertia about x, y and z or the rows of the tensor; of a planar vessel
            the yaw inertia (kg m2).
        parameters: Parameters of `multirotor_controller` for a multirotor that it can fly; empty
            for other vehicles.
        warnings: Probable mistakes; the subject of each is "arguments" and the path in the vehicle
            file.
        performance: Draught, top speed and sense of turning of a vessel in words, by name.
    """

    mass: float
    inertia: Any
    parameters: Mapping[str, Any]
    warnings: Sequence[Problem]
    performance: Mapping[str, str]


def examine_vehicle(data: Mapping[str, Any], name: str) -> VehicleSummary:
    """Return the summary of a vehicle that is given by its data.

    Raises:
        InputError: With all problems of the data; the subject of each begins with "arguments" and
            continues with the path.
    """
    model = model_from_data(data, name)
    parameters = controller_parameters(model.airframe) if model.airframe else {}
    performance = dict(boat_properties(model.boat)) if model.boat else {}
    return VehicleSummary(
        model.body.mass, _inertia(model), parameters, list(model.warnings()), performance
    )


def describe_vehicle(
    data: Mapping[str, Any], name: str
) -> tuple[Mapping[str, str], Sequence[Variable]]:
    """Return the properties of a vehicle that is given by its data, and its variables in a world.

    Raises:
        InputError: As of `examine_vehicle`.
    """
    model = model_from_data(data, name)
    corners = model.box_corners
    properties = {
        "vehicle": model.name,
        "family": str(data["family"]),
        "description": str(data.get("description", "")),
        "mass": f"{model.body.mass:.6g} kg",
        "inertia": f"{_inertia(model)} kg.m2",
        "boxes": f"{_edges(np.ptp(corners, axis=0))} (length, width, height of all)",
    }
    if isinstance(model.boat, SurfaceVessel):
        hull = model.boat.hull
        hulls = f"{hull.count} of {_edges((hull.length, hull.beam, hull.depth))}"
        properties["hulls"] = f"{hulls} (length, beam, depth)"
    vehicle: Any = model.airframe or model.craft or model.boat
    for kind in ("rotors", "thrusters", "propellers", "rudders"):
        if parts := getattr(vehicle, kind, ()):
            properties[kind] = f"{len(parts)}: {', '.join(part.label for part in parts)}"
    return properties | (dict(boat_properties(model.boat)) if model.boat else {}), model.variables


def _edges(lengths: Iterable[float]) -> str:
    return f"{' x '.join(f'{length:.4g}' for length in lengths)} m"


def controller_parameters(airframe: Airframe) -> Mapping[str, Any]:
    """Return the parameters of `multirotor_controller` for a multirotor.

    Empty if it cannot control these rotors.
    """
    rotors = airframe.rotors
    coefficients = {(rotor.thrust_coefficient, rotor.torque_coefficient) for rotor in rotors}
    if (
        not 3 <= len(rotors) <= _CONTROLLED_ROTORS
        or len(coefficients) > 1
        or min(rotor.axis[2] for rotor in rotors) < _UPWARDS
    ):
        return {}
    rest = [0] * (_CONTROLLED_ROTORS - len(rotors))
    return {
        "mass": _rounded(airframe.mass),
        "inertia": _rounded(np.diag(airframe.inertia)),
        "rotor_count": len(rotors),
        "rotor_x": _rounded([rotor.position[0] for rotor in rotors]) + rest,
        "rotor_y": _rounded([rotor.position[1] for rotor in rotors]) + rest,
        "rotor_sense": [int(rotor.torque_sign) for rotor in rotors] + rest,
        "thrust_coefficient": _rounded(rotors[0].thrust_coefficient),
        "torque_coefficient": _rounded(rotors[0].torque_coefficient),
        "rotor_speed_max": _rounded(airframe.max_rotor_speed),
    }


def _inertia(model: Model) -> Any:
    if model.motion == "planar":
        return _rounded(model.body.inertia[2])
    vehicle: Any = model.airframe or model.craft or model.boat
    tensor = np.asarray(vehicle.inertia)
    is_diagonal = np.allclose(tensor, np.diag(np.diag(tensor)), rtol=0, atol=1e-6 * tensor.max())
    return _rounded(np.diag(tensor) if is_diagonal else tensor)


def _rounded(values: Any) -> Any:
    """Return a number, or nested lists of numbers, to six digits.

    Elements below 1e-9 of the largest one become 0.
    """
    numbers = np.asarray(values, float)
    if not numbers.ndim:
        return float(f"{numbers:.6g}")
    return [
        _rounded(each)
        for each in np.where(np.abs(numbers) < 1e-9 * np.abs(numbers).max(), 0.0, numbers)
    ]
