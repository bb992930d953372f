"""What this machine is called in FMUs, and what a library for it looks like."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass

_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
_ARCHITECTURES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64", "i686": "x86", "i386": "x86"}


@dataclass(frozen=True, slots=True)
class FmuPlatform:
    """A platform: `tuple_name` is its folder in FMI 3.0 ("x86_64-linux"), `name` the one in FMI 2.0 ("linux64")."""

    system: str
    architecture: str
    suffix: str

    @property
    def fmi2_platform(self) -> str:
        system = "win" if self.system == "windows" else self.system
        return f"{system}{32 if self.architecture == 'x86' else 64}"

    @property
    def platform_tuple(self) -> str:
        return f"{self.architecture}-{self.system}"

    def binary_folder(self, major: int) -> str:
        return self.fmi2_platform if major == 2 else self.platform_tuple


def current_platform() -> FmuPlatform:
    """The machine that this program runs on."""
    system, suffix = _SYSTEMS.get(sys.platform, (sys.platform, ".so"))
    machine = platform.machine().lower()
    architecture = _ARCHITECTURES.get(machine, machine)
    if architecture == "x86_64" and sys.maxsize <= 2**32:
        architecture = "x86"
    return FmuPlatform(system, architecture, suffix)
