"""Platforms of FMUs, and what reading a shared library of any of them yields."""

import platform
import struct
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
_ARCHITECTURES = {
    "x86_64": "x86_64",
    "amd64": "x86_64",
    "aarch64": "aarch64",
    "arm64": "aarch64",
    "i686": "x86",
    "i386": "x86",
}


class FmuPlatform(NamedTuple):
    """Platform of an FMU binary.

    Attributes:
        system: Operating system, such as "linux".
        architecture: Processor architecture, such as "x86_64".
        suffix: File name suffix of shared libraries, such as ".so".
    """

    system: str
    architecture: str
    suffix: str

    @property
    def fmi2_platform(self) -> str:
        """Folder name in FMI 2.0, such as "linux64"."""
        system = "win" if self.system == "windows" else self.system
        return f"{system}{32 if self.architecture == 'x86' else 64}"

    @property
    def platform_tuple(self) -> str:
        """Platform tuple of FMI 3.0, such as "x86_64-linux"."""
        return f"{self.architecture}-{self.system}"

    def binary_folder(self, major: int) -> str:
        """Return the name of the folder below `binaries` for an FMI major version."""
        return self.platform_tuple if major == 3 else self.fmi2_platform


def current_platform() -> FmuPlatform:
    """Return the platform of this process."""
    system, suffix = _SYSTEMS.get(sys.platform, (sys.platform, ".so"))
    machine = platform.machine().lower()
    architecture = _ARCHITECTURES.get(machine, machine)
    if architecture == "x86_64" and sys.maxsize <= 2**32:
        architecture = "x86"
    return FmuPlatform(system, architecture, suffix)


#: text that each function for the version and the platform of FMI must return
EXPECTED_TEXTS = {
    "fmi2GetVersion": b"2.0",
    "fmi2GetTypesPlatform": b"default",
    "fmi3GetVersion": b"3.0",
}


class InvalidLibraryError(Exception):
    """Reason why a file is not a shared library that the loader of a platform accepts."""


def unpack(content: bytes, form: str, offset: int) -> tuple[int, ...]:
    """Unpack numbers at an offset in a library, in the format of `struct`."""
    if offset < 0 or offset + struct.calcsize(form) > len(content):
        raise InvalidLibraryError(
            f"is truncated: it refers to byte {offset}, but has {len(content)}"
        )
    return struct.unpack_from(form, content, offset)


def check_end(content: bytes, end: int, part: str) -> None:
    """Check that a part of a library ends within the file."""
    if end > len(content):
        raise InvalidLibraryError(
            f"is truncated: {part} ends at byte {end}, the file at {len(content)}"
        )


@dataclass(frozen=True, slots=True)
class SharedLibrary:
    """Dynamic linking information of a shared library.

    Attributes:
        exports: Names of the exported functions.
        constant_texts: Texts that exported functions return, for those whose code only returns a
            constant text.
        needed_libraries: Names of the libraries that it depends on.
        search_folders: Folders in which the loader searches for them.
    """

    exports: frozenset[str]
    needed_libraries: Sequence[str] = ()
    search_folders: Sequence[str] = ()
    constant_texts: Mapping[str, bytes] = field(default_factory=dict)
