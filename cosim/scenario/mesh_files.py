"""Mesh files (STL, OBJ, GLB) as vertices and faces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, Problem

SUFFIXES = (".stl", ".obj", ".glb")

_DIGITS = 6  # of coordinates


def read_mesh(file: Path) -> dict[str, Any]:
    """Return the triangles of a mesh file as {"vertices": [[x, y, z], ...], "faces".

    [[a, b, c], ...]}.

    Raises:
        InputError: trimesh is not installed, or the file cannot be read or has no triangles.
    """
    try:
        import trimesh
    except ModuleNotFoundError:
        raise InputError(
            Problem('reading meshes needs trimesh: pip install "fmi-cosim[mesh]"', str(file))
        ) from None
    try:
        mesh: Any = trimesh.load(file, force="mesh")
        corners = np.round(np.asarray(mesh.triangles, np.float64).reshape(-1, 3), _DIGITS)
    except Exception as error:
        raise InputError(Problem(f"cannot be read: {error}", str(file))) from None
    if not len(corners):
        raise InputError(Problem("contains no triangles", str(file)))
    vertices, faces = np.unique(
        corners + 0.0, axis=0, return_inverse=True
    )  # + 0.0: no negative zeros
    return {"vertices": vertices.tolist(), "faces": faces.reshape(-1, 3).tolist()}
