"""What a macOS library says about itself, read without loading it (Apple's mach-o/loader.h, fat.h and nlist.h)."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from .library import InvalidLibrary, SharedLibrary

MACHINES = {"x86_64": 0x01000007, "aarch64": 0x0100000C, "x86": 7}
_MACHINE_NAMES = {number: name for name, number in MACHINES.items()}
_MAGIC, _MAGIC_32 = b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe"
#: several libraries in one file: magic -> form of an entry, place of offset and size in it
_FAT_FORMATS = {b"\xca\xfe\xba\xbe": ">5L", b"\xca\xfe\xba\xbf": ">2L2Q2L"}
_DYLIB, _BUNDLE = 6, 8
_LC_SEGMENT_64, _LC_SYMTAB = 0x19, 2
#: commands with a tree of exports -> where its offset and size stand
_EXPORT_TRIE_COMMANDS = {0x80000033: 8, 0x22: 40, 0x80000022: 40}
_MAX_ENTRIES = 1 << 20
#: of a symbol: seen by others, a debugger's, undefined unless one of these
_EXTERNAL, _DEBUG, _DEFINED = 0x01, 0xE0, 0x0E


def read_library(content: bytes, architecture: str) -> SharedLibrary:
    """The exports of a dynamic library, of a universal one those for the architecture (its dependencies are left to the loader).

    Raises Damaged for what the loader would refuse.
    """
    content = _select_architecture(content, architecture)
    if content.startswith(_MAGIC_32):
        raise InvalidLibrary(f"is made for 32 bit; this machine is {architecture}")
    if not content.startswith(_MAGIC):
        raise InvalidLibrary("is no macOS library")
    machine, _, kind, count, size = _unpack(content, "<5L", 4)
    if machine != MACHINES.get(architecture, machine):
        raise InvalidLibrary(f"is made for {_architecture_name(machine)}; this machine is {architecture}")
    if kind not in (_DYLIB, _BUNDLE):
        raise InvalidLibrary(f"is of type {kind}, expected a dynamic library")
    return SharedLibrary(frozenset(_exports(content, count, 32 + size)))


def _architecture_name(machine: int) -> str:
    return _MACHINE_NAMES.get(machine, f"machine {machine:#x}")


def _select_architecture(content: bytes, architecture: str) -> bytes:
    """The part of a universal file for the architecture; of others the whole."""
    form = _FAT_FORMATS.get(content[:4])
    if form is None:
        return content
    (count,) = _unpack(content, ">L", 4)
    if count > _MAX_ENTRIES:
        raise InvalidLibrary(f"is damaged: it claims {count} architectures")
    found = []
    for i in range(count):
        machine, _, offset, size, *_ = _unpack(content, form, 8 + i * struct.calcsize(form))
        if machine == MACHINES.get(architecture):
            if offset + size > len(content):
                raise InvalidLibrary(
                    f"is cut: the part for {architecture} ends at byte {offset + size}, the file at {len(content)}"
                )
            return content[offset : offset + size]
        found.append(_architecture_name(machine))
    raise InvalidLibrary(f"is made for {', '.join(found[:9]) or 'nothing'}; this machine is {architecture}")


def _unpack(content: bytes, form: str, offset: int) -> tuple[int, ...]:
    if offset + struct.calcsize(form) > len(content):
        raise InvalidLibrary(f"is cut: it refers to byte {offset}, but has {len(content)}")
    return struct.unpack_from(form, content, offset)


def _exports(content: bytes, count: int, end: int) -> Iterator[str]:
    """Names from the tables that the commands for the loader point to."""
    place = 32
    for _ in range(min(count, _MAX_ENTRIES)):
        command, size = _unpack(content, "<2L", place)
        if size < 8 or place + size > end:
            raise InvalidLibrary("has damaged commands for the loader")
        if command == _LC_SEGMENT_64:
            _check_segment(content, place)
        elif command == _LC_SYMTAB:
            yield from _symbol_table_exports(content, *_unpack(content, "<4L", place + 8))
        elif command in _EXPORT_TRIE_COMMANDS:
            yield from _trie_exports(content, *_unpack(content, "<2L", place + _EXPORT_TRIE_COMMANDS[command]))
        place += size


def _trie_exports(content: bytes, offset: int, size: int) -> Iterator[str]:
    """Names that the paths of a tree spell: a node is the size of what is exported, that, and its branches."""
    tree = content[offset : offset + size]
    if len(tree) < size:
        raise InvalidLibrary(f"is cut: its tree of exports ends at byte {offset + size}, the file at {len(content)}")
    nodes, seen = [(0, b"")] if tree else [], set[int]()
    while nodes:
        place, name = nodes.pop()
        if place in seen:
            raise InvalidLibrary("has a tree of exports that runs in circles")
        seen.add(place)
        exported, place = _read_uleb128(tree, place)
        if exported:
            yield name.decode("utf-8", "replace").removeprefix("_")
        nodes += _trie_children(tree, place + exported, name)


def _trie_children(tree: bytes, place: int, name: bytes) -> Iterator[tuple[int, bytes]]:
    (count,) = _unpack(tree, "<B", place)
    place += 1
    for _ in range(count):
        end = tree.find(b"\0", place)
        if end < 0:
            raise InvalidLibrary("is damaged: the name of an export does not end")
        branch, following = _read_uleb128(tree, end + 1)
        yield branch, name + tree[place:end]
        place = following


def _read_uleb128(tree: bytes, place: int) -> tuple[int, int]:
    """A number in groups of 7 bits, the lowest first, and the place behind it."""
    value = 0
    for shift in range(0, 64, 7):
        (byte,) = _unpack(tree, "<B", place)
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, place
    raise InvalidLibrary("is damaged: a number of its tree of exports does not end")


def _check_segment(content: bytes, place: int) -> None:
    offset, size = _unpack(content, "<2Q", place + 40)
    if offset + size > len(content):
        raise InvalidLibrary(f"is cut: a segment ends at byte {offset + size}, the file at {len(content)}")


def _symbol_table_exports(content: bytes, table: int, count: int, names: int, length: int) -> Iterator[str]:
    """Symbols that others see; C names begin with an underscore there."""
    if count > _MAX_ENTRIES or names + length > len(content):
        raise InvalidLibrary(f"is cut: its table of {count} symbols ends at byte {names + length}, the file at {len(content)}")
    for i in range(count):
        index, kind, _, _, _ = _unpack(content, "<L2BHQ", table + 16 * i)
        if kind & _EXTERNAL and not kind & _DEBUG and kind & _DEFINED and index < length:
            end = content.find(b"\0", names + index, names + length)
            name = content[names + index : end if end >= 0 else names + length]
            yield name.decode("utf-8", "replace").removeprefix("_")
