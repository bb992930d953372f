"""Rules about the members of an archive: names, file types, encryption and compression."""

from __future__ import annotations

import os
import stat
import unicodedata
from collections.abc import Iterator, Sequence
from itertools import islice

from . import zip_format
from .findings import Finding, Rule
from .zip_format import ZipEntry

_ZIP = "FMI 2.0.5 section 2.3, FMI 3.0.2 section 2.5"
NAME = Rule("archive.name", _ZIP)
NAME_FORM = Rule("archive.name-form", _ZIP, "warning")
COLLISION = Rule("archive.collision", _ZIP)
REPEATED = Rule("archive.repeated", _ZIP, "warning")
KIND = Rule("archive.kind", _ZIP)
ENCRYPTION = Rule("archive.encryption", _ZIP)
COMPRESSION = Rule("archive.compression", _ZIP)

#: compression methods
STORED, DEFLATED = 0, 8
#: largest size of a file name and of a path (bytes), and largest number of nested folders
_MAX_NAME_LENGTH, _MAX_PATH_LENGTH, _MAX_DEPTH = 255, 1024, 64
#: file types as in the first letter of `stat.filemode`
_FILE_TYPE_NAMES = {
    "d": "a folder",
    "p": "a named pipe",
    "s": "a socket",
    "c": "a device",
    "b": "a device",
    "l": "a symbolic link",
}


def check_member(entry: ZipEntry) -> Iterator[Finding]:
    """Check name, file type, encryption and compression method of a member."""
    yield from _check_name(entry)
    yield from _check_kind(entry)


def file_type_name(mode: int) -> str:
    """Return words for the file type in a Unix file mode, for a message of the form "NAME is ..."."""
    letter = stat.filemode(mode)[0]
    return _FILE_TYPE_NAMES.get(letter, f'of file type "{letter}"')


def _check_name(entry: ZipEntry) -> Iterator[Finding]:
    name = entry.decoded_name
    if entry.flags & zip_format.UTF8 and not _is_utf8(entry.name):
        yield NAME("its name is marked as UTF-8 but is not UTF-8", name)
    if not name.isprintable():
        yield NAME("its name contains control characters or other non-printable characters", name)
    if "\\" in entry.raw_name:
        yield NAME_FORM('its name contains a backslash, which is read as "/"', name)
    if entry.raw_name.startswith("./"):
        yield NAME_FORM('its name begins with "./", which is ignored', name)
    if ":" in name:
        yield NAME("its name contains a colon, expected a relative path", name)
    if name.count("/") > _MAX_DEPTH:
        yield NAME(f"is nested {name.count('/')} folders deep, expected at most {_MAX_DEPTH}", name)
        return
    parts = name.removesuffix("/").split("/")
    if name != "./" and not {"", ".", ".."}.isdisjoint(parts):
        yield NAME('its name contains an empty, "." or ".." part, expected a relative path', name)
    if len(entry.name) > _MAX_PATH_LENGTH or any(
        len(os.fsencode(part)) > _MAX_NAME_LENGTH for part in parts
    ):
        yield NAME(
            f"its name is longer than {_MAX_NAME_LENGTH} bytes (a path: {_MAX_PATH_LENGTH})", name
        )


def _is_utf8(name: bytes) -> bool:
    try:
        name.decode()
    except UnicodeDecodeError:
        return False
    return True


def _check_kind(entry: ZipEntry) -> Iterator[Finding]:
    name, is_folder = entry.decoded_name, entry.decoded_name.endswith("/")
    # some tools give folders the mode of a file, so only the name decides which members become
    # folders
    if stat.S_IFMT(entry.mode) not in (0, stat.S_IFREG, stat.S_IFDIR if is_folder else 0):
        if stat.S_ISDIR(entry.mode):
            yield KIND('has the mode of a folder, expected a name that ends with "/"', name)
        else:
            yield KIND(
                f"is {file_type_name(entry.mode)}, expected a regular file or a folder", name
            )
    if is_folder and entry.size:
        yield KIND(f"is a folder with {entry.size} bytes of data", name)
    if entry.flags & zip_format.ENCRYPTED:
        yield ENCRYPTION("is encrypted", name)
    if entry.method not in (STORED, DEFLATED):
        yield COMPRESSION(
            f"is compressed by method {entry.method}, expected 0 (stored) or 8 (deflated)", name
        )


def check_collisions(members: Sequence[tuple[str, object]]) -> Iterator[Finding]:
    """Check for members that are the same file on some file system, or that are inside another member that is a file.

    Args:
        members: Names, each with CRC and size of the content; a member that is repeated without a change is a warning.
    """
    first_names: dict[str, str] = {}
    contents: dict[str, object] = {}
    for name, content in members:
        folded = _fold_case(name)
        if folded in first_names:
            first = first_names[folded]
            rule = REPEATED if first == name and content == contents[name] else COLLISION
            yield rule(
                "occurs twice"
                if first == name
                else f'differs only in case or Unicode form from "{first}"',
                name,
            )
        first_names.setdefault(folded, name)
        contents.setdefault(name, content)
    files = {folded for folded, name in first_names.items() if not name.endswith("/")}
    for folded, name in first_names.items():
        if parent := next((folder for folder in _parent_folders(folded) if folder in files), None):
            yield COLLISION(f'is inside "{parent}", which is a file', name)


def _parent_folders(name: str) -> Iterator[str]:
    """Yield the folders of a path from the outermost, up to the depth limit.

    "a" and "a/b" for "a/b/c".
    """
    return islice((name[:i] for i, c in enumerate(name) if c == "/"), _MAX_DEPTH)


def _fold_case(name: str) -> str:
    """Return a name as case-insensitive and normalizing file systems compare it."""
    return unicodedata.normalize(
        "NFC", unicodedata.normalize("NFC", name.removesuffix("/")).casefold()
    )
