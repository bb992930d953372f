"""Functions of the shipped plant that commands use: vehicle files, and schemas of its JSON files.

No other module of cosim names the plant. It is imported only when a function needs it.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..components.python_import import import_shipped
from ..core.component import Variable
from ..core.errors import Problem
from .fmu.block import Block

#: file and class of the world
WORLD = "plant_src/world.py:World"
#: file that makes the block of a vehicle file
VEHICLE_PROGRAM = "plant_src/vehicle_files/block.py"

#: data of a vehicle, its centre of mass in the frame of the imported file (m), and warnings
ImportedVehicle = tuple[dict[str, Any], list[float], list[str]]
#: mass (kg), inertia (kg m2), parameters of the controller that flies a multirotor (or none),
#: probable mistakes, and draught, top speed and sense of turning of a vessel in words
VehicleSummary = tuple[float, Any, Mapping[str, Any], Sequence[Problem], Mapping[str, str]]
#: properties by name, and variables of a vehicle in a scenario
VehicleDescription = tuple[Mapping[str, str], Sequence[Variable]]


def _function(name: str) -> Callable[..., Any]:
    """Return a function "module.name" of the plant."""
    module, _, function = name.rpartition(".")
    found: Callable[..., Any] = getattr(import_shipped(f"plant_src.{module}"), function)
    return found


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
    imported: ImportedVehicle = _function("vehicle_files.urdf.vehicle_from_urdf")(urdf, data)
    return imported


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
    read = _function("vehicle_files.mesh_import.vehicle_from_mesh")
    imported: ImportedVehicle = read(mesh, data, scale)
    return imported


def examine_vehicle(data: Mapping[str, Any], name: str) -> VehicleSummary:
    """Read the data of a vehicle as a scenario does.

    Returns:
        Mass, inertia, parameters of the controller that flies it, warnings about probable mistakes,
        and properties of a vessel.

    Raises:
        InputError: With all problems of the data; the subject of each begins with "arguments" and
            continues with the path.
    """
    summary: VehicleSummary = _function("vehicle_files.summary.examine_vehicle")(data, name)
    return summary


def describe_vehicle(data: Mapping[str, Any], name: str) -> VehicleDescription:
    """Return properties and variables of a vehicle that is given by its data.

    Raises:
        InputError: As of `examine_vehicle`.
    """
    described: VehicleDescription = _function("vehicle_files.summary.describe_vehicle")(data, name)
    return described


def vehicle_block(path: Path) -> Block:
    """Return the block of a vehicle file. Raises InputError with all problems of the file."""
    block: Block = _function("vehicle_files.block.vehicle_block")(path)
    return block


def world_schema() -> dict[str, Any]:
    """Return the JSON Schema of the arguments of the world."""
    schema: dict[str, Any] = _function("schemas.world.world_schema")()
    return schema


def vehicle_file_schema() -> dict[str, Any]:
    """Return the JSON Schema of vehicle files."""
    schema: dict[str, Any] = _function("schemas.vehicle.vehicle_schema")()
    return schema
