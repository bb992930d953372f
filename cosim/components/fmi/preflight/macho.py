"""Reader of macOS libraries (Mach-O) that does not load them.

Format and field names: Apple's mach-o/loader.h, fat.h and nlist.h.
"""

import struct
from collections.abc import Iterator

from .platforms import InvalidLibraryError, SharedLibrary, check_end, unpack

#: values of cputype by architecture
MACHINES = {"x86_64": 0x01000007, "aarch64": 0x0100000C, "x86": 7}
_MACHINE_NAMES = {number: name for name, number in MACHINES.items()}
_MH_MAGIC_64, _MH_MAGIC = b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe"
#: universal files: magic -> format of fat_arch and fat_arch_64
_FAT_FORMATS = {b"\xca\xfe\xba\xbe": ">5L", b"\xca\xfe\xba\xbf": ">2L2Q2L"}
_FAT_HEADER_SIZE, _MACH_HEADER_64_SIZE = 8, 32
_MH_DYLIB, _MH_BUNDLE = 6, 8
_LC_SEGMENT_64, _LC_SYMTAB = 0x19, 2
#: LC_DYLD_EXPORTS_TRIE, LC_DYLD_INFO, LC_DYLD_INFO_ONLY -> position of the export trie's offset and
#: size in the command
_EXPORT_TRIE_COMMANDS = {0x80000033: 8, 0x22: 40, 0x80000022: 40}
_MAX_ENTRIES = 1 << 20
#: bits of n_type
_N_EXT, _N_STAB, _N_TYPE = 0x01, 0xE0, 0x0E
_NLIST_64_SIZE = 16


def read_library(content: bytes, architecture: str) -> SharedLibrary:
    """Read the exports of a dynamic library; its dependencies are not read.

    Args:
        content: The file; of a universal file the part for the architecture is read.
        architecture: Architecture that the library must be built for.

    Raises:
        InvalidLibraryError: The loader would reject the file.
    """
    content = _select_architecture(content, architecture)
    if content.startswith(_MH_MAGIC):
        raise InvalidLibraryError(f"is built for 32 bit; this machine is {architecture}")
    if not content.startswith(_MH_MAGIC_64):
        raise InvalidLibraryError("is not a macOS library")
    cputype, _, filetype, ncmds, sizeofcmds = unpack(content, "<5L", 4)
    if cputype != MACHINES.get(architecture, cputype):
        raise InvalidLibraryError(
            f"is built for {_architecture_name(cputype)}; this machine is {architecture}"
        )
    if filetype not in (_MH_DYLIB, _MH_BUNDLE):
        raise InvalidLibraryError(f"is of type {filetype}, expected a dynamic library")
    return SharedLibrary(frozenset(_exports(content, ncmds, _MACH_HEADER_64_SIZE + sizeofcmds)))


def _architecture_name(cputype: int) -> str:
    return _MACHINE_NAMES.get(cputype, f"machine {cputype:#x}")


def _select_architecture(content: bytes, architecture: str) -> bytes:
    """Return the part of a universal file for the architecture, or the whole of any other file."""
    form = _FAT_FORMATS.get(content[:4])
    if form is None:
        return content
    (nfat_arch,) = unpack(content, ">L", 4)
    if nfat_arch > _MAX_ENTRIES:
        raise InvalidLibraryError(f"is damaged: it claims {nfat_arch} architectures")
    names = []
    for i in range(nfat_arch):
        cputype, _, offset, size, *_ = unpack(
            content, form, _FAT_HEADER_SIZE + i * struct.calcsize(form)
        )
        if cputype == MACHINES.get(architecture):
            check_end(content, offset + size, f"the part for {architecture}")
            return content[offset : offset + size]
        names.append(_architecture_name(cputype))
    raise InvalidLibraryError(
        f"is built for {', '.join(names[:9]) or 'no architecture'}; this machine is {architecture}"
    )


def _exports(content: bytes, ncmds: int, end: int) -> Iterator[str]:
    """Yield the names in the tables that the load commands refer to."""
    offset = _MACH_HEADER_64_SIZE
    for _ in range(min(ncmds, _MAX_ENTRIES)):
        cmd, cmdsize = unpack(content, "<2L", offset)
        if cmdsize < 8 or offset + cmdsize > end:
            raise InvalidLibraryError("has damaged load commands")
        if cmd == _LC_SEGMENT_64:
            fileoff, filesize = unpack(content, "<2Q", offset + 40)
            check_end(content, fileoff + filesize, "a segment")
        elif cmd == _LC_SYMTAB:
            yield from _symbol_table_exports(content, *unpack(content, "<4L", offset + 8))
        elif cmd in _EXPORT_TRIE_COMMANDS:
            yield from _trie_exports(
                content, *unpack(content, "<2L", offset + _EXPORT_TRIE_COMMANDS[cmd])
            )
        offset += cmdsize


def _trie_exports(content: bytes, offset: int, size: int) -> Iterator[str]:
    """Yield the names of an export trie.

    A node is the size of its export information, that information, and its edges.
    """
    trie = content[offset : offset + size]
    check_end(content, offset + size, "its export trie")
    nodes, visited = [(0, b"")] if trie else [], set[int]()
    while nodes:
        node, name = nodes.pop()
        if node in visited:
            raise InvalidLibraryError("has an export trie with a cycle")
        visited.add(node)
        terminal_size, position = _read_uleb128(trie, node)
        if terminal_size:
            yield name.decode("utf-8", "replace").removeprefix("_")
        nodes += _trie_children(trie, position + terminal_size, name)


def _trie_children(trie: bytes, position: int, name: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield (offset, name) of the child nodes, from the edges at a position."""
    (count,) = unpack(trie, "<B", position)
    position += 1
    for _ in range(count):
        end = trie.find(b"\0", position)
        if end < 0:
            raise InvalidLibraryError("is damaged: the name of an export is not terminated")
        child, next_position = _read_uleb128(trie, end + 1)
        yield child, name + trie[position:end]
        position = next_position


def _read_uleb128(trie: bytes, position: int) -> tuple[int, int]:
    """Read a ULEB128 number; return it and the position after it."""
    value = 0
    for shift in range(0, 64, 7):
        (byte,) = unpack(trie, "<B", position)
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, position
    raise InvalidLibraryError("is damaged: a number in its export trie is not terminated")


def _symbol_table_exports(
    content: bytes, symoff: int, nsyms: int, stroff: int, strsize: int
) -> Iterator[str]:
    """Yield the names of the defined external symbols without their leading underscores."""
    if nsyms > _MAX_ENTRIES or stroff + strsize > len(content):
        raise InvalidLibraryError(
            f"is truncated: its table of {nsyms} symbols ends at byte {stroff + strsize}, the file "
            f"at {len(content)}"
        )
    for i in range(nsyms):
        n_strx, n_type, _, _, _ = unpack(content, "<L2BHQ", symoff + _NLIST_64_SIZE * i)
        if n_type & _N_EXT and not n_type & _N_STAB and n_type & _N_TYPE and n_strx < strsize:
            end = content.find(b"\0", stroff + n_strx, stroff + strsize)
            name = content[stroff + n_strx : end if end >= 0 else stroff + strsize]
            yield name.decode("utf-8", "replace").removeprefix("_")
