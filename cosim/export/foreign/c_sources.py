"""A folder with C files and a modelDescription.xml -> .fmu: for controllers that implement FMI 2.0 themselves."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from ...core.errors import InputError, Problem, did_you_mean
from ..fmu.archive import write_archive
from ..fmu.package import compile_binary, fmi_headers
from ..fmu.validation import DESCRIPTION_FILE, validate_description


def write_c_fmu(description: Path, target: Path) -> list[Path]:
    """Write the FMI 2.0 Co-Simulation FMU that a hand-written modelDescription.xml describes to `target`.

    Its `<SourceFiles>` name the files beside it that are compiled, against FMI's headers; all .c and .h files beside it go
    into the FMU's `sources/`. Returns the files that went in. Raises InputError when the description or the C code is faulty.
    """
    identifier, compiled = _read_co_simulation_element(description)
    own = sorted(path for path in description.parent.iterdir() if path.suffix in (".c", ".h"))
    _check_files(description, compiled, {path.name for path in own})
    sources = fmi_headers(2) | {path.name: path.read_bytes() for path in own}
    files = {DESCRIPTION_FILE: description.read_bytes()} | {f"sources/{name}": text for name, text in sources.items()}
    write_archive(files | compile_binary(identifier, 2, sources, compiled), target)
    return [description, *own]


def _read_co_simulation_element(description: Path) -> tuple[str, list[str]]:
    """The model identifier and the names of the files to compile."""
    try:
        text = description.read_bytes()
        root = ElementTree.fromstring(text)  # noqa: S314 - a source file of the user's own
    except (OSError, ElementTree.ParseError) as error:
        raise InputError(Problem(f"cannot be read: {error}", str(description))) from None
    found = root.get("fmiVersion", "none")
    if found != "2.0":
        raise InputError(Problem(f'found fmiVersion "{found}", expected "2.0"', str(description)))
    validate_description(text, description)
    interface = root.find("CoSimulation")
    if interface is None:
        raise InputError(Problem("has no <CoSimulation>", str(description)))
    return interface.get("modelIdentifier", ""), [file.get("name", "") for file in interface.iterfind("SourceFiles/File")]


def _check_files(description: Path, compiled: list[str], present: set[str]) -> None:
    if not compiled:
        raise InputError(Problem("names no file in <CoSimulation><SourceFiles>", str(description)))
    problems = [f'<File name="{name}"> does not exist{did_you_mean(name, present)}' for name in compiled if name not in present]
    if problems:
        raise InputError([Problem(problem, str(description)) for problem in problems])
