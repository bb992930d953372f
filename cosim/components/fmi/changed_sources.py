"""Comparison of an FMU with the sources from which `cosim build` made it."""

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path, PurePosixPath
from zlib import crc32

from ..python_import import read_with_relative_imports
from .file import FmuFile

#: part of the warning about an FMU with changed sources
OTHER_VERSION = "was built from another version of"
#: files that `cosim build` copies into an FMU
_SUFFIXES = (".py", ".mo", ".c", ".h")
#: suffix of a source -> word for a name in it
_MEMBERS = {".mo": "MODEL", ".py": "CLASS"}
#: folders of an FMU with copies of sources
_FOLDERS = ("resources", "sources")
#: folder of the FMUs of a project, and folder beside it with the sources of controllers
_FMUS, _CONTROLLERS = "fmus", "controllers"


def find_changed_sources(file: FmuFile) -> list[Path]:
    """Return the sources of an FMU that differ from the copies that `cosim build` put into it.

    They are searched beside the FMU. For an FMU in the folder `fmus` of a project they are searched
    in `controllers`, its subfolders and the project folder too.
    """
    changed = []
    for source, checksums in _find_sources(file).items():
        contents = [source.read_bytes()]
        if source.suffix == ".py":
            # `cosim build` may have made the imports relative
            with suppress(SyntaxError, ValueError):  # such a file has not been exported
                contents.append(read_with_relative_imports(source, source.parent).encode())
        if set(map(crc32, contents)).isdisjoint(checksums):
            changed.append(source)
    return changed


def changed_sources_warning(file: FmuFile) -> str:
    """Return the warning about changed sources of an FMU with the command that builds it again.

    "" if there are none.
    """
    changed = [os.path.relpath(source) for source in find_changed_sources(file)]
    if not changed:
        return ""
    fmu = os.path.relpath(file.path)
    return (
        f'"{fmu}" {OTHER_VERSION} {", ".join(changed)}: `cosim build {_reference(file)} --output '
        f"{fmu}` builds it again"
    )


def _reference(file: FmuFile) -> str:
    """Return the source of an FMU as `cosim build` needs it.

    MODEL or CLASS stands for a name that is not that of the file.
    """
    sources = list(_find_sources(file))
    model = file.description.model_name.replace("_", "").lower()
    own = [source for source in sources if source.stem.replace("_", "").lower() == model]
    source = min(own or sources, key=lambda path: len(path.parts))
    name = os.path.relpath(source if source.suffix in _MEMBERS else source.parent)
    return name if own or source.suffix not in _MEMBERS else f"{name}:{_MEMBERS[source.suffix]}"


def _find_sources(file: FmuFile) -> dict[Path, list[int]]:
    """Return the sources of an FMU that exist with the checksums of their copies in it."""
    copies: dict[str, list[int]] = {}
    for member, checksum in file.examination.members.items():
        folder, _, name = member.partition("/")
        if folder in _FOLDERS and PurePosixPath(name).suffix in _SUFFIXES:
            copies.setdefault(name, []).append(checksum)
    for base in _source_folders(file.path.parent) if copies else ():
        names = [name for name in sorted(copies) if (base / name).is_file()]
        if names:
            return {base / name: copies[name] for name in names}
    return {}


def _source_folders(folder: Path) -> Iterator[Path]:
    """Yield the folders that may contain the sources of an FMU in a folder."""
    yield folder
    project = folder.absolute().parent
    if folder.name == _FMUS:
        controllers = project / _CONTROLLERS
        yield controllers
        yield from sorted(each for each in controllers.glob("*") if each.is_dir())
        yield project
