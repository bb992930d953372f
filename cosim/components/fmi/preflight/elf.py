"""Reader of ELF shared libraries that does not load them.

Format and field names: System V ABI 4.1, chapters 4 and 5. The reader follows the same tables as
the dynamic loader: program headers, dynamic section, symbol table and symbol hash table.
"""

import re
import struct
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from .platforms import EXPECTED_TEXTS, InvalidLibraryError, SharedLibrary, check_end, unpack

MAGIC = b"\x7fELF"
#: (EI_CLASS, e_machine) of the supported architectures
MACHINES = {"x86_64": (2, 62), "aarch64": (2, 183), "x86": (1, 3)}
_MACHINE_NAMES = {
    3: "x86",
    8: "MIPS",
    21: "PowerPC64",
    40: "ARM",
    62: "x86_64",
    183: "aarch64",
    243: "RISC-V",
}
_ELFDATA2LSB = 1
_ET_DYN = 3
_PT_LOAD, _PT_DYNAMIC = 1, 2
_DT_NEEDED = 1
_DT_HASH = 4
_DT_STRTAB = 5
_DT_SYMTAB = 6
_DT_STRSZ = 10
_DT_RPATH = 15
_DT_RUNPATH = 29
_DT_GNU_HASH = 0x6FFFFEF5
_STB_LOCAL = 0
_STV_DEFAULT, _STV_PROTECTED = 0, 3
_SHN_UNDEF = 0
_MAX_SYMBOLS = 1 << 22
_MAX_TEXT_SIZE = 100
#: x86-64 code that returns the address of a constant: endbr64, push rbp, mov rbp, rsp, lea rax,
#: [rip + offset], pop rbp, ret
_RETURN_OF_CONSTANT = re.compile(
    rb"(?:\xf3\x0f\x1e\xfa)?(?:\x55\x48\x89\xe5)?\x48\x8d\x05(.{4})\x5d?\xc3", re.DOTALL
)


class _ProgramHeader(NamedTuple):
    p_type: int
    p_offset: int
    p_vaddr: int
    p_filesz: int


def read_library(content: bytes, architecture: str) -> SharedLibrary:
    """Read the dynamic linking information of an ELF shared library.

    Args:
        content: The file.
        architecture: Architecture that the library must be built for.

    Raises:
        InvalidLibraryError: The loader of the architecture would reject the file, or crash on it.
    """
    bits, byte_order = _check_header(content, architecture)
    return _ElfReader(content, bits, byte_order).library()


def _check_header(content: bytes, architecture: str) -> tuple[int, str]:
    """Check the ELF header; return the word size (bits) and the byte order as in `struct`."""
    if not content.startswith(MAGIC):
        raise InvalidLibraryError("is not an ELF file")
    if len(content) < 64:
        raise InvalidLibraryError("is truncated: its header is incomplete")
    ei_class, ei_data = content[4], content[5]
    if ei_class not in (1, 2) or ei_data not in (1, 2):
        raise InvalidLibraryError("has a damaged ELF header")
    byte_order = "<" if ei_data == _ELFDATA2LSB else ">"
    e_type, e_machine = struct.unpack_from(f"{byte_order}2H", content, 16)
    expected = MACHINES.get(architecture)
    if expected is not None and ((ei_class, e_machine) != expected or ei_data != _ELFDATA2LSB):
        machine = _MACHINE_NAMES.get(e_machine, f"machine {e_machine}")
        endianness = "little" if ei_data == _ELFDATA2LSB else "big"
        raise InvalidLibraryError(
            f"is built for {machine}, {32 * ei_class} bit, {endianness}-endian; this machine is "
            f"{architecture}, little-endian"
        )
    if e_type != _ET_DYN:
        raise InvalidLibraryError(f"is an ELF file of type {e_type}, expected a shared library")
    return 32 * ei_class, byte_order


class _ElfReader:
    """Reader of the tables of one ELF file."""

    def __init__(self, content: bytes, bits: int, byte_order: str):
        self.content, self.bits, self.byte_order = content, bits, byte_order
        self.word_format = "Q" if bits == 64 else "L"
        self.program_headers = list(self._program_headers())

    def unpack(self, form: str, offset: int) -> tuple[int, ...]:
        """Unpack numbers at an offset in the file, in the format of `struct` without byte order."""
        return unpack(self.content, self.byte_order + form, offset)

    def _program_headers(self) -> Iterator[_ProgramHeader]:
        is_64_bit = self.bits == 64
        (e_phoff,) = self.unpack(self.word_format, 32 if is_64_bit else 28)
        e_phentsize, e_phnum = self.unpack("2H", 54 if is_64_bit else 42)
        if e_phnum == 0 or e_phentsize < (56 if is_64_bit else 32):
            raise InvalidLibraryError("has no segments to load")
        for i in range(e_phnum):
            offset = e_phoff + i * e_phentsize
            if is_64_bit:
                p_type, _, p_offset, p_vaddr, _, p_filesz = self.unpack("2L4Q", offset)
            else:
                p_type, p_offset, p_vaddr, _, p_filesz = self.unpack("5L", offset)
            if p_type in (_PT_LOAD, _PT_DYNAMIC):
                check_end(self.content, p_offset + p_filesz, "a segment")
            yield _ProgramHeader(p_type, p_offset, p_vaddr, p_filesz)

    def library(self) -> SharedLibrary:
        """Read the dynamic section and the tables it refers to."""
        dynamic = list(self._dynamic_entries())
        first_values = dict(reversed(dynamic))
        if not {_DT_STRTAB, _DT_SYMTAB, _DT_STRSZ} <= first_values.keys():
            raise InvalidLibraryError("has no symbol table")
        strings = self._read_address(first_values[_DT_STRTAB], first_values[_DT_STRSZ])
        search_path = ":".join(
            _string_at(strings, value) for tag, value in dynamic if tag in (_DT_RPATH, _DT_RUNPATH)
        )
        addresses = dict(self._exported_symbols(first_values, strings))
        texts = {
            name: self._constant_text(addresses[name])
            for name in EXPECTED_TEXTS
            if name in addresses
        }
        return SharedLibrary(
            frozenset(addresses),
            [_string_at(strings, value) for tag, value in dynamic if tag == _DT_NEEDED],
            [folder for folder in search_path.split(":") if folder],
            {name: text for name, text in texts.items() if text is not None},
        )

    def _dynamic_entries(self) -> Iterator[tuple[int, int]]:
        """Yield (d_tag, d_val) of the dynamic section."""
        offset = next(
            (header.p_offset for header in self.program_headers if header.p_type == _PT_DYNAMIC),
            None,
        )
        if offset is None:
            raise InvalidLibraryError("is not linked dynamically")
        size = struct.calcsize(f"{self.byte_order}2{self.word_format}")
        while (entry := self.unpack(f"2{self.word_format}", offset))[0]:
            yield entry[0], entry[1]
            offset += size

    def _file_offset(self, address: int) -> int:
        """Return the offset in the file of the byte that is loaded to an address."""
        for p_type, p_offset, p_vaddr, p_filesz in self.program_headers:
            if p_type == _PT_LOAD and p_vaddr <= address < p_vaddr + p_filesz:
                return p_offset + address - p_vaddr
        raise InvalidLibraryError(f"is damaged: address {address:#x} is in no segment")

    def _read_address(self, address: int, size: int) -> bytes:
        begin = self._file_offset(address)
        check_end(self.content, begin + size, "a table")
        return self.content[begin : begin + size]

    def _constant_text(self, address: int) -> bytes | None:
        """Return the text that a function returns; None if its code does anything else."""
        try:
            code = self._read_address(address, 0x20)
            match = (
                _RETURN_OF_CONSTANT.match(code)
                if self.unpack("H", 18) == (MACHINES["x86_64"][1],)
                else None
            )
            if match is None:
                return None
            begin = self._file_offset(
                address + match.end(1) + int.from_bytes(match[1], "little", signed=True)
            )
        except InvalidLibraryError:
            return None
        return self.content[begin : begin + _MAX_TEXT_SIZE].partition(b"\0")[0]

    def _exported_symbols(
        self, dynamic: Mapping[int, int], strings: bytes
    ) -> Iterator[tuple[str, int]]:
        """Yield names and addresses of the symbols that are defined and visible to others.

        The addresses are 0 in 32-bit files.
        """
        symbol = struct.Struct(self.byte_order + ("L2BHQ8x" if self.bits == 64 else "L8x2BH"))
        table = self._read_address(dynamic[_DT_SYMTAB], self._symbol_count(dynamic) * symbol.size)
        for st_name, st_info, st_other, st_shndx, *st_value in symbol.iter_unpack(table):
            is_visible = st_other & 3 in (_STV_DEFAULT, _STV_PROTECTED)
            if st_shndx != _SHN_UNDEF and st_info >> 4 != _STB_LOCAL and is_visible:
                yield _string_at(strings, st_name), st_value[0] if st_value else 0

    def _symbol_count(self, dynamic: Mapping[int, int]) -> int:
        if _DT_HASH in dynamic:
            count = self.unpack("2L", self._file_offset(dynamic[_DT_HASH]))[1]
        elif _DT_GNU_HASH in dynamic:
            count = self._gnu_symbol_count(self._file_offset(dynamic[_DT_GNU_HASH]))
        else:
            raise InvalidLibraryError("has no symbol hash table")
        if count > _MAX_SYMBOLS:
            raise InvalidLibraryError(f"is damaged: it claims {count} symbols")
        return count

    def _gnu_symbol_count(self, offset: int) -> int:
        """Return one more than the largest symbol index in the chains of a GNU hash table."""
        # The table has no number of symbols. Each bucket holds the first symbol of a chain, and
        # the chain ends with a hash whose lowest bit is set: the end of the chain with the largest
        # first symbol is the last symbol.
        nbuckets, symoffset, bloom_size, _ = self.unpack("4L", offset)
        if nbuckets > _MAX_SYMBOLS or bloom_size > _MAX_SYMBOLS:
            raise InvalidLibraryError(f"is damaged: it claims {nbuckets} hash buckets")
        buckets = offset + 16 + bloom_size * (self.bits // 8)
        last = max(self.unpack(f"{nbuckets}L", buckets), default=0)
        if last < symoffset:
            return symoffset
        chains = buckets + 4 * nbuckets
        while not self.unpack("L", chains + 4 * (last - symoffset))[0] & 1:
            last += 1
        return last + 1


def _string_at(strings: bytes, index: int) -> str:
    end = strings.find(b"\0", index)
    if index >= len(strings) or end < 0:
        raise InvalidLibraryError("is damaged: a name is outside the string table")
    return strings[index:end].decode("utf-8", "replace")
