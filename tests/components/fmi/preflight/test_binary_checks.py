"""Libraries that this platform cannot load are reported before they reach the loader."""

import shutil
import struct
import subprocess
import sys

import fmpy
import pytest
from bad_fmus import find_problems, members, pack_archive, refusal_message
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave

from cosim.components.fmi import FmuFile
from cosim.components.fmi.preflight import elf
from cosim.components.fmi.preflight.c_functions import standard_functions
from cosim.components.fmi.preflight.platforms import FmuPlatform, current_platform
from cosim.core import resources
from cosim.export.fmu.compiler import find_compiler

LIBRARY = f"binaries/{fmpy.platform}/probe.so"
FMUS = sorted(resources.root().glob("fmus/**/*.fmu"))
linux = pytest.mark.skipif(
    sys.platform != "linux" or struct.calcsize("P") != 8, reason="needs 64-bit ELF libraries"
)
pytestmark = linux


def patched(offset, form, value):
    """The library with a number in its header replaced."""

    def change(library):
        content = bytearray(library)
        struct.pack_into(form, content, offset, value)
        return bytes(content)

    return change


def segment(kind, field, value):
    """The library with a field of its first program header of a kind replaced."""

    def change(library):
        table, size, count = (
            struct.unpack_from("<Q", library, 32)[0],
            56,
            struct.unpack_from("<H", library, 56)[0],
        )
        place = next(
            table + i * size
            for i in range(count)
            if struct.unpack_from("<L", library, table + i * size)[0] == kind
        )
        return patched(place + field, "<Q", value)(library)

    return change


def renamed(library):
    """A library that exports a misspelt function."""
    return library.replace(b"fmi2DoStep\0", b"fmi2DoSteq\0")


DAMAGED = {
    "empty": (lambda _: b"", "is not an ELF file"),
    "text": (lambda _: b"hello", "is not an ELF file"),
    "Windows": (lambda library: b"MZ" + library[2:], "is not an ELF file"),
    "cut in the header": (lambda library: library[:40], "is truncated: its header is incomplete"),
    "cut in the middle": (lambda library: library[: len(library) // 2], "is truncated: "),
    "cut after the header": (lambda library: library[:64], "is truncated: "),
    "ARM": (patched(18, "<H", 40), "is built for ARM, 64 bit, little-endian; this machine is"),
    "aarch64": (patched(18, "<H", 183), "is built for aarch64, 64 bit"),
    "unknown machine": (patched(18, "<H", 9999), "is built for machine 9999"),
    "32 bit": (patched(4, "<B", 1), "is built for x86_64, 32 bit"),
    "big-endian": (patched(5, "<B", 2), "64 bit, big-endian"),
    "bad class": (patched(4, "<B", 7), "has a damaged ELF header"),
    "executable": (patched(16, "<H", 2), "type 2, expected a shared library"),
    "object file": (patched(16, "<H", 1), "type 1, expected a shared library"),
    "no segments": (patched(56, "<H", 0), "has no segments to load"),
    "segments beyond": (patched(32, "<Q", 1 << 40), "is truncated: it refers to byte"),
    "segment too long": (segment(1, 32, 1 << 40), "is truncated: a segment ends at byte"),
    "dynamic table beyond": (segment(2, 8, 1 << 40), "is truncated: a segment ends at byte"),
    "dynamic table elsewhere": (segment(2, 8, 0), "has no symbol table"),
}


def compiled(folder, name, code, *options):
    """A shared library made of C code."""
    (folder / f"{name}.c").write_text(code)
    library = folder / f"{name}.so"
    subprocess.run(
        [*find_compiler(), "-shared", "-fPIC", folder / f"{name}.c", *options, "-o", library],
        check=True,
    )
    return library


@pytest.fixture
def fmu(good, tmp_path):
    """Function that writes the valid FMU with another library, or with the library under another
    name.
    """

    def make(library, name=LIBRARY):
        path = tmp_path / "bad.fmu"
        files = {"modelDescription.xml": good[2]["modelDescription.xml"], name: library}
        path.write_bytes(pack_archive(members(files)))
        return path

    return make


@pytest.mark.parametrize("case", DAMAGED)
def test_damaged_and_foreign_libraries_are_refused(case, good, fmu):
    change, words = DAMAGED[case]
    path = fmu(change(good[2][LIBRARY]))
    assert f'"{path}": {LIBRARY}: the library cannot be loaded: it ' in refusal_message(path)
    assert [(f.rule, words in f.message) for f in find_problems(path)] == [("binary.format", True)]


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3, 0.6, 0.9])
def test_a_cut_library_never_reaches_the_loader(share, good, fmu):
    library = good[2][LIBRARY]
    findings = find_problems(fmu(library[: int(share * len(library))]))
    assert {f.rule for f in findings} <= {"binary.format", "binary.functions"}
    assert findings or share == 0.9


def test_a_missing_function_is_named(good, fmu):
    path = fmu(renamed(good[2][LIBRARY]))
    assert "the library does not export fmi2DoStep [binary.functions" in refusal_message(path)


def test_many_missing_functions_are_counted(fmu, tmp_path):
    text = refusal_message(
        fmu(compiled(tmp_path, "empty", "int unrelated(void) { return 0; }\n").read_bytes())
    )
    assert "does not export fmi2DoStep, " in text
    assert "and 13 more [binary.functions" in text


def test_hidden_and_undefined_functions_do_not_count(tmp_path):
    source = (
        '__attribute__((visibility("hidden"))) int a(void){return 0;} extern int b(void); int '
        "c(void){return b();} static int d;"
    )
    for style in ("gnu", "sysv", "both"):
        library = compiled(
            tmp_path, style, source + "int *e(void){return &d;}", f"-Wl,--hash-style={style}"
        )
        assert {"a", "b", "c", "d", "e"} & elf.read_library(
            library.read_bytes(), current_platform().architecture
        ).exports == {
            "c",
            "e",
        }


@pytest.mark.parametrize("path", FMUS, ids=lambda path: str(path.relative_to(resources.root())))
def test_exports_are_those_listed_by_nm(path):
    """The reference is `nm` of binutils."""
    file = FmuFile(path)
    folder = file.acquire()
    (library,) = (folder / "binaries").glob(f"*linux*/{file.description.model_identifier}.so")
    listed = subprocess.run(
        [shutil.which("nm"), "-D", "--defined-only", library],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    names = {row.split()[-1].partition("@")[0] for row in listed.splitlines()}
    assert elf.read_library(library.read_bytes(), current_platform().architecture).exports == names
    file.release()


FMPY_CLASSES = [
    (2, "co-simulation", FMU2Slave),
    (2, "model-exchange", FMU2Model),
    (3, "co-simulation", FMU3Slave),
    (3, "model-exchange", FMU3Model),
]


@pytest.mark.parametrize(("version", "interface", "fmpy_class"), FMPY_CLASSES)
def test_the_standard_functions_are_those_of_fmpy(version, interface, fmpy_class):
    assert {
        name for name in dir(fmpy_class) if name.startswith(f"fmi{version}")
    } == standard_functions(version, interface)


def test_a_missing_dependency_is_a_warning(fmu, tmp_path):
    compiled(tmp_path, "libnowhere", "int other(void) { return 1; }\n")
    user = compiled(
        tmp_path,
        "user",
        "extern int other(void); int use(void) { return other(); }\n",
        f"-L{tmp_path}",
        "-lnowhere",
    )
    findings = find_problems(fmu(user.read_bytes()))
    assert [(f.rule, f.severity) for f in findings] == [
        ("binary.functions", "error"),
        ("binary.unused-functions", "warning"),
        ("binary.needed", "warning"),
    ]
    assert (
        "needs the library libnowhere.so, which was not found on this machine"
        in next(f for f in findings if f.rule == "binary.needed").message
    )


WRONG_VERSIONS = {
    "other version": (
        2,
        b"\0002.0\0",
        b"\0001.0\0",
        'fmi2GetVersion returns "1.0", expected "2.0"',
    ),
    "later version": (
        2,
        b"\0002.0\0",
        b"\0002.1\0",
        'fmi2GetVersion returns "2.1", expected "2.0"',
    ),
    "control character": (
        2,
        b"\0002.0\0",
        b"\0002\x1b0\0",
        'fmi2GetVersion returns "2\\x1b0", expected "2.0"',
    ),
    "no version": (2, b"\0002.0\0", b"\0\0.0\0", 'fmi2GetVersion returns "", expected "2.0"'),
    "other platform": (
        2,
        b"default\0",
        b"Default\0",
        'fmi2GetTypesPlatform returns "Default", expected "default"',
    ),
    "standard of 1.0": (
        2,
        b"default\0",
        b"std\0\0\0\0\0",
        'fmi2GetTypesPlatform returns "std", expected "default"',
    ),
    "version 2": (3, b"\0003.0\0", b"\0002.0\0", 'fmi3GetVersion returns "2.0", expected "3.0"'),
    "a draft": (3, b"\0003.0\0", b"\0003.b\0", 'fmi3GetVersion returns "3.b", expected "3.0"'),
}


@pytest.mark.parametrize("case", WRONG_VERSIONS)
def test_a_wrong_version_or_platform_is_a_warning(case, good, tmp_path):
    version, old, new, message = WRONG_VERSIONS[case]
    files = good[version]
    member = next(name for name in files if name.endswith(".so"))
    assert old in files[member]
    path = tmp_path / "old.fmu"
    path.write_bytes(pack_archive(members({**files, member: files[member].replace(old, new)})))
    found = [(f.rule, f.severity, f.member, f.message) for f in find_problems(path)]
    assert found == [("binary.version", "warning", member, message)]


@pytest.mark.parametrize("option", ["-O0", "-O1", "-O3", "-Os", "-fcf-protection=none"])
def test_texts_are_read_from_functions_that_only_return_them(tmp_path, option):
    source = """const char *fmi2GetVersion(void) { return "2.0"; } char text[] = "later";
    const char *fmi3GetVersion(void) { text[0] = 'L'; return text; }
    int other(void) { return 1; }"""
    library = elf.read_library(compiled(tmp_path, "texts", source, option).read_bytes(), "x86_64")
    assert library.constant_texts == {"fmi2GetVersion": b"2.0"}


def test_another_platform_is_reported_with_the_existing_ones(fmu):
    path = fmu(b"MZ", "binaries/win32/probe.dll")
    this = current_platform()
    expected = (
        f"has no binary for {this.platform_tuple} ({this.fmi2_platform}); it has: win32; 32-bit "
        "libraries for Windows cannot"
    )
    assert expected in refusal_message(path)
    assert FmuFile(path).description.platforms == ["win32"]


@pytest.mark.skipif(
    current_platform().platform_tuple != "x86_64-linux",
    reason="Windows libraries run under Wine on Linux only",
)
def test_a_library_for_windows_is_a_warning(fmu):
    problems = find_problems(fmu(b"MZ", "binaries/win64/probe.dll"))
    assert [(f.rule, f.severity) for f in problems] == [("binary.windows-only", "warning")]


def test_sources_alone_are_compiled_when_the_fmu_is_used(fmu):
    path = fmu(b"int x;", "sources/model.c")
    assert FmuFile(path).must_be_compiled
    assert [(f.rule, f.severity) for f in find_problems(path)] == [
        ("binary.sources-only", "warning")
    ]


def test_the_library_must_have_the_name_of_the_model_identifier(good, fmu):
    path = fmu(good[2][LIBRARY], LIBRARY.replace("probe", "other"))
    words = (
        f"the library cannot be loaded: {LIBRARY} does not exist; found: "
        f"{LIBRARY.replace('probe', 'other')}"
    )
    assert words in refusal_message(path)


def test_the_platform_names_are_those_of_fmpy():
    assert (current_platform().fmi2_platform, current_platform().platform_tuple) == (
        fmpy.platform,
        fmpy.platform_tuple,
    )
    assert current_platform().suffix == fmpy.sharedLibraryExtension


@pytest.mark.parametrize(
    ("machine", "names"),
    [
        (FmuPlatform("windows", "x86_64", ".dll"), ("win64", "x86_64-windows")),
        (FmuPlatform("windows", "x86", ".dll"), ("win32", "x86-windows")),
        (FmuPlatform("darwin", "aarch64", ".dylib"), ("darwin64", "aarch64-darwin")),
        (FmuPlatform("linux", "x86", ".so"), ("linux32", "x86-linux")),
    ],
)
def test_other_platforms_have_the_names_of_the_standard(machine, names):
    assert (machine.binary_folder(2), machine.binary_folder(3)) == names
