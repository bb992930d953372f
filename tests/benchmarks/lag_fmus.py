"""The FMUs of the benchmarks: near-empty first-order lags (programs/lag.h), the same for every
importer and the C limit.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

from cosim.export.fmu.block import Block, BlockVariable
from cosim.export.fmu.description_xml import model_description_xml, to_bytes
from cosim.export.fmu.package import compile_binary, content_token, fmi_headers, write_archive

PROGRAMS = Path(__file__).parent / "programs"


def lag_fmu(folder: Path, fmi_version: int = 2, width: int = 1) -> Path:
    """Build an FMU of `width` independent lags with inputs u1, u2, ... and outputs y1, y2, ...

    Raises InputError if there is no C compiler.
    """
    identifier = f"Lag{width}"
    source = f"lag{fmi_version}.c"
    sources = fmi_headers(fmi_version) | {
        name: (PROGRAMS / name).read_bytes() for name in (source, "lag.h")
    }
    sources["width.c"] = f'#define WIDTH {width}\n#include "{source}"\n'.encode()
    numbers = range(1, width + 1)
    variables = [
        *(_variable(f"u{i}", "input") for i in numbers),
        *(_variable(f"y{i}", "output") for i in numbers),
    ]
    block = Block(identifier, "a benchmark", variables, 0.01, {})
    token = content_token(sources[name] for name in sorted(sources))
    files = {
        "modelDescription.xml": _without_dependencies(
            model_description_xml(block, fmi_version, token, ["width.c"])
        )
    }
    files |= compile_binary(identifier, fmi_version, sources, ["width.c"])
    return write_archive(files, folder / f"{identifier}_fmi{fmi_version}.fmu")


def _variable(name: str, causality: Literal["input", "output"]) -> BlockVariable:
    return BlockVariable(name, name, "Float64", causality, "continuous", 0.0)


def _without_dependencies(description: bytes) -> bytes:
    """Declare that no output has direct feedthrough; some importers require this declaration."""
    root = ElementTree.fromstring(description)  # noqa: S314 - written by lag_fmu
    for unknown in (*root.iter("Unknown"), *root.iter("Output"), *root.iter("InitialUnknown")):
        unknown.set("dependencies", "")
    return to_bytes(root)
