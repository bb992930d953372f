"""An FMU file: described once, extracted once, however many instances it has."""

from __future__ import annotations

from functools import cached_property
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory

from ..errors import InputError
from .description import Description, read_description


class FmuFile:
    """One FMU on disk. Instances `acquire` the extracted folder and `release` it; the last one removes it."""

    def __init__(self, path: Path):
        self.path = path
        self._folder: TemporaryDirectory[str] | None = None
        self._users = 0

    @cached_property
    def description(self) -> Description:
        return read_description(self.path)

    @cached_property
    def sha256(self) -> str:
        return sha256(self.path.read_bytes()).hexdigest()

    def check_platform(self) -> None:
        """Raises InputError when the FMU has no binary for this machine."""
        from fmpy import platform, platform_tuple

        if platform not in self.description.platforms:
            found = ", ".join(self.description.platforms) or "no binaries"
            raise InputError(f'"{self.path}" has no binary for {platform_tuple} ({platform}); it has: {found}')

    def acquire(self) -> Path:
        """The folder with the extracted FMU, until it is released."""
        from fmpy import extract

        if self._folder is None:
            self._folder = TemporaryDirectory(prefix="cosim-fmu-")
            extract(self.path, self._folder.name)
        self._users += 1
        return Path(self._folder.name)

    def release(self) -> None:
        self._users -= 1
        if self._users == 0 and self._folder is not None:
            self._folder.cleanup()
            self._folder = None
