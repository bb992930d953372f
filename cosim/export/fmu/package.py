"""Block -> .fmu: sources, description, binary and resources in one archive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from ...core.errors import InputError
from .archive import content_token, write_archive
from .block import Block
from .compiler import compile_library
from .interface import c_variable_table, check_block
from .model_description import build_description_xml, model_description_xml

SHELL_FOLDER = Path(__file__).parents[1] / "shell"
_SHELL_FILES = {2: ("fmi2.c", "common.h", "export.h"), 3: ("fmi3.c", "common.h", "export.h")}
_FMI_HEADERS = {
    2: ("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
    3: ("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
}


def write_fmu(block: Block, fmi_version: int, target: Path) -> Path:
    """Write the Co-Simulation FMU of a block for FMI 2.0 or 3.0 (`fmi_version` 2 or 3) to `target`.

    The same block and compiler give the same bytes. Raises InputError when the block or its C code is faulty, or there is
    no C compiler.
    """
    if fmi_version not in _SHELL_FILES:
        raise InputError(f"found FMI version {fmi_version}, expected 2 or 3")
    check_block(block)
    files = _description_and_sources(block, fmi_version)
    files |= {f"resources/{name}": path.read_bytes() for name, path in block.resources.items()}
    sources = {name.removeprefix("sources/"): text for name, text in files.items() if name.startswith("sources/")}
    files |= compile_binary(block.identifier, fmi_version, sources, _c_files(sources))
    return write_archive(files, target)


def _description_and_sources(block: Block, fmi_version: int) -> dict[str, bytes]:
    """Description and sources; the token that ties them together is a hash of both."""
    sources = _collect_sources(block, fmi_version)
    c_files = _c_files(sources)
    token = content_token([model_description_xml(block, fmi_version, "", c_files), *(sources[name] for name in sorted(sources))])
    sources["variables.h"] += f'\n#define TOKEN "{token}"\n'.encode()
    if fmi_version == 3:
        sources["buildDescription.xml"] = build_description_xml(block, c_files)
    description = model_description_xml(block, fmi_version, token, c_files)
    return {"modelDescription.xml": description} | {f"sources/{name}": text for name, text in sources.items()}


def _collect_sources(block: Block, fmi_version: int) -> dict[str, bytes]:
    """All that is needed to compile the FMU anywhere, FMI's own headers included."""
    sources = {name: text.encode() for name, text in block.files.items()}
    sources |= {name: (SHELL_FOLDER / name).read_bytes() for name in _SHELL_FILES[fmi_version]}
    sources |= fmi_headers(fmi_version)
    sources["variables.h"] = c_variable_table(block, fmi_version).encode()
    return sources


def fmi_headers(fmi_version: int) -> dict[str, bytes]:
    """FMI's own C headers, by name."""
    fmpy = find_spec("fmpy")
    if fmpy is None or fmpy.origin is None:
        raise InputError('exporting takes the FMI headers from FMPy, which is missing: pip install "fmi-cosim[build]"')
    folder = Path(fmpy.origin).parent / "c-code"
    return {name: (folder / name).read_bytes() for name in _FMI_HEADERS[fmi_version]}


def _c_files(sources: Mapping[str, bytes]) -> list[str]:
    return sorted(name for name in sources if name.endswith(".c"))


def compile_binary(identifier: str, fmi_version: int, sources: Mapping[str, bytes], c_files: Sequence[str]) -> dict[str, bytes]:
    """The shared library of `c_files` for this machine, under its name in the FMU; `sources` holds them and their headers."""
    from fmpy import platform, platform_tuple, sharedLibraryExtension

    name = f"{identifier}{sharedLibraryExtension}"
    with TemporaryDirectory(prefix="cosim-build-") as temporary:
        folder = Path(temporary)
        for source, text in sources.items():
            (folder / source).write_bytes(text)
        compile_library(folder, c_files, folder / name)
        return {f"binaries/{platform if fmi_version == 2 else platform_tuple}/{name}": (folder / name).read_bytes()}
