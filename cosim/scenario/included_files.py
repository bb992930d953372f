"""Files that the arguments of components name, for example vehicle files and meshes.

A text in "arguments" of a component or of the scene that ends in ".json" stands for the content of
this file, and the name of an STL, OBJ or GLB file at the key "mesh" for its triangles. Paths start
from the folder of the file that contains the text.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError, Problem
from .json_document import Document, JsonPath, Origin, path_in_system, read_document

SUFFIX = ".json"


def include_files(document: Document) -> Document:
    """Replace the names of files in arguments of components and the scene by their contents.

    Problems of an included value name the file and line in which it was written. A file that
    cannot be read is a problem of the
    result.
    """
    value = document.value if isinstance(document.value, dict) else {}
    components, inclusion = value.get("components"), _Inclusion(document)
    included: dict[str, Any] = {}
    if isinstance(components, dict):
        included["components"] = {
            name: inclusion.include_in(each, "components", name)
            for name, each in components.items()
        }
    if "scene" in value:
        included["scene"] = inclusion.include_in(value["scene"], "scene")
    if not (inclusion.files or inclusion.problems):
        return document
    return replace(
        document,
        value={**value, **included},
        problems=[*document.problems, *inclusion.problems],
        invalid_paths=[*document.invalid_paths, *inclusion.invalid_paths],
        origins={**document.origins, **inclusion.origins},
        bases=(*document.bases, *inclusion.files),
    )


def include_in_setting(
    keys: Sequence[str], value: Any, folder: Path
) -> tuple[Any, list[Path], dict[JsonPath, Document]]:
    """Return the value of a setting with the contents of files; the files; JSON files by path.

    Args:
        keys: Keys of the JSON pointer that is set.
        value: Value to set.
        folder: Folder that its paths start from.

    Raises:
        InputError: A file cannot be read.
    """
    files: list[Path] = []
    documents: dict[JsonPath, Document] = {}

    def read(text: str, path: JsonPath) -> Any:
        if not text.endswith(SUFFIX):
            files.append(folder / text)
            return read_mesh(folder / text)
        file = read_document(folder / text)
        if file.problems:
            raise InputError(file.problems)
        files.append(file.file)
        documents[path] = file
        return file.value

    match path_in_system(keys):
        case ["scene", "arguments", *_] | ["components", _, "arguments", *_]:
            is_argument = True
        case _:
            is_argument = False
    return (_replace_names(value, (), read) if is_argument else value), files, documents


def _replace_names(value: Any, path: JsonPath, content: Callable[[str, JsonPath], Any]) -> Any:
    """Replace each name of a file in a value by content(name, path of the name)."""
    if isinstance(value, dict):
        return {key: _replace_names(each, (*path, key), content) for key, each in value.items()}
    if isinstance(value, list):
        return [_replace_names(each, (*path, i), content) for i, each in enumerate(value)]
    return content(value, path) if isinstance(value, str) and _names_file(value, path) else value


def _names_file(text: str, path: JsonPath) -> bool:
    """Return whether a text names a file to include."""
    return text.endswith(SUFFIX) or (
        path[-1:] == ("mesh",) and text.lower().endswith(MESH_SUFFIXES)
    )


class _Inclusion:
    """Inclusion of files into one document.

    Results: `files`, `origins`, `problems`, `invalid_paths`.
    """

    def __init__(self, document: Document) -> None:
        self._document = document
        self.files: list[Path] = []
        self.origins: dict[JsonPath, Origin] = {}
        self.problems: list[Problem] = []
        self.invalid_paths: list[JsonPath] = []

    def include_in(self, value: Any, *path: str) -> Any:
        """Return the component or scene at `path` with the included files in its arguments."""
        if not isinstance(value, dict) or "arguments" not in value:
            return value
        return {
            **value,
            "arguments": _replace_names(value["arguments"], (*path, "arguments"), self._content),
        }

    def _content(self, text: str, path: JsonPath) -> Any:
        try:
            if not text.endswith(SUFFIX):
                self.files.append(self._document.file.parent / text)
                return read_mesh(self.files[-1])
            file = read_document(self._document.file.parent / text)
        except InputError as error:
            self.problems += error.located(self._document.where(path))
            self.invalid_paths.append(path)
            return {}
        self.files.append(file.file)
        self.problems += file.problems
        self.invalid_paths += [(*path, *each) for each in file.invalid_paths]
        self.origins |= {(*path, *each): Origin(file, each) for each in file.offsets}
        return file.value


#: ends of the names of mesh files
MESH_SUFFIXES = (".stl", ".obj", ".glb")

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
