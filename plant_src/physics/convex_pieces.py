"""Convex pieces of collision shapes as files, because Bullet reads the meshes of a compound shape from files."""

from __future__ import annotations

from hashlib import sha256

from cosim.core import resources
from cosim.results.files import writing_atomically

from ..vehicles.common.shapes import ConvexPiece


def mesh_file(piece: ConvexPiece) -> str:
    """Return the path of an OBJ file in the user's cache directory, whose convex hull is the piece.

    Bullet uses the vertices only; the faces make it read them.
    """
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in piece.points]
    lines += [f"f 1 {number} {number + 1}" for number in range(2, len(piece.points))]
    content = "\n".join([*lines, ""]).encode()
    path = resources.cache_directory() / "meshes" / f"{sha256(content).hexdigest()[:20]}.obj"
    if not path.exists():
        with writing_atomically(path) as temporary:
            temporary.write_bytes(content)
    return str(path)
