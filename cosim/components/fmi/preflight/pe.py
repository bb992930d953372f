"""What a Windows library says about itself, read without loading it (Microsoft PE/COFF specification, sections 3 to 6)."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from .library import InvalidLibrary, SharedLibrary

MACHINES = {"x86_64": 0x8664, "aarch64": 0xAA64, "x86": 0x14C}
_MACHINE_NAMES = {number: name for name, number in MACHINES.items()}
_FILE_DLL = 0x2000
_PE32, _PE32_PLUS = 0x10B, 0x20B
_MAX_EXPORTS = 1 << 20


def read_library(content: bytes, architecture: str) -> SharedLibrary:
    """The exports of a DLL (its dependencies are left to the loader). Raises Damaged for what the loader would refuse."""
    if not content.startswith(b"MZ"):
        raise InvalidLibrary("is no Windows library")
    header = _unpack(content, "<L", 0x3C)[0]
    if content[header : header + 4] != b"PE\0\0":
        raise InvalidLibrary("has a damaged PE header")
    machine, sections, _, _, _, size, flags = _unpack(content, "<2H3L2H", header + 4)
    if machine != MACHINES.get(architecture, machine):
        raise InvalidLibrary(
            f"is made for {_MACHINE_NAMES.get(machine, f'machine {machine:#x}')}; this machine is {architecture}"
        )
    if not flags & _FILE_DLL:
        raise InvalidLibrary("is no library but a program")
    optional = header + 24
    table = list(_sections(content, optional + size, sections))
    return SharedLibrary(frozenset(_exports(content, _export_directory(content, optional), table)))


def _unpack(content: bytes, form: str, offset: int) -> tuple[int, ...]:
    if offset + struct.calcsize(form) > len(content):
        raise InvalidLibrary(f"is cut: it refers to byte {offset}, but has {len(content)}")
    return struct.unpack_from(form, content, offset)


def _sections(content: bytes, place: int, count: int) -> Iterator[tuple[int, int, int]]:
    """(address, length in the file, offset in the file) of each section."""
    for i in range(count):
        _, address, length, offset = _unpack(content, "<4L", place + 40 * i + 8)
        if length and offset + length > len(content):
            raise InvalidLibrary(f"is cut: a section ends at byte {offset + length}, the file at {len(content)}")
        yield address, length, offset


def _export_directory(content: bytes, optional: int) -> int:
    """The address of the table of exports, which is the first of the data directories."""
    (magic,) = _unpack(content, "<H", optional)
    if magic not in (_PE32, _PE32_PLUS):
        raise InvalidLibrary("has a damaged PE header")
    count, address = _unpack(content, "<2L", optional + (108 if magic == _PE32_PLUS else 92))
    return address if count else 0


def _exports(content: bytes, directory: int, table: list[tuple[int, int, int]]) -> Iterator[str]:
    if directory == 0:
        return
    count, _, names = _unpack(content, "<3L", _file_offset(directory, table) + 24)
    if count > _MAX_EXPORTS:
        raise InvalidLibrary(f"is damaged: it claims {count} exports")
    for address in _unpack(content, f"<{count}L", _file_offset(names, table) if count else 0):
        begin = _file_offset(address, table)
        end = content.find(b"\0", begin, begin + 4096)
        if end < 0:
            raise InvalidLibrary("is damaged: the name of an export does not end")
        yield content[begin:end].decode("utf-8", "replace")


def _file_offset(address: int, table: list[tuple[int, int, int]]) -> int:
    """Where in the file the byte lies that is loaded to an address."""
    for begin, length, offset in table:
        if begin <= address < begin + length:
            return offset + address - begin
    raise InvalidLibrary(f"is damaged: address {address:#x} lies in no section")
