"""Windows libraries are read on any machine; PythonFMU's is a real one."""

import random
import struct

import pytest
from bad_fmus import read_members

from cosim.components.fmi.preflight import DEFAULT_LIMITS, examine, open_regular_file, pe
from cosim.components.fmi.preflight.archive import Archive
from cosim.components.fmi.preflight.binary import REQUIRED_FUNCTIONS, check_binary
from cosim.components.fmi.preflight.fmu_platform import FmuPlatform
from cosim.components.fmi.preflight.library import InvalidLibraryError
from cosim.core import resources

FMU = resources.root() / "fmus/python/vtol.fmu"
WINDOWS = FmuPlatform("windows", "x86_64", ".dll")


@pytest.fixture(scope="module")
def library():
    return read_members(FMU)["binaries/win64/Vtol.dll"]


def patched(content, offset, form, value):
    content = bytearray(content)
    struct.pack_into(form, content, offset, value)
    return bytes(content)


def test_a_real_library_exports_what_fmi_demands(library):
    assert REQUIRED_FUNCTIONS[2] <= pe.read_library(library, "x86_64").exports


def test_an_fmu_is_good_for_windows():
    with open_regular_file(FMU) as file:
        assert list(check_binary(Archive(file, DEFAULT_LIMITS), examine(FMU).model, WINDOWS, DEFAULT_LIMITS)) == []


def test_a_missing_function_is_named(library):
    exports = pe.read_library(library.replace(b"fmi2DoStep\0", b"fmi2DoSteq\0"), "x86_64").exports
    assert REQUIRED_FUNCTIONS[2] - exports == {"fmi2DoStep"}


def header(library):
    return struct.unpack_from("<L", library, 0x3C)[0]


DAMAGED = {
    "empty": (lambda dll: b"", "is no Windows library"),
    "ELF": (lambda dll: b"\x7fELF" + dll[4:], "is no Windows library"),
    "only a header": (lambda dll: dll[:60], "is cut: it refers to byte 60"),
    "header beyond": (lambda dll: patched(dll, 0x3C, "<L", 2**31), "has a damaged PE header"),
    "cut": (lambda dll: dll[:-2000], "is cut: a section ends at byte"),
    "ARM": (lambda dll: patched(dll, header(dll) + 4, "<H", 0xAA64), "is made for aarch64; this machine is x86_64"),
    "32 bit": (lambda dll: patched(dll, header(dll) + 4, "<H", 0x14C), "is made for x86; this machine is x86_64"),
    "program": (lambda dll: patched(dll, header(dll) + 22, "<H", 0x22), "is no library but a program"),
    "optional header": (lambda dll: patched(dll, header(dll) + 24, "<H", 7), "has a damaged PE header"),
    "exports elsewhere": (lambda dll: patched(dll, header(dll) + 24 + 112, "<L", 2**31), "lies in no section"),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_libraries_are_told(case, library):
    change, words = DAMAGED[case]
    with pytest.raises(InvalidLibraryError, match=words):
        pe.read_library(change(library), "x86_64")


def test_no_exports_at_all(library):
    assert pe.read_library(patched(library, header(library) + 24 + 112, "<L", 0), "x86_64").exports == frozenset()


def test_mutants_are_read_or_damaged(library):
    draw = random.Random(1)  # noqa: S311 - mutants have to come back the same
    outcomes = set()
    for _ in range(300):
        content = bytearray(library)
        for _ in range(4):
            content[draw.randrange(1024)] = draw.randrange(256)
        try:
            outcomes.add(type(pe.read_library(bytes(content), "x86_64")))
        except InvalidLibraryError:
            outcomes.add(InvalidLibraryError)
    assert len(outcomes) == 2
