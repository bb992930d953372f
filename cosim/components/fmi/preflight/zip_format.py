"""ZIP archives read strictly: one table of contents at the very end, and headers that all say the same.

Python's zipfile is lenient by design: it accepts members that overlap, trailing data and headers that contradict each
other, so that two programs can see two different archives in one file. Format: PKWARE APPNOTE 6.3.10, sections 4.3 and 4.5.
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from io import BufferedReader

from .findings import FatalFinding, Rule

NO_ZIP = Rule("archive.zip", "APPNOTE 4.3")
TRAILING = Rule("archive.trailing-data", "APPNOTE 4.3.16")
CENTRAL_DIRECTORY = Rule("archive.contents", "APPNOTE 4.3.12")
HEADER = Rule("archive.header", "APPNOTE 4.3.7")

_END_RECORD, _DIRECTORY_HEADER, _LOCAL_HEADER = (
    struct.Struct("<4s4H2LH"),
    struct.Struct("<4s6H3L5H2L"),
    struct.Struct("<4s5H3L2H"),
)
_END_MAGIC, _ENTRY_MAGIC, _LOCAL_MAGIC = b"PK\x05\x06", b"PK\x01\x02", b"PK\x03\x04"
_MAX_COMMENT_SIZE = 0xFFFF
#: on average, in the table of contents
_MAX_HEADER_SIZE = 4096
_ZIP64_MARKER = 0xFFFFFFFF
#: bits of the flags
ENCRYPTED, HAS_DATA_DESCRIPTOR, UTF8 = 0x2041, 0x8, 0x800


@dataclass(frozen=True, slots=True)
class ZipEntry:
    """One row of the table of contents; sizes and offset in bytes, `mode` as of Unix (0: unknown)."""

    name: bytes
    flags: int
    method: int
    crc: int
    compressed_size: int
    size: int
    mode: int
    offset: int

    @property
    def decoded_name(self) -> str:
        """The name as text; without the flag for UTF-8 it is UTF-8 if it can be, else code page 437."""
        try:
            return self.name.decode()
        except UnicodeDecodeError:
            return self.name.decode("cp437")


def read_central_directory(file: BufferedReader, max_entries: int) -> tuple[list[ZipEntry], int]:
    """The table of contents, and where it begins. Raises Flaw when it has more than `most` rows or is none."""
    count, size, offset = _read_end(file)
    if count > max_entries:
        raise FatalFinding(CENTRAL_DIRECTORY(f"found {count} members, expected at most {max_entries}"))
    if size > max_entries * _MAX_HEADER_SIZE:
        raise FatalFinding(
            CENTRAL_DIRECTORY(f"found a table of contents of {size} bytes, expected at most {max_entries * _MAX_HEADER_SIZE}")
        )
    file.seek(offset)
    table = file.read(size)
    entries, place = [], 0
    for _ in range(count):
        entry, place = _read_entry(table, place)
        entries.append(entry)
    if place != size:
        raise FatalFinding(
            CENTRAL_DIRECTORY(f"the table of contents has {size - place} bytes more than its {count} members need")
        )
    return entries, offset


def _read_end(file: BufferedReader) -> tuple[int, int, int]:
    """(members, size, offset) of the table of contents, from the record at the very end of the file."""
    length = file.seek(0, os.SEEK_END)
    file.seek(max(0, length - _END_RECORD.size - _MAX_COMMENT_SIZE))
    tail = file.read()
    place = tail.rfind(_END_MAGIC)
    if place < 0 or len(tail) - place < _END_RECORD.size:
        raise FatalFinding(NO_ZIP("is no FMU: File is not a zip file, or its end is missing"))
    _, disk, contents_disk, here, count, size, offset, comment = _END_RECORD.unpack_from(tail, place)
    surplus = len(tail) - place - _END_RECORD.size - comment
    if surplus or _is_in_comment(tail, place):
        raise FatalFinding(
            TRAILING(f"found {abs(surplus)} bytes behind the end of the archive or a second end, expected neither")
        )
    if (disk, contents_disk) != (0, 0) or here != count:
        raise FatalFinding(CENTRAL_DIRECTORY("is one part of an archive in several parts"))
    end = length - _END_RECORD.size - comment
    if offset + size != end:
        raise FatalFinding(
            CENTRAL_DIRECTORY(f"the table of contents should end at byte {end}, found {offset + size} (cut, or data in front?)")
        )
    return count, size, offset


def _is_in_comment(tail: bytes, place: int) -> bool:
    """Whether an earlier end record takes the last one for its comment."""
    earlier = tail.find(_END_MAGIC)
    while earlier != place:
        if len(tail) - earlier >= _END_RECORD.size and earlier + _END_RECORD.size + _END_RECORD.unpack_from(tail, earlier)[
            -1
        ] == len(tail):
            return True
        earlier = tail.find(_END_MAGIC, earlier + 1)
    return False


def _read_entry(table: bytes, place: int) -> tuple[ZipEntry, int]:
    if len(table) - place < _DIRECTORY_HEADER.size or not table.startswith(_ENTRY_MAGIC, place):
        raise FatalFinding(CENTRAL_DIRECTORY(f"the table of contents is damaged at its byte {place}"))
    _, _, _, flags, method, _, _, crc, compressed, size, n, m, k, _, _, attributes, offset = _DIRECTORY_HEADER.unpack_from(
        table, place
    )
    name_at = place + _DIRECTORY_HEADER.size
    end = name_at + n + m + k
    if end > len(table):
        raise FatalFinding(CENTRAL_DIRECTORY(f"the table of contents is damaged at its byte {place}"))
    name = table[name_at : name_at + n]
    size, compressed, offset = _apply_zip64(table[name_at + n : name_at + n + m], size, compressed, offset)
    return ZipEntry(name, flags, method, crc, compressed, size, attributes >> 16, offset), end


def _apply_zip64(extra: bytes, *values: int) -> tuple[int, ...]:
    """The values, with those that did not fit into 32 bits taken from the ZIP64 field (APPNOTE 4.5.3)."""
    place = 0
    while _ZIP64_MARKER in values and place + 4 <= len(extra):
        kind, length = struct.unpack_from("<2H", extra, place)
        if kind == 1:
            count = (len(extra[place + 4 : place + 4 + length])) // 8
            wide = iter(struct.unpack_from(f"<{count}Q", extra, place + 4))
            return tuple(next(wide, value) if value == _ZIP64_MARKER else value for value in values)
        place += 4 + length
    return values


def find_data_offset(file: BufferedReader, entry: ZipEntry, end: int) -> int:
    """Where the data of a member begin, before `end`. Raises Flaw when its own header contradicts the table of contents."""
    file.seek(min(entry.offset, end))
    head = file.read(_LOCAL_HEADER.size)
    if len(head) < _LOCAL_HEADER.size or not head.startswith(_LOCAL_MAGIC):
        raise FatalFinding(HEADER(f"found no member at byte {entry.offset}", entry.decoded_name))
    _, _, flags, method, _, _, crc, compressed, size, n, m = _LOCAL_HEADER.unpack(head)
    name, extra = file.read(n), file.read(m)
    size, compressed = _apply_zip64(extra, size, compressed)
    pairs = {
        "name": (name, entry.name),
        "encryption": (flags & ENCRYPTED, entry.flags & ENCRYPTED),
        "method": (method, entry.method),
        "CRC": (crc, entry.crc),
        "compressed size": (compressed, entry.compressed_size),
        "size": (size, entry.size),
    }
    for label, (own, listed) in pairs.items():
        comes_later = own == 0 and flags & HAS_DATA_DESCRIPTOR and label in ("CRC", "compressed size", "size")
        if own != listed and not comes_later:
            raise FatalFinding(
                HEADER(f"its own header has {label} {own!r}, the table of contents has {listed!r}", entry.decoded_name)
            )
    return entry.offset + _LOCAL_HEADER.size + n + m
