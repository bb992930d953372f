"""Reproducible export of PythonFMU classes, with a completed model description.

PythonFMU supports FMI 2.0 only. Its builder runs in a separate process, because it imports the source. The FMU state consists
of the variables that the class registers: register internal states as `local` variables.

All Python FMUs of a process share one interpreter and one `sys.modules`. Therefore the source becomes a package, and the modules
that it imports become members of this package. The name of the package contains a hash of all contents, so that FMUs with
modules of the same name do not conflict.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree
from zipfile import ZipFile

from ...core.errors import InputError, Problem
from ..fmu.archive import content_token, write_archive
from ..fmu.model_description import Element, add_units, to_bytes
from ..fmu.validation import DESCRIPTION_FILE, validate_description
from .relative_imports import with_relative_imports

#: turns a module into a package whose members are the files beside it
_PACKAGE_STATEMENT = "__path__, __package__ = [__import__('os').path.dirname(__file__)], __name__  # inserted by cosim"


def write_python_fmu(source: Path, target: Path) -> Path:
    """Write the FMI 2.0 FMU of the `Fmi2Slave` class in a Python file.

    The FMU contains

    - the source,
    - the files of its folder that it imports relatively (`from .pid import Pid`),
    - the JSON file with the same name beside it, if there is one,
    - PythonFMU and its binaries for linux64 and win64.

    The importing host needs Python and all other packages that the source imports. Unit definitions are added for all units
    that the variables declare (attribute `unit`, written by `to_xml` of the variable).

    Args:
        source: The Python file; it defines exactly one subclass of `Fmi2Slave`.
        target: The FMU to write.

    Returns:
        `target`.

    Raises:
        InputError: The class cannot be exported, or its model description is invalid.
    """
    files = _build_with_pythonfmu(source)
    root = ElementTree.fromstring(files[DESCRIPTION_FILE])  # noqa: S314 - just written by PythonFMU
    _complete_description(root)
    root.set("guid", content_token([to_bytes(root), *(files[name] for name in sorted(files) if name != DESCRIPTION_FILE)]))
    files[DESCRIPTION_FILE] = to_bytes(root)
    validate_description(files[DESCRIPTION_FILE], source)
    return write_archive(files, target)


def files_of_python_fmu(source: Path) -> list[Path]:
    """Return the files that the FMU of a Python source is made from."""
    data = source.resolve().with_suffix(".json")
    return [*with_relative_imports(source), *([data] if data.is_file() else [])]


def _build_with_pythonfmu(source: Path) -> dict[str, bytes]:
    """Return the members of the FMU that PythonFMU builds (name -> contents)."""
    modules = _read_modules(source)
    with TemporaryDirectory(prefix="cosim-build-") as folder, TemporaryDirectory(prefix="cosim-build-") as target:
        package, files = _stage_files(modules, source.stem, Path(folder))
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", package, "-d", target, "--handle-state", *files]
        process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
        built = list(Path(target).glob("*.fmu"))
        if process.returncode or not built:
            reason = (process.stderr.strip() or "PythonFMU has built no FMU").splitlines()[-1]
            raise InputError(Problem(f"cannot be exported: {reason}", str(source)))
        with ZipFile(built[0]) as archive:
            return {name: archive.read(name) for name in archive.namelist()}


def _read_modules(source: Path) -> dict[Path, bytes]:
    """Return the files of a source (path relative to its folder -> contents)."""
    folder = source.resolve().parent
    try:
        files = sorted(file.resolve() for file in files_of_python_fmu(source))
    except SyntaxError as error:
        raise InputError(Problem(f"cannot be exported: {error}", str(source))) from None
    outside = [file for file in files if not file.is_relative_to(folder)]
    if outside:
        reason = "is imported, but an FMU can only contain files from the folder of its source"
        raise InputError([Problem(reason, str(file)) for file in outside])
    return {file.relative_to(folder): file.read_bytes() for file in files}


def _stage_files(modules: Mapping[Path, bytes], name: str, folder: Path) -> tuple[str, list[str]]:
    """Write the modules and the package module to `folder`; return the package file and the other members for PythonFMU."""
    package = f"{name}_{sha256(repr(sorted(modules.items())).encode()).hexdigest()[:12]}"
    for path, content in modules.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    (folder / f"{package}.py").write_text(_as_package(modules[Path(f"{name}.py")].decode()))
    return f"{package}.py", sorted({path.parts[0] for path in modules})


def _as_package(text: str) -> str:
    """Insert the package statement after the `from __future__` imports, so that relative imports work in the FMU."""
    future = [node for node in ast.parse(text).body if isinstance(node, ast.ImportFrom) and node.module == "__future__"]
    line = future[-1].end_lineno or 0 if future else 0
    lines = text.splitlines()
    return "\n".join([*lines[:line], _PACKAGE_STATEMENT, *lines[line:], ""])


def _complete_description(root: Element) -> None:
    """Add the attributes and elements that FMI 2.0 requires and PythonFMU omits; remove the date, for reproducible builds."""
    root.attrib.pop("generationDateAndTime", None)
    root.set("guid", "")
    _define_units(root)
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


def _define_units(root: Element) -> None:
    """Insert `UnitDefinitions` after `CoSimulation`, as the FMI 2.0 schema requires."""
    names = {real.get("unit", "") for real in root.iter("Real")} - {""}
    add_units(root, names)
    if names:
        definitions = root[-1]
        root.remove(definitions)
        root.insert([child.tag for child in root].index("CoSimulation") + 1, definitions)


def _set_default_variability(variable: Element) -> None:
    """Set the variability where FMI's default "continuous" is not allowed: for parameters and for types other than Real."""
    if "arameter" in variable.get("causality", "local"):
        variable.set("variability", "fixed")
    elif variable.find("Real") is None:
        variable.set("variability", "discrete")


def _is_initial_unknown(attributes: Mapping[str, str]) -> bool:
    if attributes.get("causality") == "calculatedParameter":
        return True
    has_exact_start = attributes.get("variability") == "constant" or attributes.get("initial") == "exact"
    return attributes.get("causality") == "output" and not has_exact_start
