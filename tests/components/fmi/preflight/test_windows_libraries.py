"""Reader of Windows libraries, tested on any platform with the library of PythonFMU."""

import random
import struct

import pytest
from bad_fmus import read_members

from cosim.components.fmi.preflight import examine, pe
from cosim.components.fmi.preflight.archive import Archive, open_regular_file
from cosim.components.fmi.preflight.binary import check_binary
from cosim.components.fmi.preflight.c_functions import standard_functions
from cosim.components.fmi.preflight.platforms import FmuPlatform, InvalidLibraryError
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


def test_a_real_library_exports_the_functions_of_fmi(library):
    assert standard_functions(2, "co-simulation") <= pe.read_library(library, "x86_64").exports


def test_an_fmu_with_a_windows_library_is_accepted():
    with open_regular_file(FMU) as file:
        assert (
            list(
                check_binary(
                    Archive(file),
                    examine(FMU).model,
                    "co-simulation",
                    WINDOWS,
                )
            )
            == []
        )


def test_a_missing_function_is_named(library):
    exports = pe.read_library(library.replace(b"fmi2DoStep\0", b"fmi2DoSteq\0"), "x86_64").exports
    assert standard_functions(2, "co-simulation") - exports == {"fmi2DoStep"}


def header(library):
    return struct.unpack_from("<L", library, 0x3C)[0]


DAMAGED = {
    "empty": (lambda _: b"", "is not a Windows library"),
    "ELF": (lambda dll: b"\x7fELF" + dll[4:], "is not a Windows library"),
    "only a header": (lambda dll: dll[:60], "is truncated: it refers to byte 60"),
    "header beyond": (lambda dll: patched(dll, 0x3C, "<L", 2**31), "has a damaged PE header"),
    "cut": (lambda dll: dll[:-2000], "is truncated: a section ends at byte"),
    "ARM": (
        lambda dll: patched(dll, header(dll) + 4, "<H", 0xAA64),
        "is built for aarch64; this machine is x86_64",
    ),
    "32 bit": (
        lambda dll: patched(dll, header(dll) + 4, "<H", 0x14C),
        "is built for x86; this machine is x86_64",
    ),
    "program": (
        lambda dll: patched(dll, header(dll) + 22, "<H", 0x22),
        "is a program, expected a library",
    ),
    "optional header": (
        lambda dll: patched(dll, header(dll) + 24, "<H", 7),
        "has a damaged PE header",
    ),
    "exports elsewhere": (
        lambda dll: patched(dll, header(dll) + 24 + 112, "<L", 2**31),
        "is in no section",
    ),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_libraries_are_refused(case, library):
    change, words = DAMAGED[case]
    with pytest.raises(InvalidLibraryError, match=words):
        pe.read_library(change(library), "x86_64")


def test_a_library_without_export_table(library):
    assert (
        pe.read_library(patched(library, header(library) + 24 + 112, "<L", 0), "x86_64").exports
        == frozenset()
    )


def test_mutants_are_read_or_refused(library):
    rng = random.Random(1)  # noqa: S311 - seeded for reproducible mutants
    outcomes = set()
    for _ in range(300):
        content = bytearray(library)
        for _ in range(4):
            content[rng.randrange(1024)] = rng.randrange(256)
        try:
            outcomes.add(type(pe.read_library(bytes(content), "x86_64")))
        except InvalidLibraryError:
            outcomes.add(InvalidLibraryError)
    assert len(outcomes) == 2
