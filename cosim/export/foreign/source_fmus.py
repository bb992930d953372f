"""FMUs that contain sources but no binary for this machine.

They are compiled when they are used, into the user's cache (see `add_binary`).
"""

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory
from typing import Any

from ...components.fmi import FmuFile
from ...components.fmi.preflight.findings import DESCRIPTION_FILE, FatalFindingError
from ...components.fmi.preflight.platforms import current_platform
from ...components.fmi.preflight.xml import parse_xml
from ...core.errors import InputError, did_you_mean
from ..cache import cached_file
from ..fmu.compiler import compiler_version, find_compiler
from ..fmu.package import write_archive

_SOURCES, _BUILD_DESCRIPTION = "sources/", "sources/buildDescription.xml"
_C_SUFFIX, _CPP_SUFFIXES = ".c", (".cpp", ".cc", ".cxx")
#: the FMU's own names of the FMI functions have no prefix; some tools add one unless these macros
#: are defined
_NO_PREFIX = (
    "-DFMI2_FUNCTION_PREFIX=",
    "-DFMI2_OVERRIDE_FUNCTION_PREFIX",
    "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
)
_OPTIONS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off", "-w", *_NO_PREFIX)
#: raised when an FMU has to be compiled again
_RECIPE = 2
#: headers of Windows that portable sources include (FMU SDK 2.0.4)
_WINDOWS_HEADERS = {
    "minmax.h": (
        "#define max(a, b) ((a) > (b) ? (a) : (b))\n#define min(a, b) ((a) < (b) ? (a) : (b))\n"
    )
}
#: headers of FMI 1.0, which FMPy does not contain
_FMI1_HEADERS = ("fmiFunctions.h", "fmiModelFunctions.h", "fmiPlatformTypes.h", "fmiModelTypes.h")
#: words of the compiler's lines that state a cause
_ERROR = re.compile("[eE]rror:|undefined reference|multiple definition|syntax error")


@dataclass(frozen=True, slots=True)
class _Configuration:
    """One library: files and folders below `sources/`, and definitions of the preprocessor."""

    identifier: str
    files: Sequence[str]
    include_folders: Sequence[str] = ()
    definitions: Sequence[str] = ()


def compiled_fmu(file: FmuFile) -> Path:
    """Return a copy of an FMU with the binaries for this machine, compiled from its sources.

    Args:
        file: An FMU with sources.

    Raises:
        InputError: There is no C compiler, the sources are incomplete, or they cannot be compiled.
    """
    compiler = find_compiler()
    recipe = json.dumps(
        [file.sha256, compiler, compiler_version(tuple(compiler)), _OPTIONS, _RECIPE]
    )
    return cached_file(
        sha256(recipe.encode()).hexdigest()[:24],
        file.path.name,
        lambda target: _compile(file, compiler, target),
    )


def _compile(file: FmuFile, compiler: Sequence[str], target: Path) -> None:
    members = file.read_members()
    machine = current_platform()
    with TemporaryDirectory() as folder:
        for name, content in members.items():
            if name.startswith(_SOURCES):
                path = Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
        fmi1_header = Path(__file__).with_name("fmi1.h").read_text()
        for name, text in {**_WINDOWS_HEADERS, **dict.fromkeys(_FMI1_HEADERS, fmi1_header)}.items():
            Path(folder, name).write_text(text)
        for configuration in _read_configurations(file, members):
            library = Path(folder, f"{configuration.identifier}{machine.suffix}")
            _compile_library(file, compiler, configuration, Path(folder, _SOURCES), library)
            binary = f"binaries/{machine.binary_folder(file.description.major)}/{library.name}"
            members[binary] = library.read_bytes()
    write_archive(members, target)


def _compile_library(
    file: FmuFile,
    compiler: Sequence[str],
    configuration: _Configuration,
    sources: Path,
    library: Path,
) -> None:
    command = list(compiler)
    if any(name.endswith(_CPP_SUFFIXES) for name in configuration.files):
        command = (
            [*compiler[:-2], "c++"]
            if "ziglang" in compiler
            else [shutil.which("c++") or shutil.which("g++") or "c++"]
        )
    fmpy = find_spec("fmpy")
    headers = Path(fmpy.origin).parent / "c-code" if fmpy and fmpy.origin else sources
    folders = [
        *(sources / name for name in ("", *configuration.include_folders)),
        headers,
        sources.parent,
    ]
    options = [
        *_OPTIONS,
        *(f"-D{text}" for text in configuration.definitions),
        *(f"-I{folder}" for folder in folders),
    ]
    linker_options = ["-Wl,--no-undefined"] if sys.platform == "linux" else []
    files = [str(sources / name) for name in configuration.files]  # absolute: no name is an option
    process = subprocess.run(  # noqa: S603 - the compiler of the user
        [*command, *options, *linker_options, "-o", str(library), *files, "-lm"],
        cwd=sources,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if process.returncode:
        lines = [line.replace(f"{sources}/", "") for line in process.stderr.splitlines()]
        errors = [line for line in lines if _ERROR.search(line) and "ld returned" not in line]
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise InputError(
            f'the sources of "{file.path}" cannot be compiled: '
            f"{(errors or lines[-1:] or ['no reason'])[0]}{more}"
        )


def _read_configurations(file: FmuFile, members: Mapping[str, bytes]) -> list[_Configuration]:
    """Return the libraries of an FMU, one for each model identifier.

    Raises:
        InputError: A source file does not exist, or there is none.
    """
    if _BUILD_DESCRIPTION in members:
        configurations = list(_read_build_description(_parse(file, members, _BUILD_DESCRIPTION)))
    else:
        configurations = list(_read_source_files(_parse(file, members, DESCRIPTION_FILE), members))
    sources = {name.removeprefix(_SOURCES) for name in members if name.startswith(_SOURCES)}
    for configuration in configurations:
        for name in configuration.files:
            if name not in sources:
                text = (
                    f'"{file.path}": its source file "{name}" does not '
                    f"exist{did_you_mean(name, sources)}"
                )
                raise InputError(text)
        if not configuration.files:
            others = sorted({PurePosixPath(name).suffix for name in sources} - {""})
            raise InputError(
                f'"{file.path}": names no source files, and found no C files; found: '
                f"{', '.join(others)}"
            )
    return configurations


def _parse(file: FmuFile, members: Mapping[str, bytes], name: str) -> Any:
    """Return the root element of an XML file, which must be safe to parse."""
    try:
        return parse_xml(members[name], name)
    except FatalFindingError as error:
        raise InputError(f'"{file.path}": {error.finding}') from None


def _read_build_description(root: Any) -> Iterator[_Configuration]:
    """Read the build configurations for all platforms or for this one (FMI 3.0.2 section 2.5.2)."""
    for element in root.iterfind("BuildConfiguration"):
        if (
            element.get("platform", current_platform().platform_tuple)
            != current_platform().platform_tuple
        ):
            continue
        yield _Configuration(
            element.get("modelIdentifier", ""),
            [item.get("name", "") for item in element.iterfind("SourceFileSet/SourceFile")],
            [item.get("name", "") for item in element.iterfind("SourceFileSet/IncludeDirectory")],
            [
                f"{item.get('name')}={item.get('value', '')}"
                for item in element.iterfind("SourceFileSet/PreprocessorDefinition")
                if item.get("optional") != "true"
            ],
        )


def _read_source_files(root: Any, members: Mapping[str, bytes]) -> Iterator[_Configuration]:
    """Read the source files of FMI 2.0.

    Without a list, as in FMI 1.0, these are all C files that no other one includes.
    """
    if root.get("fmiVersion", "").startswith("1"):
        definitions = () if root.find("Implementation") is None else ("FMI_COSIMULATION",)
        yield _Configuration(
            root.get("modelIdentifier", ""), _independent_files(members), (), definitions
        )
        return
    found: dict[str, list[str]] = {}
    for interface in (*root.iterfind("CoSimulation"), *root.iterfind("ModelExchange")):
        names = [item.get("name", "") for item in interface.iterfind("SourceFiles/File")]
        found.setdefault(interface.get("modelIdentifier", ""), []).extend(names)
    for identifier, names in found.items():
        compiled = [
            name for name in dict.fromkeys(names) if name.endswith((_C_SUFFIX, *_CPP_SUFFIXES))
        ]
        definitions = (
            () if root.find("ModelExchange") is not None else ("FMI_COSIMULATION",)
        )  # macro of the FMU SDK
        yield _Configuration(identifier, compiled or _independent_files(members), (), definitions)


def _independent_files(members: Mapping[str, bytes]) -> list[str]:
    files = {
        name.removeprefix(_SOURCES): text
        for name, text in members.items()
        if PurePosixPath(name).parent == PurePosixPath(_SOURCES) and name.endswith(_C_SUFFIX)
    }
    texts = b"\n".join(files.values())
    return [name for name in sorted(files) if f'#include "{name}"'.encode() not in texts]
