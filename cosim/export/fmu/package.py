"""Packaging of a block as an FMU.

Sources, model description, binary and resources in one archive.
"""

from collections.abc import Iterable, Mapping, Sequence
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from ...core.errors import InputError
from ...results.files import writing_atomically
from .block import Block
from .compiler import compile_library
from .description_xml import build_description_xml, model_description_xml
from .variable_table import c_variable_table, check_block

SHELL_FOLDER = Path(__file__).parents[1] / "shell"
_SHELL_FILES = {2: ("fmi2.c", "common.h", "export.h"), 3: ("fmi3.c", "common.h", "export.h")}
_EXCHANGE_FILES = {2: ("exchange.h", "exchange2.h"), 3: ("exchange.h", "exchange3.h")}
_FMI_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}


def write_fmu(block: Block, fmi_version: int, target: Path) -> Path:
    """Write the FMU of a block, for Co-Simulation and possibly for Model Exchange.

    The same block and compiler give the same bytes.

    Args:
        block: The block.
        fmi_version: 2 or 3.
        target: The FMU to write.

    Returns:
        `target`.

    Raises:
        InputError: The block or its C code is faulty, or there is no C compiler.
    """
    if fmi_version not in _SHELL_FILES:
        raise InputError(f"found FMI version {fmi_version}, expected 2 or 3")
    check_block(block)
    files = _description_and_sources(block, fmi_version)
    files |= {f"resources/{name}": path.read_bytes() for name, path in block.resources.items()}
    sources = {
        name.removeprefix("sources/"): text
        for name, text in files.items()
        if name.startswith("sources/")
    }
    files |= compile_binary(
        block.identifier, fmi_version, sources, [*_c_files(sources), *block.archives]
    )
    return write_archive(files, target)


def _description_and_sources(block: Block, fmi_version: int) -> dict[str, bytes]:
    """Return model description and sources; their instantiation token is a hash of both."""
    sources = {name: text.encode() for name, text in block.files.items()}
    sources |= {name: path.read_bytes() for name, path in block.archives.items()}
    shell = _SHELL_FILES[fmi_version] + (_EXCHANGE_FILES[fmi_version] if block.exchange else ())
    sources |= {name: (SHELL_FOLDER / name).read_bytes() for name in shell}
    sources |= fmi_headers(fmi_version)
    sources["variables.h"] = c_variable_table(block, fmi_version).encode()
    c_files = _c_files(sources)
    token = content_token(
        [
            model_description_xml(block, fmi_version, "", c_files),
            *(sources[name] for name in sorted(sources)),
        ]
    )
    sources["variables.h"] += f'\n#define TOKEN "{token}"\n'.encode()
    if fmi_version == 3:
        sources["buildDescription.xml"] = build_description_xml(block, c_files)
    description = model_description_xml(block, fmi_version, token, c_files)
    return {"modelDescription.xml": description} | {
        f"sources/{name}": text for name, text in sources.items()
    }


def fmi_headers(fmi_version: int) -> dict[str, bytes]:
    """Return the C headers of the FMI standard (name -> contents).

    Raises:
        InputError: FMPy, which contains the headers, is not installed.
    """
    fmpy = find_spec("fmpy")
    if fmpy is None or fmpy.origin is None:
        raise InputError(
            "export needs the FMI headers of FMPy, which is not installed: pip install "
            '"fmi-cosim[build]"'
        )
    folder = Path(fmpy.origin).parent / "c-code"
    return {name: (folder / name).read_bytes() for name in _FMI_HEADERS[fmi_version]}


def _c_files(sources: Mapping[str, bytes]) -> list[str]:
    return sorted(name for name in sources if name.endswith(".c"))


def compile_binary(
    identifier: str, fmi_version: int, sources: Mapping[str, bytes], c_files: Sequence[str]
) -> dict[str, bytes]:
    """Compile the shared library of an FMU for this platform.

    Args:
        identifier: The model identifier.
        fmi_version: 2 or 3; determines the folder of the binary in the FMU.
        sources: Name -> contents of the C files and headers.
        c_files: Names of the C files to compile, and of static libraries.

    Returns:
        The path of the library in the FMU -> its contents.

    Raises:
        InputError: There is no compiler, or it reports errors.
    """
    from fmpy import platform, platform_tuple, sharedLibraryExtension

    name = f"{identifier}{sharedLibraryExtension}"
    with TemporaryDirectory(prefix="cosim-build-") as temporary:
        folder = Path(temporary)
        for source, text in sources.items():
            (folder / source).write_bytes(text)
        compile_library(folder, c_files, folder / name)
        return {
            f"binaries/{platform if fmi_version == 2 else platform_tuple}/{name}": (
                folder / name
            ).read_bytes()
        }


_DATE = (1980, 1, 1, 0, 0, 0)
_UNIX, _REGULAR_FILE = 3, 0o100644 << 16


def write_archive(files: Mapping[str, bytes], target: Path) -> Path:
    """Write an FMU archive atomically.

    Args:
        files: Name inside the archive -> contents. The members are written in the order of their
            names.
        target: The file to write; its folder is created.

    Returns:
        `target`.

    Raises:
        InputError: The path cannot be written.
        OutputError: The disk is full or defective.
    """
    with writing_atomically(target) as temporary, ZipFile(temporary, "w") as archive:
        for name in sorted(files):
            member = ZipInfo(name, _DATE)
            member.create_system = _UNIX
            member.external_attr = _REGULAR_FILE
            member.compress_type = ZIP_DEFLATED
            archive.writestr(member, files[name])
    return target


def content_token(parts: Iterable[bytes]) -> str:
    """Return the GUID (FMI 2.0) or instantiation token (FMI 3.0) of an FMU.

    A hash of its contents.
    """
    digest = sha256(b"\0".join(parts)).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"
