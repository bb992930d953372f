"""Import, examination and description of vehicle files, by the programs of the shipped plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..components.python_import import load_object
from ..core import resources
from ..core.component import Variable
from ..core.errors import Problem

_URDF_READER = "plant_src/vehicle_files/urdf.py:vehicle_from_urdf"
_MESH_READER = "plant_src/vehicle_files/mesh_import.py:vehicle_from_mesh"
_VEHICLE_CHECK = "plant_src/vehicle_files/summary.py:examine_vehicle"
_DESCRIPTION = "plant_src/vehicle_files/summary.py:describe_vehicle"

#: data of a vehicle, its centre of mass in the frame of the imported file (m), and warnings
ImportedVehicle = tuple[dict[str, Any], list[float], list[str]]
#: mass (kg), inertia (kg m2), parameters of the controller that flies a multirotor (or none),
#: probable mistakes, and draught, top speed and sense of turning of a vessel in words
VehicleSummary = tuple[float, Any, Mapping[str, Any], Sequence[Problem], Mapping[str, str]]
#: properties by name, and variables of a vehicle in a scenario
VehicleDescription = tuple[Mapping[str, str], Sequence[Variable]]


def vehicle_from_urdf(urdf: Path, data: Mapping[str, Any]) -> ImportedVehicle:
    """Return the data of a vehicle with mass, inertia and collision shape of a URDF file.

    Args:
        urdf: URDF file.
        data: Further data of the vehicle; its rotors and thrusters may name links of the URDF file.

    Returns:
        Data, centre of mass in the root frame (m), and warnings.

    Raises:
        InputError: The URDF file cannot be read, or does not describe one rigid body.
    """
    read: Callable[[Path, Mapping[str, Any]], ImportedVehicle] = load_object(
        _URDF_READER, resources.root()
    )
    return read(urdf, data)


def vehicle_from_mesh(mesh: Path, data: Mapping[str, Any], scale: float) -> ImportedVehicle:
    """Return the data of a vehicle with inertia, collision shape and appearance of a mesh.

    Args:
        mesh: STL, OBJ or GLB file.
        data: Further data of the vehicle, with its mass.
        scale: Factor on all coordinates.

    Returns:
        Data, centre of mass in the frame of the mesh (m), and warnings.

    Raises:
        InputError: The mesh cannot be read or encloses no volume, or the data have no mass.
    """
    read: Callable[[Path, Mapping[str, Any], float], ImportedVehicle] = load_object(
        _MESH_READER, resources.root()
    )
    return read(mesh, data, scale)


def examine_vehicle(data: Mapping[str, Any], name: str) -> VehicleSummary:
    """Read the data of a vehicle as a scenario does.

    Returns:
        Mass, inertia, parameters of the controller that flies it, warnings about probable mistakes,
        and properties of a vessel.

    Raises:
        InputError: With all problems of the data; the subject of each begins with "arguments" and
            continues with the path.
    """
    examine: Callable[[Mapping[str, Any], str], VehicleSummary] = load_object(
        _VEHICLE_CHECK, resources.root()
    )
    return examine(data, name)


def describe_vehicle(data: Mapping[str, Any], name: str) -> VehicleDescription:
    """Return the properties of a vehicle that is given by its data, and its variables in a scenario.

    Raises:
        InputError: As of `examine_vehicle`.
    """
    describe: Callable[[Mapping[str, Any], str], VehicleDescription] = load_object(
        _DESCRIPTION, resources.root()
    )
    return describe(data, name)
