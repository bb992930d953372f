"""ZIP archives read strictly: one table of contents at the very end, and headers that all say the same.

Python's zipfile is lenient by design: it accepts members that overlap, trailing data and headers that contradict each
other, so that two programs can see two different archives in one file. Format: PKWARE APPNOTE 6.3.10, sections 4.3 and 4.5.
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from io import BufferedReader

from .findings import Flaw, Rule

NO_ZIP = Rule("archive.zip", "APPNOTE 4.3")
TRAILING = Rule("archive.trailing-data", "APPNOTE 4.3.16")
CONTENTS = Rule("archive.contents", "APPNOTE 4.3.12")
HEADER = Rule("archive.header", "APPNOTE 4.3.7")

_END, _ENTRY, _LOCAL = struct.Struct("<4s4H2LH"), struct.Struct("<4s6H3L5H2L"), struct.Struct("<4s5H3L2H")
_END_MAGIC, _ENTRY_MAGIC, _LOCAL_MAGIC = b"PK\x05\x06", b"PK\x01\x02", b"PK\x03\x04"
_LONGEST_COMMENT = 0xFFFF
#: on average, in the table of contents
_LONGEST_ROW = 4096
_IN_EXTRA = 0xFFFFFFFF
#: bits of the flags
ENCRYPTED, SIZES_BEHIND, UTF8 = 0x2041, 0x8, 0x800


@dataclass(frozen=True, slots=True)
class Entry:
    """One row of the table of contents; sizes and offset in bytes, `mode` as of Unix (0: unknown)."""

    name: bytes
    flags: int
    method: int
    crc: int
    compressed: int
    size: int
    mode: int
    offset: int

    @property
    def text(self) -> str:
        """The name as text; without the flag for UTF-8 it is UTF-8 if it can be, else code page 437."""
        try:
            return self.name.decode()
        except UnicodeDecodeError:
            return self.name.decode("cp437")


def read_contents(file: BufferedReader, most: int) -> tuple[list[Entry], int]:
    """The table of contents, and where it begins. Raises Flaw when it has more than `most` rows or is none."""
    count, size, offset = _read_end(file)
    if count > most:
        raise Flaw(CONTENTS(f"found {count} members, expected at most {most}"))
    if size > most * _LONGEST_ROW:
        raise Flaw(CONTENTS(f"found a table of contents of {size} bytes, expected at most {most * _LONGEST_ROW}"))
    file.seek(offset)
    table = file.read(size)
    entries, place = [], 0
    for _ in range(count):
        entry, place = _read_entry(table, place)
        entries.append(entry)
    if place != size:
        raise Flaw(CONTENTS(f"the table of contents has {size - place} bytes more than its {count} members need"))
    return entries, offset


def _read_end(file: BufferedReader) -> tuple[int, int, int]:
    """(members, size, offset) of the table of contents, from the record at the very end of the file."""
    length = file.seek(0, os.SEEK_END)
    file.seek(max(0, length - _END.size - _LONGEST_COMMENT))
    tail = file.read()
    place = tail.rfind(_END_MAGIC)
    if place < 0 or len(tail) - place < _END.size:
        raise Flaw(NO_ZIP("is no FMU: File is not a zip file, or its end is missing"))
    _, disk, contents_disk, here, count, size, offset, comment = _END.unpack_from(tail, place)
    surplus = len(tail) - place - _END.size - comment
    if surplus or _encloses(tail, place):
        raise Flaw(TRAILING(f"found {abs(surplus)} bytes behind the end of the archive or a second end, expected neither"))
    if (disk, contents_disk) != (0, 0) or here != count:
        raise Flaw(CONTENTS("is one part of an archive in several parts"))
    end = length - _END.size - comment
    if offset + size != end:
        raise Flaw(CONTENTS(f"the table of contents should end at byte {end}, found {offset + size} (cut, or data in front?)"))
    return count, size, offset


def _encloses(tail: bytes, place: int) -> bool:
    """Whether an earlier end record takes the last one for its comment."""
    earlier = tail.find(_END_MAGIC)
    while earlier != place:
        if len(tail) - earlier >= _END.size and earlier + _END.size + _END.unpack_from(tail, earlier)[-1] == len(tail):
            return True
        earlier = tail.find(_END_MAGIC, earlier + 1)
    return False


def _read_entry(table: bytes, place: int) -> tuple[Entry, int]:
    if len(table) - place < _ENTRY.size or not table.startswith(_ENTRY_MAGIC, place):
        raise Flaw(CONTENTS(f"the table of contents is damaged at its byte {place}"))
    _, _, _, flags, method, _, _, crc, compressed, size, n, m, k, _, _, attributes, offset = _ENTRY.unpack_from(table, place)
    name_at = place + _ENTRY.size
    end = name_at + n + m + k
    if end > len(table):
        raise Flaw(CONTENTS(f"the table of contents is damaged at its byte {place}"))
    name = table[name_at : name_at + n]
    size, compressed, offset = _wide(table[name_at + n : name_at + n + m], size, compressed, offset)
    return Entry(name, flags, method, crc, compressed, size, attributes >> 16, offset), end


def _wide(extra: bytes, *values: int) -> tuple[int, ...]:
    """The values, with those that did not fit into 32 bits taken from the ZIP64 field (APPNOTE 4.5.3)."""
    place = 0
    while _IN_EXTRA in values and place + 4 <= len(extra):
        kind, length = struct.unpack_from("<2H", extra, place)
        if kind == 1:
            count = (len(extra[place + 4 : place + 4 + length])) // 8
            wide = iter(struct.unpack_from(f"<{count}Q", extra, place + 4))
            return tuple(next(wide, value) if value == _IN_EXTRA else value for value in values)
        place += 4 + length
    return values


def locate(file: BufferedReader, entry: Entry, end: int) -> int:
    """Where the data of a member begin, before `end`. Raises Flaw when its own header contradicts the table of contents."""
    file.seek(min(entry.offset, end))
    head = file.read(_LOCAL.size)
    if len(head) < _LOCAL.size or not head.startswith(_LOCAL_MAGIC):
        raise Flaw(HEADER(f"found no member at byte {entry.offset}", entry.text))
    _, _, flags, method, _, _, crc, compressed, size, n, m = _LOCAL.unpack(head)
    name, extra = file.read(n), file.read(m)
    size, compressed = _wide(extra, size, compressed)
    pairs = {
        "name": (name, entry.name),
        "encryption": (flags & ENCRYPTED, entry.flags & ENCRYPTED),
        "method": (method, entry.method),
        "CRC": (crc, entry.crc),
        "compressed size": (compressed, entry.compressed),
        "size": (size, entry.size),
    }
    for label, (own, listed) in pairs.items():
        comes_later = own == 0 and flags & SIZES_BEHIND and label in ("CRC", "compressed size", "size")
        if own != listed and not comes_later:
            raise Flaw(HEADER(f"its own header has {label} {own!r}, the table of contents has {listed!r}", entry.text))
    return entry.offset + _LOCAL.size + n + m
