"""Reader of triangles: those that pictures show of a vehicle, and those of obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cosim.core.errors import InputError

from ...json_reader import JsonPath, JsonReader

#: largest number of triangles
MAX_TRIANGLES = 20_000


def read_visual(data: Mapping[str, Any]) -> np.ndarray | None:
    """Return the triangles of the key "visual" (m, body frame), shape (n, 3, 3), or None without this key.

    Args:
        data: Vehicle data; "visual" is {"vertices": [[x, y, z], ...], "faces": [[a, b, c], ...]}, vertices counted from 0.

    Raises:
        InputError: If the mesh is invalid; the subject is the path of the value.
    """
    if "visual" not in data:
        return None
    reader = JsonReader()
    triangles = read_triangles(reader, data["visual"], ("visual",))
    if reader.problems:
        raise InputError(reader.problems)
    return triangles


def read_triangles(reader: JsonReader, value: Any, path: JsonPath) -> np.ndarray | None:
    """Read {"vertices": [[x, y, z], ...], "faces": [[a, b, c], ...]}.

    Return triangles (n, 3, 3), None if they are invalid.
    """
    mesh = reader.read_object(value, path, ("vertices", "faces"), ("source", "note"))
    try:
        vertices, faces = (
            np.array(mesh.get("vertices"), np.float64),
            np.array(mesh.get("faces"), np.int64),
        )
    except (TypeError, ValueError):
        vertices, faces = np.zeros(0), np.zeros(0, np.int64)
    lists = (
        vertices.ndim == faces.ndim == 2
        and vertices.shape[1] == faces.shape[1] == 3
        and np.isfinite(vertices).all()
    )
    text = (
        f"expected vertices [[x, y, z], ...] and 1 to {MAX_TRIANGLES} faces [[a, b, c], ...] of "
        "them"
    )
    if (
        not lists
        or not 0 < len(faces) <= MAX_TRIANGLES
        or not (0 <= faces.min() <= faces.max() < len(vertices))
    ):
        reader.add_problem(path, text)
        return None
    triangles: np.ndarray = vertices[faces]
    return triangles
