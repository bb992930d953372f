"""Check of an FMU's library for a platform, without loading it."""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path

from ....core.errors import abbreviate_names
from . import elf, macho, pe
from .archive import Archive
from .c_functions import called_functions, standard_functions
from .findings import Finding, escape_unprintable
from .model_description import Interface, ModelDescription
from .platforms import EXPECTED_TEXTS, FmuPlatform, InvalidLibraryError, SharedLibrary

#: largest size of the library for this platform (bytes), which is read into memory
MAX_LIBRARY_SIZE = 1 << 28
#: platform of the libraries that run under Wine
WINDOWS = FmuPlatform("windows", "x86_64", ".dll")

_READERS: Mapping[str, Callable[[bytes, str], SharedLibrary]] = {
    ".so": elf.read_library,
    ".dll": pe.read_library,
    ".dylib": macho.read_library,
}


def list_platforms(names: Iterable[str]) -> list[str]:
    """List the platforms of an FMU.

    Args:
        names: Names of the members of the archive.

    Returns:
        Names of the folders with libraries, and "c-code" if the FMU contains sources.
    """
    parts = [name.split("/") for name in names]
    folders = {
        part[1]
        for part in parts
        if len(part) == 3 and part[0] == "binaries" and part[2].endswith(tuple(_READERS))
    }
    sources = any(
        part[0] == "sources" and part[-1].endswith((".c", ".cpp"))
        for part in parts
        if len(part) > 1
    )
    return [*sorted(folders), *(["c-code"] if sources else [])]


def check_binary(
    archive: Archive,
    model: ModelDescription,
    interface: Interface,
    machine: FmuPlatform,
) -> Iterator[Finding]:
    """Check the library for a platform.

    It exists, is complete, and exports the functions that the importer calls.

    Args:
        archive: The FMU.
        model: Its model description.
        interface: Interface whose library is checked.
        machine: The platform.

    Raises:
        FatalFindingError: The data of the library are damaged.
    """
    folder = machine.binary_folder(model.major)
    platforms = list_platforms(archive.members)
    if folder not in platforms:
        names = (
            folder if folder == machine.platform_tuple else f"{machine.platform_tuple} ({folder})"
        )
        if "c-code" in platforms:
            yield Finding(
                "binary.sources-only",
                f"has no binary for {names}; its sources are compiled when it is used",
            )
            return
        if (
            machine.platform_tuple == "x86_64-linux"
            and WINDOWS.binary_folder(model.major) in platforms
        ):
            yield Finding(
                "binary.windows-only",
                f"has no binary for {names}; its library for Windows runs under Wine",
            )
            return
        bits = (
            "; 32-bit libraries for Windows cannot be used"
            if {"win32", "x86-windows"} & set(platforms)
            else ""
        )
        yield Finding(
            "binary.platform",
            f"has no binary for {names}; it has: {', '.join(platforms) or 'no binaries'}{bits}",
        )
        return
    identifier = model.interfaces[interface].get("modelIdentifier", "")
    member = f"binaries/{folder}/{identifier}{machine.suffix}"
    if member not in archive.members:
        found = ", ".join(
            name for name in archive.members if name.startswith(f"binaries/{folder}/")
        )
        yield Finding(
            "binary.present",
            f"the library cannot be loaded: {member} does not exist; found: {found}",
        )
    elif archive.members[member].size > MAX_LIBRARY_SIZE:
        yield Finding(
            "binary.size",
            (
                f"the library has {archive.members[member].size} bytes, expected at most "
                f"{MAX_LIBRARY_SIZE}"
            ),
            member,
        )
    else:
        yield from _check_library(archive, member, model, interface, machine)


def _check_library(
    archive: Archive,
    member: str,
    model: ModelDescription,
    interface: Interface,
    machine: FmuPlatform,
) -> Iterator[Finding]:
    try:
        library = _READERS[machine.suffix](archive.read(member), machine.architecture)
    except InvalidLibraryError as error:
        yield Finding("binary.format", f"the library cannot be loaded: it {error}", member)
        return
    called = called_functions(model, interface)
    identifier = model.interfaces[interface]["modelIdentifier"]
    if missing := sorted(called - library.exports):
        yield Finding(
            "binary.functions",
            f"the library does not export {abbreviate_names(missing, limit=5)}",
            member,
        )
    if unused := sorted(
        standard_functions(model.major, interface, identifier) - called - library.exports
    ):
        yield Finding(
            "binary.unused-functions",
            f"the library does not export {abbreviate_names(unused, limit=5)}",
            member,
        )
    for text in version_deviations(library.constant_texts):
        yield Finding("binary.version", text, member)
    for name in library.needed_libraries:
        if not _is_library_found(name, library, archive, member):
            yield Finding(
                "binary.needed",
                f"needs the library {name}, which was not found on this machine",
                member,
            )


def version_deviations(texts: Mapping[str, bytes | None]) -> Iterator[str]:
    """Yield a description of each returned text that does not have its value in `EXPECTED_TEXTS`.

    Args:
        texts: Returned texts by function; None for a null pointer.
    """
    for name, text in texts.items():
        expected = EXPECTED_TEXTS[name]
        if text is None or not (text + b".").startswith(
            expected + b"."
        ):  # "2.0.1" is a version 2.0
            found = (
                "a null pointer"
                if text is None
                else f'"{escape_unprintable(text.decode("utf-8", "replace"), 40)}"'
            )
            yield f'{name} returns {found}, expected "{expected.decode()}"'


def _is_library_found(name: str, library: SharedLibrary, archive: Archive, member: str) -> bool:
    """Return whether the loader will probably find a needed library.

    In the FMU, in a search path or in the loader's cache.
    """
    if f"{member.rpartition('/')[0]}/{name}" in archive.members and any(
        "ORIGIN" in folder for folder in library.search_folders
    ):
        return True
    folders = [folder for folder in library.search_folders if folder.startswith("/")]
    folders += [folder for folder in os.environ.get("LD_LIBRARY_PATH", "").split(":") if folder]
    if any((Path(folder) / name).is_file() for folder in folders):
        return True
    try:
        return name.encode() + b"\0" in Path("/etc/ld.so.cache").read_bytes()
    except OSError:  # a system without such a cache
        return True
