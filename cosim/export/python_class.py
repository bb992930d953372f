"""A file with a PythonFMU class -> .fmu, with the description completed and the same bytes for the same source.

PythonFMU knows FMI 2.0 only. Its own builder does the work, in a process of its own because it imports the file under its
bare name. The FMU's state is what the class registers as variables: register internal states as `local` variables.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree
from zipfile import ZipFile

from ..errors import InputError, Problem
from .archive import content_token, write_archive
from .description import Element, to_bytes

DESCRIPTION = "modelDescription.xml"


def write_python_fmu(source: Path, target: Path) -> Path:
    """Write the FMI 2.0 FMU of the one `Fmi2Slave` class in `source` to `target`.

    It contains the source, PythonFMU itself and its binaries for linux64 and win64; the host needs Python, and what the
    source imports. Raises InputError when the class cannot be exported or its variables make no valid description.
    """
    files = _build(source)
    root = ElementTree.fromstring(files[DESCRIPTION])  # noqa: S314 - just written by PythonFMU
    _complete(root)
    root.set("guid", content_token([to_bytes(root), *(files[name] for name in sorted(files) if name != DESCRIPTION)]))
    files[DESCRIPTION] = to_bytes(root)
    _validate(source, files[DESCRIPTION])
    return write_archive(files, target)


def _build(source: Path) -> dict[str, bytes]:
    """The members of the FMU as PythonFMU's builder makes it."""
    with TemporaryDirectory(prefix="cosim-build-") as folder:
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", str(source.resolve()), "-d", folder, "--handle-state"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
        built = list(Path(folder).glob("*.fmu"))
        if done.returncode or not built:
            reason = (done.stderr.strip() or "PythonFMU built nothing").splitlines()[-1]
            raise InputError(Problem(f"cannot be exported: {reason}", str(source)))
        with ZipFile(built[0]) as archive:
            return {name: archive.read(name) for name in archive.namelist()}


def _complete(root: Element) -> None:
    """What FMI 2.0 demands and PythonFMU leaves out; the date goes, because it would make every build different."""
    root.attrib.pop("generationDateAndTime", None)
    root.set("guid", "")
    unknowns = []
    for index, variable in enumerate(root.iter("ScalarVariable"), start=1):
        if "variability" not in variable.attrib:
            _set_default_variability(variable)
        if _is_initial_unknown(variable.attrib):
            unknowns.append(index)
    structure = root.find("ModelStructure")
    if unknowns and structure is not None:
        group = ElementTree.SubElement(structure, "InitialUnknowns")
        for index in unknowns:
            ElementTree.SubElement(group, "Unknown", index=str(index))


def _set_default_variability(variable: Element) -> None:
    """FMI's default "continuous" is legal for Real variables that are no parameters only."""
    if "arameter" in variable.get("causality", "local"):
        variable.set("variability", "fixed")
    elif variable.find("Real") is None:
        variable.set("variability", "discrete")


def _is_initial_unknown(attributes: Mapping[str, str]) -> bool:
    if attributes.get("causality") == "calculatedParameter":
        return True
    known = attributes.get("variability") == "constant" or attributes.get("initial") == "exact"
    return attributes.get("causality") == "output" and not known


def _validate(source: Path, description: bytes) -> None:
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError

    archive = BytesIO()
    with ZipFile(archive, "w") as file:
        file.writestr(DESCRIPTION, description)
    try:
        read_model_description(archive, validate_variable_names=True, validate_model_structure=True)
    except ValidationError as error:
        raise InputError([Problem(problem, str(source)) for problem in error.problems]) from None
