"""Reproducible FMU archives.

Equal contents give equal bytes, and the instantiation token is a hash of the contents.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from ...results.files import writing_atomically

_DATE = (1980, 1, 1, 0, 0, 0)
_UNIX, _REGULAR_FILE = 3, 0o100644 << 16


def write_archive(files: Mapping[str, bytes], target: Path) -> Path:
    """Write an FMU archive atomically.

    Args:
        files: Name inside the archive -> contents. The members are written in the order of their
            names.
        target: The file to write; its folder is created.

    Returns:
        `target`.

    Raises:
        InputError: The path cannot be written.
        OutputError: The disk is full or defective.
    """
    with writing_atomically(target) as temporary, ZipFile(temporary, "w") as archive:
        for name in sorted(files):
            archive.writestr(_member(name), files[name])
    return target


def _member(name: str) -> ZipInfo:
    member = ZipInfo(name, _DATE)
    member.create_system, member.external_attr, member.compress_type = (
        _UNIX,
        _REGULAR_FILE,
        ZIP_DEFLATED,
    )
    return member


def content_token(parts: Iterable[bytes]) -> str:
    """Return the GUID (FMI 2.0) or instantiation token (FMI 3.0) of an FMU.

    A hash of its contents.
    """
    digest = sha256(b"\0".join(parts)).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"
