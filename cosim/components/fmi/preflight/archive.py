"""Archive of an FMU.

All headers are checked before any data are read, and the read data are bounded.
"""

import os
import stat
import unicodedata
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import BufferedReader
from itertools import islice
from pathlib import Path

from ....core.errors import InputError, nearest_file
from . import zip_format
from .findings import FatalFindingError, Finding
from .zip_format import ZipEntry

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


def file_type_name(mode: int) -> str:
    """Return words for the file type in a Unix file mode, for a message "NAME is ..."."""
    letter = stat.filemode(mode)[0]
    return _FILE_TYPE_NAMES.get(letter, f'of file type "{letter}"')


def _check_name(entry: ZipEntry) -> Iterator[Finding]:
    name = entry.decoded_name
    if entry.flags & zip_format.UTF8 and entry.raw_name.encode() != entry.name:
        yield Finding("archive.name", "its name is marked as UTF-8 but is not UTF-8", name)
    if not name.isprintable():
        yield Finding(
            "archive.name",
            "its name contains control characters or other non-printable characters",
            name,
        )
    if "\\" in entry.raw_name:
        yield Finding(
            "archive.name-form", 'its name contains a backslash, which is read as "/"', name
        )
    if entry.raw_name.startswith("./"):
        yield Finding("archive.name-form", 'its name begins with "./", which is ignored', name)
    if ":" in name:
        yield Finding("archive.name", "its name contains a colon, expected a relative path", name)
    if name.count("/") > _MAX_DEPTH:
        yield Finding(
            "archive.name",
            f"is nested {name.count('/')} folders deep, expected at most {_MAX_DEPTH}",
            name,
        )
        return
    parts = name.removesuffix("/").split("/")
    if name != "./" and not {"", ".", ".."}.isdisjoint(parts):
        yield Finding(
            "archive.name",
            'its name contains an empty, "." or ".." part, expected a relative path',
            name,
        )
    if len(entry.name) > _MAX_PATH_LENGTH or any(
        len(os.fsencode(part)) > _MAX_NAME_LENGTH for part in parts
    ):
        yield Finding(
            "archive.name",
            f"its name is longer than {_MAX_NAME_LENGTH} bytes (a path: {_MAX_PATH_LENGTH})",
            name,
        )


def _check_kind(entry: ZipEntry) -> Iterator[Finding]:
    """Check file type, encryption and compression method of a member."""
    name, is_folder = entry.decoded_name, entry.decoded_name.endswith("/")
    # some tools give folders the mode of a file, so only the name decides which members become
    # folders
    if stat.S_IFMT(entry.mode) not in (0, stat.S_IFREG, stat.S_IFDIR if is_folder else 0):
        if stat.S_ISDIR(entry.mode):
            yield Finding(
                "archive.kind", 'has the mode of a folder, expected a name that ends with "/"', name
            )
        else:
            yield Finding(
                "archive.kind",
                f"is {file_type_name(entry.mode)}, expected a regular file or a folder",
                name,
            )
    if is_folder and entry.size:
        yield Finding("archive.kind", f"is a folder with {entry.size} bytes of data", name)
    if entry.flags & zip_format.ENCRYPTED:
        yield Finding("archive.encryption", "is encrypted", name)
    if entry.method not in (STORED, DEFLATED):
        yield Finding(
            "archive.compression",
            f"is compressed by method {entry.method}, expected 0 (stored) or 8 (deflated)",
            name,
        )


def check_collisions(members: Sequence[tuple[str, object]]) -> Iterator[Finding]:
    """Check for members that cannot exist beside each other on some file system.

    They are the same file there, or one is inside another one that is a file.

    Args:
        members: Names, each with CRC and size of the content; a member that is repeated without a
            change is a warning.
    """
    first_names: dict[str, str] = {}
    contents: dict[str, object] = {}
    for name, content in members:
        folded = _fold_case(name)
        if folded in first_names:
            first = first_names[folded]
            rule = (
                "archive.repeated"
                if first == name and content == contents[name]
                else "archive.collision"
            )
            yield Finding(
                rule,
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
            yield Finding("archive.collision", f'is inside "{parent}", which is a file', name)


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


#: largest size of the data descriptor behind a member's data (APPNOTE 4.3.9, bytes)
_MAX_DATA_DESCRIPTOR_SIZE = 24
_CHUNK_SIZE = 1 << 16
#: largest total extracted size (bytes)
MAX_EXPANDED_SIZE = 1 << 30
#: largest ratio of extracted to compressed size, for members larger than `RATIO_THRESHOLD` (bytes)
MAX_RATIO, RATIO_THRESHOLD = 200, 1 << 24


class Archive:
    """Archive of an FMU, usable while its file is open.

    Nothing may be read or extracted if `findings` contains an error.

    Attributes:
        members: Members by name.
        findings: Findings about the headers.
    """

    def __init__(self, file: BufferedReader):
        """Read and check the headers.

        Args:
            file: The archive.

        Raises:
            FatalFindingError: The file is not an archive.
        """
        self._file = file
        self._entries, self._directory_offset = zip_format.read_central_directory(file)
        self.members = {entry.decoded_name: entry for entry in self._entries}
        self._data_offsets: dict[int, int] = {}
        self.findings: Sequence[Finding] = list(self._check_entries())

    def _check_entries(self) -> Iterator[Finding]:
        for entry in self._entries:
            yield from _check_name(entry)
            yield from _check_kind(entry)
            yield from self._check_size(entry)
        yield from check_collisions(
            [(entry.decoded_name, (entry.crc, entry.size)) for entry in self._entries]
        )
        total = sum(entry.size for entry in self._entries)
        if total > MAX_EXPANDED_SIZE:
            yield Finding(
                "archive.size", f"expands to {total} bytes, expected at most {MAX_EXPANDED_SIZE}"
            )
        yield from self._check_offsets()

    def _check_size(self, entry: ZipEntry) -> Iterator[Finding]:
        if entry.method == STORED and entry.size != entry.compressed_size:
            text = f"is stored in {entry.compressed_size} bytes but has a size of {entry.size}"
            yield Finding("archive.size", text, entry.decoded_name)
        elif entry.size > max(RATIO_THRESHOLD, MAX_RATIO * entry.compressed_size):
            text = (
                f"{entry.compressed_size} bytes expand to {entry.size}, expected at most "
                f"{MAX_RATIO} times as many"
            )
            yield Finding("archive.size", text, entry.decoded_name)

    def _check_offsets(self) -> Iterator[Finding]:
        """Check that members follow one another without overlaps and gaps.

        They reach from the start of the file to the central directory.
        """
        # Members that share bytes make small archives expand without limit, and bytes that belong
        # to no member can hide one that other programs read.
        end = 0
        for entry in sorted(self._entries, key=lambda entry: entry.offset):
            try:
                begin = self._data_offsets[id(entry)] = zip_format.find_data_offset(
                    self._file, entry, self._directory_offset
                )
            except FatalFindingError as error:
                yield error.finding
                continue
            data_end = begin + entry.compressed_size
            if entry.offset < end or data_end > self._directory_offset:
                yield Finding(
                    "archive.overlap",
                    f"shares its bytes {entry.offset} to {data_end} with another member",
                    entry.decoded_name,
                )
            elif entry.offset - end > _MAX_DATA_DESCRIPTOR_SIZE:
                yield Finding(
                    "archive.gap",
                    f"{entry.offset - end} bytes before it belong to no member",
                    entry.decoded_name,
                )
            end = max(end, data_end)
        if self._directory_offset - end > _MAX_DATA_DESCRIPTOR_SIZE:
            yield Finding(
                "archive.gap",
                f"{self._directory_offset - end} bytes before the central directory belong to no "
                "member",
            )

    def read(self, name: str) -> bytes:
        """Return the content of a member.

        Raises:
            FatalFindingError: The data are damaged.
        """
        return b"".join(self._read_chunks(self.members[name]))

    def verify(self) -> Iterator[Finding]:
        """Decompress all members, and yield a finding for each with damaged data."""
        for entry in self._entries:
            try:
                for _ in self._read_chunks(entry):
                    pass
            except FatalFindingError as error:
                yield error.finding

    def extract(self, folder: Path, is_used: Callable[[str], bool]) -> None:
        """Write members below a folder, as regular files and folders.

        Args:
            folder: Folder that receives the files.
            is_used: Returns whether the member with this name is written.

        Raises:
            FatalFindingError: The data of a member are damaged.
        """
        made = {""}
        for entry in filter(lambda entry: is_used(entry.decoded_name), self.members.values()):
            parent, _, name = entry.decoded_name.rpartition("/")
            if parent not in made:
                (folder / parent).mkdir(parents=True, exist_ok=True)
                made.add(parent)
            if name:
                with (folder / entry.decoded_name).open("xb") as file:
                    file.writelines(self._read_chunks(entry))

    def _read_chunks(self, entry: ZipEntry) -> Iterator[bytes]:
        """Yield the content in chunks, never more than the size in the central directory."""
        crc, size = 0, 0
        for chunk in (
            self._read_stored(entry) if entry.method == STORED else self._read_deflated(entry)
        ):
            crc, size = zlib.crc32(chunk, crc), size + len(chunk)
            if size > entry.size:
                break
            yield chunk
        if size != entry.size:
            found = "more" if size > entry.size else size
            raise FatalFindingError(
                "archive.data", f"found {found} bytes, expected {entry.size}", entry.decoded_name
            )
        if crc != entry.crc:
            raise FatalFindingError(
                "archive.data", f"found CRC {crc:08x}, expected {entry.crc:08x}", entry.decoded_name
            )

    def _read_stored(self, entry: ZipEntry) -> Iterator[bytes]:
        self._file.seek(self._data_offsets[id(entry)])
        remaining = entry.compressed_size
        while remaining > 0 and (chunk := self._file.read(min(remaining, _CHUNK_SIZE))):
            remaining -= len(chunk)
            yield chunk

    def _read_deflated(self, entry: ZipEntry) -> Iterator[bytes]:
        decompressor = zlib.decompressobj(-zlib.MAX_WBITS)
        try:
            for chunk in self._read_stored(entry):
                yield decompressor.decompress(chunk, _CHUNK_SIZE)
                while decompressor.unconsumed_tail:
                    yield decompressor.decompress(decompressor.unconsumed_tail, _CHUNK_SIZE)
            yield decompressor.flush()
        except zlib.error as error:
            raise FatalFindingError(
                "archive.data", f"the compressed data are damaged: {error}", entry.decoded_name
            ) from None
        if not decompressor.eof or decompressor.unused_data:
            raise FatalFindingError(
                "archive.data", "the compressed data end too early or too late", entry.decoded_name
            )


@contextmanager
def open_regular_file(path: Path) -> Iterator[BufferedReader]:
    """Open a regular file for reading, without blocking on a pipe or device.

    Raises:
        InputError: The file does not exist, is not a regular file or cannot be opened.
    """
    try:
        descriptor = os.open(
            path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        )
    except (FileNotFoundError, ValueError):
        raise InputError(f'FMU "{path}" does not exist{nearest_file(path)}') from None
    except OSError as error:
        raise InputError(f'FMU "{path}" cannot be opened: {error.strerror}') from None
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        raise InputError(f'FMU "{path}" is {file_type_name(mode)}, expected a regular file')
    with os.fdopen(descriptor, "rb") as file:
        yield file
