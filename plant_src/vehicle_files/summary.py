"""Summary of a vehicle file: mass, inertia, parameters of the controller that flies it, and probable mistakes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from cosim.core.errors import Problem

from ..catalogue import model_from_data
from ..vehicles.model import Model
from ..vehicles.multirotor.airframe import Airframe
from .plausibility import vehicle_warnings

#: length of the arrays of `multirotor_controller`, and smallest z component of the axes of rotors that it controls
_CONTROLLED_ROTORS, _UPWARDS = 8, 0.95


class VehicleSummary(NamedTuple):
    """Summary of a vehicle.

    Attributes:
        mass: Mass (kg).
        inertia: Moments of inertia about x, y and z or the rows of the tensor; of a planar vessel the yaw inertia (kg m2).
        parameters: Parameters of `multirotor_controller` for a multirotor that it can fly; empty for other vehicles.
        warnings: Probable mistakes; the subject of each is "arguments" and the path in the vehicle file.
    """

    mass: float
    inertia: Any
    parameters: Mapping[str, Any]
    warnings: Sequence[Problem]


def examine_vehicle(data: Mapping[str, Any], name: str) -> VehicleSummary:
    """Return the summary of a vehicle that is given by its data.

    Raises:
        InputError: With all problems of the data; the subject of each begins with "arguments" and continues with the path.
    """
    model = model_from_data(data, name)
    parameters = controller_parameters(model.airframe) if model.airframe else {}
    return VehicleSummary(model.body.mass, _inertia(model), parameters, list(vehicle_warnings(model)))


def controller_parameters(airframe: Airframe) -> Mapping[str, Any]:
    """Return the parameters of `multirotor_controller` for a multirotor; empty if it cannot control these rotors."""
    rotors = airframe.rotors
    coefficients = {(rotor.thrust_coefficient, rotor.torque_coefficient) for rotor in rotors}
    if not 3 <= len(rotors) <= _CONTROLLED_ROTORS or len(coefficients) > 1 or min(rotor.axis[2] for rotor in rotors) < _UPWARDS:
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
    """Return a number, or nested lists of numbers, to six digits; elements below 1e-9 of the largest one become 0."""
    numbers = np.asarray(values, float)
    if not numbers.ndim:
        return float(f"{numbers:.6g}")
    return [_rounded(each) for each in np.where(np.abs(numbers) < 1e-9 * np.abs(numbers).max(), 0.0, numbers)]
