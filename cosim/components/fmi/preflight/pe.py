"""Reader of Windows libraries (PE) that does not load them.

Format and field names: Microsoft PE/COFF specification, sections 3 to 6.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from .platforms import InvalidLibraryError, SharedLibrary, check_end, unpack

#: values of Machine by architecture
MACHINES = {"x86_64": 0x8664, "aarch64": 0xAA64, "x86": 0x14C}
_MACHINE_NAMES = {number: name for name, number in MACHINES.items()}
_IMAGE_FILE_DLL = 0x2000
#: Magic of the optional header
_PE32, _PE32_PLUS = 0x10B, 0x20B
_COFF_HEADER_SIZE, _SECTION_HEADER_SIZE = 24, 40
_MAX_EXPORTS, _MAX_NAME_LENGTH = 1 << 20, 4096


class _Section(NamedTuple):
    virtual_address: int
    size_of_raw_data: int
    pointer_to_raw_data: int


def read_library(content: bytes, architecture: str) -> SharedLibrary:
    """Read the exports of a DLL; its dependencies are not read.

    Args:
        content: The file.
        architecture: Architecture that the library must be built for.

    Raises:
        InvalidLibraryError: The loader would reject the file.
    """
    if not content.startswith(b"MZ"):
        raise InvalidLibraryError("is not a Windows library")
    (e_lfanew,) = unpack(content, "<L", 0x3C)
    if content[e_lfanew : e_lfanew + 4] != b"PE\0\0":
        raise InvalidLibraryError("has a damaged PE header")
    machine, number_of_sections, _, _, _, optional_header_size, characteristics = unpack(
        content, "<2H3L2H", e_lfanew + 4
    )
    if machine != MACHINES.get(architecture, machine):
        machine_name = _MACHINE_NAMES.get(machine, f"machine {machine:#x}")
        raise InvalidLibraryError(f"is built for {machine_name}; this machine is {architecture}")
    if not characteristics & _IMAGE_FILE_DLL:
        raise InvalidLibraryError("is a program, expected a library")
    optional_header = e_lfanew + _COFF_HEADER_SIZE
    sections = list(_sections(content, optional_header + optional_header_size, number_of_sections))
    return SharedLibrary(
        frozenset(_exports(content, _export_table_address(content, optional_header), sections))
    )


def _sections(content: bytes, section_table: int, count: int) -> Iterator[_Section]:
    for i in range(count):
        _, address, size, pointer = unpack(
            content, "<4L", section_table + _SECTION_HEADER_SIZE * i + 8
        )
        if size:
            check_end(content, pointer + size, "a section")
        yield _Section(address, size, pointer)


def _export_table_address(content: bytes, optional_header: int) -> int:
    """Return the address of the export table from the data directories, or 0 if there is none."""
    (magic,) = unpack(content, "<H", optional_header)
    if magic not in (_PE32, _PE32_PLUS):
        raise InvalidLibraryError("has a damaged PE header")
    directory_count, address = unpack(
        content, "<2L", optional_header + (108 if magic == _PE32_PLUS else 92)
    )
    return address if directory_count else 0


def _exports(content: bytes, export_table: int, sections: Sequence[_Section]) -> Iterator[str]:
    """Yield the names in the export name pointer table."""
    if export_table == 0:
        return
    name_count, _, name_pointers = unpack(content, "<3L", _file_offset(export_table, sections) + 24)
    if name_count > _MAX_EXPORTS:
        raise InvalidLibraryError(f"is damaged: it claims {name_count} exports")
    for address in unpack(
        content, f"<{name_count}L", _file_offset(name_pointers, sections) if name_count else 0
    ):
        begin = _file_offset(address, sections)
        end = content.find(b"\0", begin, begin + _MAX_NAME_LENGTH)
        if end < 0:
            raise InvalidLibraryError("is damaged: the name of an export is not terminated")
        yield content[begin:end].decode("utf-8", "replace")


def _file_offset(address: int, sections: Sequence[_Section]) -> int:
    """Return the offset in the file of the byte that is loaded to a relative virtual address."""
    for begin, size, offset in sections:
        if begin <= address < begin + size:
            return offset + address - begin
    raise InvalidLibraryError(f"is damaged: address {address:#x} is in no section")
