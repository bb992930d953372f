"""An FMU's archive: examined as a whole before anything is taken from it, and then taken with bounds."""

from __future__ import annotations

import os
import stat
import unicodedata
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BufferedReader
from itertools import islice
from pathlib import Path

from ....core.errors import InputError
from . import zip_format
from .findings import FatalFinding, Finding, Rule
from .limits import PreflightLimits
from .zip_format import ZipEntry

_ZIP = "FMI 2.0.5 section 2.3, FMI 3.0.2 section 2.5"
FILE = Rule("archive.file", _ZIP)
NAME = Rule("archive.name", _ZIP)
COLLISION = Rule("archive.collision", _ZIP)
KIND = Rule("archive.kind", _ZIP)
ENCRYPTION = Rule("archive.encryption", _ZIP)
COMPRESSION = Rule("archive.compression", _ZIP)
SIZE = Rule("archive.size", "limits")
OVERLAP = Rule("archive.overlap", "CVE-2024-0450")
GAP = Rule("archive.gap", _ZIP, "warning")
DATA = Rule("archive.data", "APPNOTE 4.3.8")

STORED, DEFLATED = 0, 8
#: bytes of a name and of a path, folders in each other
_MAX_NAME_LENGTH, _MAX_PATH_LENGTH, _MAX_DEPTH = 255, 1024, 64
#: the sizes that may stand behind a member's data (APPNOTE 4.3.9)
_MAX_DATA_DESCRIPTOR_SIZE = 24
_CHUNK_SIZE = 1 << 16
_FILE_TYPE_NAMES = {
    "d": "a folder",
    "p": "a named pipe",
    "s": "a socket",
    "c": "a device",
    "b": "a device",
    "l": "a symbolic link",
}


class Archive:
    """The members of an FMU by name, usable while the file is open; `findings` holds all that is wrong with their headers.

    Raises Flaw when the file is no archive at all. Nothing may be read or extracted when one of the findings is an error.
    """

    def __init__(self, file: BufferedReader, limits: PreflightLimits):
        entries, self._directory_offset = zip_format.read_central_directory(file, limits.max_members)
        self._file, self._limits, self._entries = file, limits, entries
        self.members = {entry.decoded_name: entry for entry in entries}
        self._data_offsets: dict[int, int] = {}
        self.findings: Sequence[Finding] = list(self._check_entries())

    def _check_entries(self) -> Iterator[Finding]:
        for entry in self._entries:
            yield from _check_name(entry)
            yield from _check_kind(entry)
            yield from self._check_size(entry)
        yield from _check_collisions([entry.decoded_name for entry in self._entries])
        total = sum(entry.size for entry in self._entries)
        if total > self._limits.max_expanded_size:
            yield SIZE(f"expands to {total} bytes, expected at most {self._limits.max_expanded_size}")
        yield from self._check_offsets()

    def _check_size(self, entry: ZipEntry) -> Iterator[Finding]:
        if entry.method == STORED and entry.size != entry.compressed_size:
            yield SIZE(f"is stored in {entry.compressed_size} bytes but has {entry.size}", entry.decoded_name)
        elif entry.size > max(self._limits.ratio_threshold, self._limits.max_ratio * entry.compressed_size):
            text = (
                f"{entry.compressed_size} bytes expand to {entry.size}, expected at most {self._limits.max_ratio} times as many"
            )
            yield SIZE(text, entry.decoded_name)

    def _check_offsets(self) -> Iterator[Finding]:
        """Each member's data follow its own header, one member after the other, up to the table of contents."""
        end = 0
        for entry in sorted(self._entries, key=lambda entry: entry.offset):
            try:
                begin = self._data_offsets[id(entry)] = zip_format.find_data_offset(self._file, entry, self._directory_offset)
            except FatalFinding as flaw:
                yield flaw.finding
                continue
            if entry.offset < end or begin + entry.compressed_size > self._directory_offset:
                yield OVERLAP(
                    f"shares its bytes {entry.offset} to {begin + entry.compressed_size} with another member", entry.decoded_name
                )
            elif entry.offset - end > _MAX_DATA_DESCRIPTOR_SIZE:
                yield GAP(f"{entry.offset - end} bytes before it belong to no member", entry.decoded_name)
            end = max(end, begin + entry.compressed_size)
        if self._directory_offset - end > _MAX_DATA_DESCRIPTOR_SIZE:
            yield GAP(f"{self._directory_offset - end} bytes before the table of contents belong to no member")

    def read(self, name: str) -> bytes:
        """A member's content. Raises Flaw when the data are damaged."""
        return b"".join(self._read_chunks(self.members[name]))

    def verify(self) -> Iterator[Finding]:
        """Members whose data are damaged; decompresses all of them."""
        for entry in self._entries:
            try:
                for _ in self._read_chunks(entry):
                    pass
            except FatalFinding as flaw:
                yield flaw.finding

    def extract(self, folder: Path) -> None:
        """Write all members below `folder`, as plain files and folders. Raises Flaw when the data are damaged."""
        for entry in self._entries:
            target = folder / entry.decoded_name
            if entry.decoded_name.endswith("/"):
                target.mkdir(parents=True, exist_ok=True)
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            with target.open("xb") as file:
                file.writelines(self._read_chunks(entry))

    def _read_chunks(self, entry: ZipEntry) -> Iterator[bytes]:
        """The content in pieces, never more than the table of contents says."""
        crc, size = 0, 0
        for chunk in self._read_stored(entry) if entry.method == STORED else self._read_deflated(entry):
            crc, size = zlib.crc32(chunk, crc), size + len(chunk)
            if size > entry.size:
                break
            yield chunk
        if size != entry.size:
            raise FatalFinding(
                DATA(f"found {'more' if size > entry.size else size} bytes, expected {entry.size}", entry.decoded_name)
            )
        if crc != entry.crc:
            raise FatalFinding(DATA(f"found CRC {crc:08x}, expected {entry.crc:08x}", entry.decoded_name))

    def _read_stored(self, entry: ZipEntry) -> Iterator[bytes]:
        self._file.seek(self._data_offsets[id(entry)])
        left = entry.compressed_size
        while left > 0 and (chunk := self._file.read(min(left, _CHUNK_SIZE))):
            left -= len(chunk)
            yield chunk

    def _read_deflated(self, entry: ZipEntry) -> Iterator[bytes]:
        engine = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            for chunk in self._read_stored(entry):
                yield engine.decompress(chunk, _CHUNK_SIZE)
                while engine.unconsumed_tail:
                    yield engine.decompress(engine.unconsumed_tail, _CHUNK_SIZE)
            yield engine.flush()
        except zlib.error as error:
            raise FatalFinding(DATA(f"the compressed data are damaged: {error}", entry.decoded_name)) from None
        if not engine.eof or engine.unused_data:
            raise FatalFinding(DATA("the compressed data end too early or too late", entry.decoded_name))


@contextmanager
def open_regular_file(path: Path) -> Iterator[BufferedReader]:
    """A regular file, opened without ever waiting for it. Raises InputError for pipes, devices, folders and missing files."""
    try:
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except (FileNotFoundError, ValueError):
        raise InputError(f'FMU "{path}" does not exist') from None
    except OSError as error:
        raise InputError(f'FMU "{path}" cannot be opened: {error.strerror}') from None
    kind = stat.filemode(os.fstat(number).st_mode)[0]
    if kind != "-":
        os.close(number)
        raise InputError(f'FMU "{path}" is {_FILE_TYPE_NAMES.get(kind, "something else")}, expected a regular file')
    with os.fdopen(number, "rb") as file:
        yield file


# -- names and kinds -------------------------------------------------------------------------------------------------------


def _check_name(entry: ZipEntry) -> Iterator[Finding]:
    name = entry.decoded_name
    if entry.flags & zip_format.UTF8 and not _is_utf8(entry.name):
        yield NAME("its name is not UTF-8, though it is marked so", name)
    if not name.isprintable():
        yield NAME("its name holds control characters or other invisible ones", name)
    if "\\" in name or ":" in name:
        yield NAME('its name holds a backslash or a colon, expected a relative path with "/"', name)
    if name.count("/") > _MAX_DEPTH:
        yield NAME(f"it lies {name.count('/')} folders deep, expected at most {_MAX_DEPTH}", name)
        return
    parts = name.removesuffix("/").split("/")
    if not {"", ".", ".."}.isdisjoint(parts):
        yield NAME("its name leaves its folder or holds empty parts, expected a relative path", name)
    if len(entry.name) > _MAX_PATH_LENGTH or any(len(os.fsencode(part)) > _MAX_NAME_LENGTH for part in parts):
        yield NAME(f"its name is longer than {_MAX_NAME_LENGTH} bytes (a path: {_MAX_PATH_LENGTH})", name)


def _is_utf8(name: bytes) -> bool:
    try:
        name.decode()
    except UnicodeDecodeError:
        return False
    return True


def _check_kind(entry: ZipEntry) -> Iterator[Finding]:
    name, folder = entry.decoded_name, entry.decoded_name.endswith("/")
    # some tools give folders the mode of a file; what becomes a folder is decided by the name alone
    if stat.S_IFMT(entry.mode) not in (0, stat.S_IFREG, stat.S_IFDIR if folder else 0):
        kind = "a symbolic link" if stat.S_ISLNK(entry.mode) else f"of kind {stat.filemode(entry.mode)[0]}"
        yield KIND(f"is {kind}, expected a regular file or a folder", name)
    if folder and entry.size:
        yield KIND(f"is a folder with {entry.size} bytes", name)
    if entry.flags & zip_format.ENCRYPTED:
        yield ENCRYPTION("is encrypted", name)
    if entry.method not in (STORED, DEFLATED):
        yield COMPRESSION(f"is compressed by method {entry.method}, expected 0 (stored) or 8 (deflated)", name)


def _check_collisions(names: Sequence[str]) -> Iterator[Finding]:
    """Members that are one file on some file system, or need a folder where another member is a file."""
    seen: dict[str, str] = {}
    for name in names:
        folded = _fold_case(name)
        if folded in seen:
            same = seen[folded] == name
            yield COLLISION("stands twice" if same else f'differs only in case or form from "{seen[folded]}"', name)
        seen.setdefault(folded, name)
    files = {folded for folded, name in seen.items() if not name.endswith("/")}
    for folded, name in seen.items():
        if above := next((folder for folder in _parent_folders(folded) if folder in files), None):
            yield COLLISION(f'lies in "{above}", which is a file', name)


def _parent_folders(name: str) -> Iterator[str]:
    """ "a", "a/b" for "a/b/c", not endlessly."""
    return islice((name[:i] for i, c in enumerate(name) if c == "/"), _MAX_DEPTH)


def _fold_case(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name.removesuffix("/")).casefold())


@contextmanager
def open_archive(path: Path, limits: PreflightLimits) -> Iterator[Archive]:
    """The archive of an FMU. Raises InputError when there is no such file, Flaw when it is no archive at all."""
    with open_regular_file(path) as file:
        yield Archive(file, limits)
