"""Reader of macOS libraries, tested on any platform with the libraries in FMPy."""

import random
import struct
from pathlib import Path

import fmpy
import pytest
from bad_fmus import members, pack_archive

from cosim.components.fmi.preflight import examine, macho
from cosim.components.fmi.preflight.archive import Archive, open_regular_file
from cosim.components.fmi.preflight.binary import check_binary
from cosim.components.fmi.preflight.c_functions import standard_functions
from cosim.components.fmi.preflight.platforms import FmuPlatform, InvalidLibraryError, SharedLibrary

FMPY = Path(fmpy.__file__).parent
MACHINES = {"aarch64": "x86_64", "x86_64": "aarch64"}


@pytest.fixture(scope="module", params=sorted(MACHINES))
def architecture(request):
    return request.param


def container(architecture):
    """Return the library of an FMU for one architecture."""
    return (FMPY / f"container_fmu/binaries/{architecture}-darwin/container_fmu.dylib").read_bytes()


@pytest.fixture
def library(architecture):
    return container(architecture)


def without_commands(library, kinds):
    """Return the library with the given load commands replaced by unknown ones."""
    content, place = bytearray(library), 32
    for _ in range(struct.unpack_from("<L", library, 16)[0]):
        command, size = struct.unpack_from("<2L", library, place)
        if command in kinds:
            struct.pack_into("<L", content, place, 0x7F)
        place += size
    return bytes(content)


def patched(offset, form, value):
    def change(library):
        content = bytearray(library)
        struct.pack_into(form, content, offset, value)
        return bytes(content)

    return change


def universal_library():
    """Return a universal file with the libraries of both architectures."""
    parts = [container(architecture) for architecture in sorted(MACHINES)]
    offsets = [4096, 4096 + len(parts[0])]
    entries = zip((macho.MACHINES[a] for a in sorted(MACHINES)), offsets, parts, strict=True)
    head = b"\xca\xfe\xba\xbe" + struct.pack(">L", 2)
    head += b"".join(
        struct.pack(">5L", machine, 0, offset, len(part), 12) for machine, offset, part in entries
    )
    return head.ljust(4096, b"\0") + parts[0] + parts[1]


def test_a_real_library_exports_the_functions_of_fmi(library, architecture):
    exports = macho.read_library(library, architecture).exports
    assert (
        standard_functions(2, "co-simulation") | standard_functions(3, "co-simulation") <= exports
    )


def test_symbol_table_and_export_trie_agree(library, architecture):
    """The linker writes both tables of a library."""
    symbols = macho.read_library(
        without_commands(library, macho._EXPORT_TRIE_COMMANDS), architecture
    ).exports
    tree = macho.read_library(without_commands(library, {macho._LC_SYMTAB}), architecture).exports
    assert symbols == tree == macho.read_library(library, architecture).exports


def test_the_part_for_the_architecture_is_read_from_a_universal_library(library, architecture):
    assert macho.read_library(universal_library(), architecture) == macho.read_library(
        library, architecture
    )
    real = (FMPY / "logging/darwin64/logging.dylib").read_bytes()
    assert macho.read_library(real, architecture).exports == {"addLoggerProxy"}


def test_a_missing_function_is_named(library, architecture):
    changed = without_commands(library, macho._EXPORT_TRIE_COMMANDS).replace(
        b"_fmi2DoStep\0", b"_fmi2DoSteq\0"
    )
    assert standard_functions(2, "co-simulation") - macho.read_library(
        changed, architecture
    ).exports == {"fmi2DoStep"}


DAMAGED = {
    "empty": (lambda _: b"", "is not a macOS library"),
    "ELF": (lambda library: b"\x7fELF" + library[4:], "is not a macOS library"),
    "only a magic number": (
        lambda library: library[:4],
        "is truncated: it refers to byte 4, but has 4",
    ),
    "cut": (lambda library: library[: len(library) // 2], "is truncated: a segment ends at byte"),
    "32 bit": (lambda library: b"\xce\xfa\xed\xfe" + library[4:], "is built for 32 bit"),
    "unknown machine": (patched(4, "<L", 99), "is built for machine 0x63"),
    "program": (patched(12, "<L", 2), "is of type 2, expected a dynamic library"),
    "object file": (patched(12, "<L", 1), "is of type 1"),
    "command of no size": (patched(36, "<L", 0), "has damaged load commands"),
    "command beyond": (patched(36, "<L", 2**31), "has damaged load commands"),
    "more commands": (patched(16, "<L", 10**6), "has damaged load commands"),
    "universal, cut": (lambda _: universal_library()[:9000], "is truncated: the part for"),
    "universal, for nobody": (
        lambda _: universal_library()[:4] + bytes(8),
        "is built for no architecture",
    ),
    "universal, countless": (
        lambda _: universal_library()[:4] + b"\xff" * 4,
        "claims 4294967295 architectures",
    ),
}


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_libraries_are_refused(case, library, architecture):
    change, words = DAMAGED[case]
    with pytest.raises(InvalidLibraryError, match=words):
        macho.read_library(change(library), architecture)


def test_another_architecture_is_refused(library, architecture):
    other = MACHINES[architecture]
    with pytest.raises(
        InvalidLibraryError, match=f"is built for {architecture}; this machine is {other}"
    ):
        macho.read_library(library, other)


@pytest.mark.parametrize("content", [b"\xcf\xfa\xed\xfe", None], ids=["damaged", "good"])
def test_an_fmu_is_checked_for_macos(content, good, tmp_path, library, architecture):
    """The content of the library decides, not its name."""
    machine = FmuPlatform("darwin", architecture, ".dylib")
    files = {
        "modelDescription.xml": good[2]["modelDescription.xml"],
        "binaries/darwin64/probe.dylib": content or library,
    }
    path = tmp_path / "mac.fmu"
    path.write_bytes(pack_archive(members(files)))
    with open_regular_file(path) as file:
        findings = list(
            check_binary(
                Archive(file),
                examine(path).model,
                "co-simulation",
                machine,
            )
        )
    assert [finding.rule for finding in findings] == (["binary.format"] if content else [])


def test_mutants_are_read_or_refused(library, architecture):
    rng = random.Random(1)  # noqa: S311 - seeded for reproducible mutants
    outcomes = set()
    for _ in range(300):
        content = bytearray(library)
        for _ in range(4):
            content[rng.randrange(4096)] = rng.randrange(256)
        try:
            outcomes.add(type(macho.read_library(bytes(content), architecture)))
        except InvalidLibraryError as error:
            outcomes.add(
                InvalidLibraryError if str(error).startswith(("is ", "has ")) else str(error)
            )
    assert outcomes == {SharedLibrary, InvalidLibraryError}
