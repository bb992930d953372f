"""What an ELF shared library says about itself, read without loading it (System V gABI 4.1, chapters 4 and 5)."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping

from .library import InvalidLibrary, SharedLibrary

MAGIC = b"\x7fELF"
#: (class, machine) of the architectures
MACHINES = {"x86_64": (2, 62), "aarch64": (2, 183), "x86": (1, 3)}
_MACHINE_NAMES = {3: "x86", 8: "MIPS", 21: "PowerPC64", 40: "ARM", 62: "x86_64", 183: "aarch64", 243: "RISC-V"}
_ET_DYN = 3
_LOAD, _DYNAMIC = 1, 2
_NEEDED, _HASH, _STRTAB, _SYMTAB, _STRSZ, _RPATH, _RUNPATH, _GNU_HASH = 1, 4, 5, 6, 10, 15, 29, 0x6FFFFEF5
_MAX_SYMBOLS = 1 << 22


def read_library(content: bytes, architecture: str) -> SharedLibrary:
    """Raises Damaged for anything that the loader of an `architecture` would refuse, or die of."""
    bits, order = _check_header(content, architecture)
    return _ElfReader(content, bits, order).library()


def _check_header(content: bytes, architecture: str) -> tuple[int, str]:
    if not content.startswith(MAGIC):
        raise InvalidLibrary("is no ELF file")
    if len(content) < 64:
        raise InvalidLibrary("is cut: its header is incomplete")
    kind, endian = content[4], content[5]
    if kind not in (1, 2) or endian not in (1, 2):
        raise InvalidLibrary("has a damaged ELF header")
    order = "<" if endian == 1 else ">"
    file_type, machine = struct.unpack_from(f"{order}2H", content, 16)
    wanted = MACHINES.get(architecture)
    if wanted is not None and ((kind, machine) != wanted or endian != 1):
        found = (
            f"{_MACHINE_NAMES.get(machine, f'machine {machine}')}, {32 * kind} bit, {'little' if endian == 1 else 'big'}-endian"
        )
        raise InvalidLibrary(f"is made for {found}; this machine is {architecture}, little-endian")
    if file_type != _ET_DYN:
        raise InvalidLibrary(f"is an ELF file of type {file_type}, expected a shared library")
    return 32 * kind, order


class _ElfReader:
    """Follows what the dynamic loader follows: segments, the dynamic table, symbols."""

    def __init__(self, content: bytes, bits: int, order: str):
        self.content, self.bits, self.order = content, bits, order
        self.word_format = "Q" if bits == 64 else "L"
        self.segments = list(self._segments())
        self.load_segments = [segment[1:] for segment in self.segments if segment[0] == _LOAD]

    def unpack(self, form: str, offset: int) -> tuple[int, ...]:
        form = self.order + form
        if offset < 0 or offset + struct.calcsize(form) > len(self.content):
            raise InvalidLibrary(f"is cut: it refers to byte {offset}, but has {len(self.content)}")
        return struct.unpack_from(form, self.content, offset)

    def _segments(self) -> Iterator[tuple[int, int, int, int]]:
        """(type, offset, address, size in the file) of each program header."""
        wide = self.bits == 64
        (table,) = self.unpack(self.word_format, 32 if wide else 28)
        size, count = self.unpack("2H", 54 if wide else 42)
        if count == 0 or size < (56 if wide else 32):
            raise InvalidLibrary("has no segments to load")
        for i in range(count):
            kind, offset, address, length = self._segment(table + i * size)
            if kind in (_LOAD, _DYNAMIC) and offset + length > len(self.content):
                raise InvalidLibrary(f"is cut: a segment ends at byte {offset + length}, the file at {len(self.content)}")
            yield kind, offset, address, length

    def _segment(self, place: int) -> tuple[int, int, int, int]:
        if self.bits == 64:
            kind, _, offset, address, _, length = self.unpack("2L4Q", place)
        else:
            kind, offset, address, _, length = self.unpack("5L", place)
        return kind, offset, address, length

    def library(self) -> SharedLibrary:
        dynamic = list(self._dynamic_entries())
        first = dict(reversed(dynamic))
        if not {_STRTAB, _SYMTAB, _STRSZ} <= first.keys():
            raise InvalidLibrary("has no table of symbols")
        strings = self._read_address(first[_STRTAB], first[_STRSZ])
        search = ":".join(_string_at(strings, value) for tag, value in dynamic if tag in (_RPATH, _RUNPATH))
        return SharedLibrary(
            frozenset(self._exported_symbols(first, strings)),
            [_string_at(strings, value) for tag, value in dynamic if tag == _NEEDED],
            [folder for folder in search.split(":") if folder],
        )

    def _dynamic_entries(self) -> Iterator[tuple[int, int]]:
        """The rows (tag, value) of the dynamic table."""
        place = next((offset for kind, offset, _, _ in self.segments if kind == _DYNAMIC), None)
        if place is None:
            raise InvalidLibrary("is not linked dynamically")
        step = struct.calcsize(f"{self.order}2{self.word_format}")
        while (row := self.unpack(f"2{self.word_format}", place))[0]:
            yield row[0], row[1]
            place += step

    def _file_offset(self, address: int) -> int:
        """Where in the file the byte lies that is loaded to an address."""
        for offset, begin, length in self.load_segments:
            if begin <= address < begin + length:
                return offset + address - begin
        raise InvalidLibrary(f"is damaged: address {address:#x} lies in no segment")

    def _read_address(self, address: int, length: int) -> bytes:
        begin = self._file_offset(address)
        if begin + length > len(self.content):
            raise InvalidLibrary(f"is cut: a table ends at byte {begin + length}, the file at {len(self.content)}")
        return self.content[begin : begin + length]

    def _exported_symbols(self, table: Mapping[int, int], strings: bytes) -> Iterator[str]:
        """Names of the symbols that are defined and visible from outside."""
        row = struct.Struct(self.order + ("L2BH16x" if self.bits == 64 else "L8x2BH"))
        symbols = self._read_address(table[_SYMTAB], self._symbol_count(table) * row.size)
        for name, info, other, section in row.iter_unpack(symbols):
            if section and info >> 4 and other & 3 in (0, 3):
                yield _string_at(strings, name)

    def _symbol_count(self, table: Mapping[int, int]) -> int:
        if _HASH in table:
            count = self.unpack("2L", self._file_offset(table[_HASH]))[1]
        elif _GNU_HASH in table:
            count = self._gnu_symbol_count(self._file_offset(table[_GNU_HASH]))
        else:
            raise InvalidLibrary("has no hash table of symbols")
        if count > _MAX_SYMBOLS:
            raise InvalidLibrary(f"is damaged: it claims {count} symbols")
        return count

    def _gnu_symbol_count(self, place: int) -> int:
        """One more than the last symbol of the longest-reaching chain."""
        buckets, first, bloom, _ = self.unpack("4L", place)
        if buckets > _MAX_SYMBOLS or bloom > _MAX_SYMBOLS:
            raise InvalidLibrary(f"is damaged: it claims {buckets} hash buckets")
        table = place + 16 + bloom * (self.bits // 8)
        last = max(self.unpack(f"{buckets}L", table), default=0)
        if last < first:
            return first
        chain = table + 4 * buckets
        while not self.unpack("L", chain + 4 * (last - first))[0] & 1:
            last += 1
        return last + 1


def _string_at(strings: bytes, place: int) -> str:
    end = strings.find(b"\0", place)
    if place >= len(strings) or end < 0:
        raise InvalidLibrary("is damaged: a name lies outside the table of names")
    return strings[place:end].decode("utf-8", "replace")
