"""Strict reader of ZIP structures.

One central directory at the end of the file, and consistent headers.

Python's zipfile is lenient by design. It accepts overlapping members, trailing data and
contradictory headers, so that two programs can see different contents in the same file. Format:
PKWARE APPNOTE 6.3.10, sections 4.3 and 4.5.
"""

import os
import struct
from io import BufferedReader
from typing import NamedTuple

from ....core.text import count_noun
from .findings import FatalFindingError

#: formats of the end of central directory record and of the headers, without unused fields
_EOCD = struct.Struct("<4x4H2LH")
_CENTRAL_HEADER, _LOCAL_HEADER = struct.Struct("<8x2H4x3L3H4x2L"), struct.Struct("<6x2H4x3L2H")
_EOCD_SIGNATURE, _CENTRAL_SIGNATURE, _LOCAL_SIGNATURE = b"PK\x05\x06", b"PK\x01\x02", b"PK\x03\x04"
_MAX_COMMENT_SIZE = 0xFFFF
#: largest accepted number of files and folders in the archive
MAX_MEMBERS = 10_000
#: largest accepted mean size of a central directory header (bytes)
_MAX_HEADER_SIZE = 4096
#: value of a 32-bit field whose real value is in the ZIP64 extra field
_ZIP64_MARKER = 0xFFFFFFFF
_ZIP64_HEADER_ID = 1
#: bits of the general purpose bit flag (ENCRYPTED: all bits of the encryption methods)
ENCRYPTED, HAS_DATA_DESCRIPTOR, UTF8 = 0x2041, 0x8, 0x800


class ZipEntry(NamedTuple):
    """Central directory header of one member.

    Attributes:
        name: File name as in the archive.
        flags: General purpose bit flag.
        method: Compression method.
        crc: CRC-32 of the content.
        compressed_size: Size of the compressed data (bytes).
        size: Size of the content (bytes).
        mode: Unix file mode from the external attributes, 0 if unknown.
        offset: Offset of the local file header in the archive (bytes).
    """

    name: bytes
    flags: int
    method: int
    crc: int
    compressed_size: int
    size: int
    mode: int
    offset: int

    @property
    def raw_name(self) -> str:
        """Name as text: UTF-8 if it is valid UTF-8, else code page 437."""
        try:
            return self.name.decode()
        except UnicodeDecodeError:
            return self.name.decode("cp437")

    @property
    def decoded_name(self) -> str:
        """Name as path with "/" between its parts and without "./" at its beginning.

        The folder "./" keeps its name.
        """
        name = self.raw_name.replace("\\", "/")
        return name.removeprefix("./") or name


def read_central_directory(file: BufferedReader) -> tuple[list[ZipEntry], int]:
    """Read the central directory.

    Args:
        file: The archive.

    Returns:
        The headers of the members, and the offset of the central directory in the file (bytes).

    Raises:
        FatalFindingError: The file is not an archive, the central directory is damaged or has too
            many members.
    """
    count, size, offset = _read_eocd(file)
    if count > MAX_MEMBERS:
        raise FatalFindingError(
            "archive.contents", f"found {count} members, expected at most {MAX_MEMBERS}"
        )
    if size > MAX_MEMBERS * _MAX_HEADER_SIZE:
        raise FatalFindingError(
            "archive.contents",
            f"found a central directory of {size} bytes, expected at most "
            f"{MAX_MEMBERS * _MAX_HEADER_SIZE}",
        )
    file.seek(offset)
    directory = file.read(size)
    entries, position = [], 0
    for _ in range(count):
        entry, position = _read_entry(directory, position)
        entries.append(entry)
    if position != size:
        text = (
            f"the central directory is {count_noun(size - position, 'byte')} longer than its "
            f"{count_noun(count, 'header')}"
        )
        raise FatalFindingError("archive.contents", text)
    return entries, offset


def _read_eocd(file: BufferedReader) -> tuple[int, int, int]:
    """Read the end of central directory record.

    Return (members, size, offset) of the central directory.
    """
    length = file.seek(0, os.SEEK_END)
    file.seek(max(0, length - _EOCD.size - _MAX_COMMENT_SIZE))
    tail = file.read()
    position = tail.rfind(_EOCD_SIGNATURE)
    if position < 0 or len(tail) - position < _EOCD.size:
        raise FatalFindingError(
            "archive.zip", "is not an FMU: it is not a ZIP file, or its end is missing"
        )
    disk, directory_disk, disk_count, count, size, offset, comment_size = _EOCD.unpack_from(
        tail, position
    )
    surplus = len(tail) - position - _EOCD.size - comment_size
    if surplus or _is_in_comment(tail, position):
        raise FatalFindingError(
            "archive.trailing-data",
            f"found {count_noun(abs(surplus), 'byte')} behind the end of the archive or a "
            "second end, expected neither",
        )
    if (disk, directory_disk) != (0, 0) or disk_count != count:
        raise FatalFindingError("archive.contents", "is one part of an archive in several parts")
    end = length - _EOCD.size - comment_size
    if offset + size != end:
        text = (
            f"the central directory should end at byte {end}, found {offset + size} (truncated, or "
            "data in front?)"
        )
        raise FatalFindingError("archive.contents", text)
    return count, size, offset


def _is_in_comment(tail: bytes, position: int) -> bool:
    """Return whether the record at a position is part of the comment of an earlier record."""
    earlier = tail.find(_EOCD_SIGNATURE)
    while earlier != position:
        if len(tail) - earlier >= _EOCD.size:
            comment_size = _EOCD.unpack_from(tail, earlier)[-1]
            if earlier + _EOCD.size + comment_size == len(tail):
                return True
        earlier = tail.find(_EOCD_SIGNATURE, earlier + 1)
    return False


def _read_entry(directory: bytes, position: int) -> tuple[ZipEntry, int]:
    """Read the central directory header at a position; return it and the position after it."""
    if len(directory) - position < _CENTRAL_HEADER.size or not directory.startswith(
        _CENTRAL_SIGNATURE, position
    ):
        raise _damaged_directory_error(position)
    flags, method, crc, compressed, size, *sizes, attributes, offset = _CENTRAL_HEADER.unpack_from(
        directory, position
    )
    name_size, extra_size, comment_size = sizes
    name_begin = position + _CENTRAL_HEADER.size
    extra_begin = name_begin + name_size
    end = extra_begin + extra_size + comment_size
    if end > len(directory):
        raise _damaged_directory_error(position)
    name = directory[name_begin:extra_begin]
    extra = directory[extra_begin : extra_begin + extra_size]
    size, compressed, offset = _apply_zip64(extra, size, compressed, offset)
    return ZipEntry(name, flags, method, crc, compressed, size, attributes >> 16, offset), end


def _damaged_directory_error(position: int) -> FatalFindingError:
    return FatalFindingError(
        "archive.contents", f"the central directory is damaged at its byte {position}"
    )


def _apply_zip64(extra: bytes, *values: int) -> tuple[int, ...]:
    """Replace values above 32 bits by those of the ZIP64 extra field (APPNOTE 4.5.3)."""
    position = 0
    while _ZIP64_MARKER in values and position + 4 <= len(extra):
        header_id, length = struct.unpack_from("<2H", extra, position)
        if header_id == _ZIP64_HEADER_ID:
            count = (len(extra[position + 4 : position + 4 + length])) // 8
            wide_values = iter(struct.unpack_from(f"<{count}Q", extra, position + 4))
            return tuple(
                next(wide_values, value) if value == _ZIP64_MARKER else value for value in values
            )
        position += 4 + length
    return values


def find_data_offset(file: BufferedReader, entry: ZipEntry, end: int) -> int:
    """Compare the local file header of a member with its central directory header.

    Args:
        file: The archive.
        entry: Central directory header of the member.
        end: Offset of the central directory, at which all members end (bytes).

    Returns:
        Offset of the member's data in the archive (bytes).

    Raises:
        FatalFindingError: The local file header is missing or contradicts the central directory.
    """
    file.seek(min(entry.offset, end))
    header = file.read(_LOCAL_HEADER.size)
    if len(header) < _LOCAL_HEADER.size or not header.startswith(_LOCAL_SIGNATURE):
        raise FatalFindingError(
            "archive.header", f"found no member at byte {entry.offset}", entry.decoded_name
        )
    flags, method, crc, compressed, size, name_size, extra_size = _LOCAL_HEADER.unpack(header)
    name, extra = file.read(name_size), file.read(extra_size)
    size, compressed = _apply_zip64(extra, size, compressed)
    pairs = {
        "name": (name, entry.name),
        "encryption": (flags & ENCRYPTED, entry.flags & ENCRYPTED),
        "method": (method, entry.method),
        "CRC": (crc, entry.crc),
        "compressed size": (compressed, entry.compressed_size),
        "size": (size, entry.size),
    }
    for label, (local, central) in pairs.items():
        is_in_data_descriptor = (
            local == 0
            and flags & HAS_DATA_DESCRIPTOR
            and label in ("CRC", "compressed size", "size")
        )
        if local != central and not is_in_data_descriptor:
            text = (
                f"its local file header has {label} {local!r}, the central directory has "
                f"{central!r}"
            )
            raise FatalFindingError("archive.header", text, entry.decoded_name)
    data_offset: int = entry.offset + _LOCAL_HEADER.size + name_size + extra_size
    return data_offset
