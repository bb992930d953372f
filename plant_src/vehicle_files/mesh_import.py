"""Import of meshes (STL, OBJ, GLB) into vehicle files.

Mass properties, convex pieces of the collision shape, triangles to show; also triangles of boxes,
cylinders and spheres.

trimesh (extra "mesh") reads the files. Only the import needs it: the vehicle file contains all
results. Coordinates are taken as they are: x forward, y left, z up.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cosim.core.errors import InputError, Problem, nearest_file

from ..vehicles.common.shapes import outermost_points
from ..vehicles.common.vehicle_reader import MAX_TRIANGLES

_SIDES = 24  # of a cylinder or sphere


def box_triangles(edges: Sequence[float]) -> np.ndarray:
    """Return the triangles of a box with these edges (m) around the origin, shape (12, 3, 3)."""
    bottom = np.array([(1, 1, -1), (-1, 1, -1), (-1, -1, -1), (1, -1, -1)])
    return _stacked(np.stack([bottom, bottom * (1, 1, -1)]) * np.asarray(edges) / 2)


def cylinder_triangles(radius: float, length: float) -> np.ndarray:
    """Return the triangles of a cylinder along z around the origin (m), shape (n, 3, 3)."""
    return _stacked(np.stack([_ring(radius, -length / 2), _ring(radius, length / 2)]))


def sphere_triangles(radius: float) -> np.ndarray:
    """Return the triangles of a sphere around the origin (m), shape (n, 3, 3)."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, _SIDES // 2 + 1)[1:-1]
    return _stacked(
        np.stack([_ring(radius * np.cos(angle), radius * np.sin(angle)) for angle in angles])
    )


def _ring(radius: float, height: float) -> np.ndarray:
    angles = np.arange(_SIDES) * 2 * np.pi / _SIDES
    return np.column_stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(_SIDES, height)]
    )


def _stacked(rings: np.ndarray) -> np.ndarray:
    """Return the closed surface through rings of points, shape (levels, n, 3).

    The rings are from bottom to top and counter-clockwise, seen from above.
    """
    following = np.roll(rings, -1, axis=1)
    lower = np.stack([rings[:-1], following[:-1], following[1:]], axis=2)
    upper = np.stack([rings[:-1], following[1:], rings[1:]], axis=2)
    bottom, top = (
        np.stack(
            [np.broadcast_to(ring.mean(axis=0), ring.shape), ring, np.roll(ring, -1, axis=0)],
            axis=1,
        )
        for ring in (rings[0, ::-1], rings[-1])
    )
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3), bottom, top])


_DIGITS = 6  # of coordinates in vehicle files (m)

#: formats that trimesh reads without further packages
FORMATS = "STL, OBJ, GLB, PLY"


class ImportedVehicle(NamedTuple):
    """Data of a vehicle, centre of mass, and probable mistakes in the imported file.

    The centre of mass is in the frame of that file (m).
    """

    data: dict[str, Any]
    centre: list[float]
    warnings: list[str]


def load_mesh(path: Path, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> Any:
    """Return the mesh of a file as a `trimesh.Trimesh`.

    Args:
        path: STL, OBJ or GLB file, or another format that trimesh reads.
        scale: Factors along x, y and z, for example 0.001 for coordinates in mm.

    Raises:
        InputError: trimesh is not installed, or the file cannot be read, has another format or no
            triangles.
    """
    try:
        import trimesh
    except ModuleNotFoundError:
        raise InputError('reading meshes needs trimesh: pip install "fmi-cosim[mesh]"') from None
    if not path.is_file():
        raise InputError(Problem(f"the file does not exist{nearest_file(path)}", str(path)))
    if path.suffix[1:].lower() not in trimesh.available_formats():
        raise InputError(
            Problem(
                f'the format "{path.suffix}" is not read; convert the file to one of {FORMATS}',
                str(path),
            )
        )
    try:
        mesh: Any = trimesh.load(path, force="mesh")
    except Exception as error:
        raise InputError(Problem(f"cannot be read: {error}", str(path))) from None
    if not 0 < len(mesh.faces) <= MAX_TRIANGLES:
        raise InputError(
            Problem(f"found {len(mesh.faces)} triangles, expected 1 to {MAX_TRIANGLES}", str(path))
        )
    mesh.apply_scale(scale)
    return mesh


def convex_pieces(mesh: Any) -> list[np.ndarray]:
    """Return the points (m) of the convex hull of each connected part, at most MAX_POINTS each."""
    parts = mesh.split(only_watertight=False)
    return [
        outermost_points(np.asarray(part.convex_hull.vertices))
        for part in (parts if len(parts) else [mesh])
    ]


def piece_data(points: np.ndarray, source: str) -> dict[str, Any]:
    """Return the element of "boxes" for the points (m, body frame) of a convex piece."""
    return {"points": np.round(points, _DIGITS).tolist(), "source": source}


def visual_data(triangles: np.ndarray, source: str) -> dict[str, Any]:
    """Return "visual" of a vehicle file for triangles (m, body frame), shape (n, 3, 3)."""
    vertices, faces = np.unique(
        np.round(triangles.reshape(-1, 3), _DIGITS), axis=0, return_inverse=True
    )
    return {"vertices": vertices.tolist(), "faces": faces.reshape(-1, 3).tolist(), "source": source}


def vehicle_from_mesh(path: Path, data: Mapping[str, Any], scale: float = 1.0) -> ImportedVehicle:
    """Return the data of a vehicle with the inertia, collision shape and appearance of a mesh.

    Args:
        path: Mesh file.
        data: Further data of the vehicle with its "mass". The mass is distributed evenly over the
            volume of the mesh. The origin of multirotors and submerged vehicles becomes the centre
            of mass; that of vessels remains the origin of the mesh.
        scale: Factor on all coordinates.

    Raises:
        InputError: The mesh cannot be read or encloses no volume, or the data have no mass.
    """
    mesh, source = load_mesh(path, (scale,) * 3), f"mesh file {path.name}"
    if not mesh.is_volume:
        raise InputError(
            Problem(
                "encloses no volume: its surface has holes, or its faces point inwards", str(path)
            )
        )
    mass = data.get("mass")
    value = mass.get("value") if isinstance(mass, Mapping) else mass
    if not isinstance(value, int | float):
        raise InputError(
            '"mass" is missing in the accompanying file; the mesh gives its distribution only'
        )
    inertia = np.asarray(mesh.moment_inertia) * value / float(mesh.volume)
    uniform = f"{source}, even density"
    is_vessel = data.get("family") in ("surface_vessel", "planar_vessel")
    centre = np.asarray(mesh.center_mass)
    origin = np.zeros(3) if is_vessel else centre
    result = {
        **data,
        "boxes": data.get(
            "boxes", [piece_data(points - origin, source) for points in convex_pieces(mesh)]
        ),
        "visual": data.get("visual", visual_data(np.asarray(mesh.triangles) - origin, source)),
    }
    if data.get("family") == "planar_vessel":
        result.setdefault(
            "yaw_inertia", {"value": float(inertia[2, 2]), "unit": "kg.m2", "source": uniform}
        )
    else:
        result.setdefault(
            "inertia",
            {"value": ((inertia + inertia.T) / 2).tolist(), "unit": "kg.m2", "source": uniform},
        )
    if is_vessel:
        result.setdefault(
            "centre_of_mass", {"value": centre.tolist(), "unit": "m", "source": uniform}
        )
    return ImportedVehicle(result, centre.tolist(), [])
