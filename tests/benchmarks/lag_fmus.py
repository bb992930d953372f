"""The FMUs of the benchmarks: near-empty lags (programs/lag.h), alike for every importer and for the C limit."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from cosim.export.fmu.archive import content_token, write_archive
from cosim.export.fmu.block import Block, BlockVariable
from cosim.export.fmu.model_description import model_description_xml, to_bytes
from cosim.export.fmu.package import compile_binary, fmi_headers

PROGRAMS = Path(__file__).parent / "programs"


def lag_fmu(folder: Path, fmi_version: int = 2, width: int = 1) -> Path:
    """Build the FMU of `width` lags side by side: inputs u1, u2, ..., outputs y1, y2, ...; raises InputError without compiler."""
    identifier = f"Lag{width}"
    source = f"lag{fmi_version}.c"
    sources = fmi_headers(fmi_version) | {name: (PROGRAMS / name).read_bytes() for name in (source, "lag.h")}
    sources["width.c"] = f'#define WIDTH {width}\n#include "{source}"\n'.encode()
    numbers = range(1, width + 1)
    variables = [*(_variable(f"u{i}", "input") for i in numbers), *(_variable(f"y{i}", "output") for i in numbers)]
    block = Block(identifier, "a benchmark", variables, 0.01, {})
    token = content_token(sources[name] for name in sorted(sources))
    files = {"modelDescription.xml": _without_dependencies(model_description_xml(block, fmi_version, token, ["width.c"]))}
    files |= compile_binary(identifier, fmi_version, sources, ["width.c"])
    return write_archive(files, folder / f"{identifier}_fmi{fmi_version}.fmu")


def _variable(name: str, causality: str) -> BlockVariable:
    return BlockVariable(name, name, "Float64", causality, "continuous", 0.0)  # type: ignore[arg-type]


def _without_dependencies(description: bytes) -> bytes:
    """The description with the statement that no output depends on anything at once, which some importers insist on."""
    root = ElementTree.fromstring(description)  # noqa: S314 - written by ourselves
    for unknown in (*root.iter("Unknown"), *root.iter("Output"), *root.iter("InitialUnknown")):
        unknown.set("dependencies", "")
    return to_bytes(root)
