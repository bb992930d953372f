"""Export of C controllers that implement FMI 2.0.

A folder with C files and a modelDescription.xml.
"""

from pathlib import Path
from xml.etree import ElementTree

from ...core.errors import InputError, Problem, did_you_mean
from ..fmu.description_xml import DESCRIPTION_FILE, validate_description
from ..fmu.package import compile_binary, fmi_headers, write_archive


def write_c_fmu(description: Path, target: Path) -> list[Path]:
    """Write the FMI 2.0 Co-Simulation FMU of a C controller.

    Args:
        description: A hand-written modelDescription.xml. Its `<SourceFiles>` name the files beside
            it that are compiled together with the FMI headers. All .c and .h files beside it are
            packed into the FMU's `sources/`.
        target: The FMU to write.

    Returns:
        The files that the FMU was made from.

    Raises:
        InputError: The description or the C code is faulty.
    """
    identifier, c_files = _read_co_simulation_element(description)
    source_files = sorted(
        path for path in description.parent.iterdir() if path.suffix in (".c", ".h")
    )
    present = {path.name for path in source_files}
    if not c_files:
        raise InputError(Problem("names no file in <CoSimulation><SourceFiles>", str(description)))
    problems = [
        f'<File name="{name}"> does not exist{did_you_mean(name, present)}'
        for name in c_files
        if name not in present
    ]
    if problems:
        raise InputError([Problem(problem, str(description)) for problem in problems])
    sources = fmi_headers(2) | {path.name: path.read_bytes() for path in source_files}
    files = {DESCRIPTION_FILE: description.read_bytes()} | {
        f"sources/{name}": text for name, text in sources.items()
    }
    write_archive(files | compile_binary(identifier, 2, sources, c_files), target)
    return [description, *source_files]


def _read_co_simulation_element(description: Path) -> tuple[str, list[str]]:
    """Return the model identifier and the names of the files to compile."""
    try:
        text = description.read_bytes()
        root = ElementTree.fromstring(text)  # noqa: S314 - a source file of the user
    except (OSError, ElementTree.ParseError) as error:
        raise InputError(Problem(f"cannot be read: {error}", str(description))) from None
    version = root.get("fmiVersion", "none")
    if version != "2.0":
        raise InputError(Problem(f'found fmiVersion "{version}", expected "2.0"', str(description)))
    validate_description(text, description)
    interface = root.find("CoSimulation")
    if interface is None:
        raise InputError(Problem("has no <CoSimulation>", str(description)))
    return interface.get("modelIdentifier", ""), [
        file.get("name", "") for file in interface.iterfind("SourceFiles/File")
    ]
