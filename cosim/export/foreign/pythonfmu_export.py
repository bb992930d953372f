"""Reproducible export of PythonFMU classes, with a completed model description.

PythonFMU supports FMI 2.0 only. Its builder runs in a separate process, because it imports the
source. The FMU state consists of the variables that the class registers: register internal states
as `local` variables.

All Python FMUs of a process share one interpreter and one `sys.modules`. Therefore the source and
the modules that it imports become members of a package. The name of the package contains a hash of
all contents, so that FMUs with modules of the same name do not conflict.
"""

import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree
from zipfile import ZipFile

from ...components.python_import import read_with_relative_imports, with_imported_siblings
from ...core.errors import InputError, Problem
from ..fmu.description_xml import (
    DESCRIPTION_FILE,
    Element,
    add_units,
    to_bytes,
    validate_description,
)
from ..fmu.package import content_token, write_archive

_PROGRAM = Path(__file__).with_name("pythonfmu_program.py")
#: files of cosim that the FMU contains beside the source
_PROTECTION = tuple(
    Path(__file__).parents[2] / "components" / name
    for name in ("slave_protection.py", "object_state.py")
)
#: FMI 2.0 type -> FMI 3.0 type, as far as PythonFMU supports them
_TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}


def write_python_fmu(
    source: Path, target: Path, include: Sequence[Path] = (), class_name: str | None = None
) -> list[Path]:
    """Write the FMI 2.0 FMU of an `Fmi2Slave` class in a Python file.

    The FMU contains

    - the source,
    - the files of its folder that it imports (`from .pid import Pid` or `from pid import Pid`),
    - the JSON file with the same name beside it, if there is one, and the JSON files of all other
      folders with imported files,
    - the files of `include`,
    - PythonFMU and its binaries for linux64 and win64.

    The importing host needs Python and all other packages that the source imports. Units are those
    of the class attribute `units` and those that variables declare (attribute `unit`, written by
    `to_xml` of the variable). Exceptions are logged with file and line.

    Args:
        source: The Python file.
        target: The FMU to write.
        include: Further files and folders. Those below the folder of the source keep their paths
            relative to it; the others are placed beside the source.
        class_name: The class. None selects the only subclass of `Fmi2Slave`, or the one that
            derives from all others.

    Returns:
        The files that the FMU was made from.

    Raises:
        InputError: The class cannot be exported, or its model description is invalid.
    """
    from ...components.python_fmu import checked_units

    contents, files = _read_files(source, include)
    members, units = _build_with_pythonfmu(source, contents, class_name)
    root = ElementTree.fromstring(members[DESCRIPTION_FILE])  # noqa: S314 - just written by PythonFMU
    elements = {variable.get("name", ""): variable[0] for variable in root.iter("ScalarVariable")}
    try:
        checked = checked_units(
            units, {name: _TYPES[element.tag] for name, element in elements.items()}
        )
    except InputError as error:
        raise InputError(
            [replace(problem, where=str(source)) for problem in error.problems]
        ) from None
    for name, unit in checked.items():
        elements[name].set("unit", unit)
    _complete_description(root)
    root.set(
        "guid",
        content_token(
            [
                to_bytes(root),
                *(members[name] for name in sorted(members) if name != DESCRIPTION_FILE),
            ]
        ),
    )
    members[DESCRIPTION_FILE] = to_bytes(root)
    validate_description(members[DESCRIPTION_FILE], source)
    write_archive(members, target)
    return files


def _read_files(source: Path, include: Sequence[Path]) -> tuple[dict[Path, bytes], list[Path]]:
    """Return the contents of the FMU's own files (path in the FMU -> contents) and their paths.

    Absolute imports of modules beside the source become relative.
    """
    folder, data = source.resolve().parent, source.resolve().with_suffix(".json")
    try:
        modules = [file.resolve() for file in with_imported_siblings(source)]
        outside = [file for file in modules if not file.is_relative_to(folder)]
        if outside:
            reason = (
                "is imported, but an FMU can only contain imported files from the folder of its "
                "source"
            )
            raise InputError([Problem(reason, str(file)) for file in outside])
        contents = {
            file.relative_to(folder): read_with_relative_imports(file, folder).encode()
            for file in modules
        }
    except SyntaxError as error:
        raise InputError(Problem(f"cannot be exported: {error}", str(source))) from None
    included = {
        name: file for name, file in _included_files(folder, include) if name not in contents
    }
    subfolders = {file.parent for file in modules} - {folder}
    data_files = [data] if data.is_file() else []
    for subfolder in subfolders:
        data_files += subfolder.glob("*.json")
    for file in data_files:
        included[file.relative_to(folder)] = file
    return contents | {name: file.read_bytes() for name, file in included.items()}, [
        *modules,
        *included.values(),
    ]


def _included_files(folder: Path, include: Sequence[Path]) -> Iterator[tuple[Path, Path]]:
    """Yield the path in the FMU and the path of each included file."""
    for path in map(Path.resolve, include):
        if not path.exists():
            raise InputError(Problem("does not exist", str(path)))
        base = folder if path.is_relative_to(folder) else path.parent
        files = (
            [path] if path.is_file() else sorted(file for file in path.rglob("*") if file.is_file())
        )
        yield from (
            (file.relative_to(base), file) for file in files if "__pycache__" not in file.parts
        )


def _build_with_pythonfmu(
    source: Path, contents: Mapping[Path, bytes], class_name: str | None
) -> tuple[dict[str, bytes], Any]:
    """Build the FMU; return its members (name -> contents) and the `units` of the class."""
    if taken := [file.name for file in _PROTECTION if Path(file.name) in contents]:
        raise InputError(
            Problem(
                f"is the name of a file that cosim adds to the FMU; rename it: {source.parent}",
                taken[0],
            )
        )
    contents = {**contents, **{Path(file.name): file.read_bytes() for file in _PROTECTION}}
    named = [class_name] if class_name else []
    digest = sha256(repr([*sorted(contents.items()), *named]).encode()).hexdigest()
    package = f"{source.stem}_{digest[:12]}"
    with (
        TemporaryDirectory(prefix="cosim-build-") as folder,
        TemporaryDirectory(prefix="cosim-build-") as target,
    ):
        for path, content in contents.items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_bytes(content)
        command = [
            sys.executable,
            "-P",
            str(_PROGRAM),
            folder,
            package,
            source.stem,
            target,
            *named,
        ]
        process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
        built = list(Path(target).glob("*.fmu"))
        if process.returncode or not built:
            reason = (process.stderr.strip() or "PythonFMU has built no FMU").splitlines()[-1]
            reason = reason.removeprefix(f"{package}.slave_protection.SlaveError: ").replace(
                f"{package}.", ""
            )
            raise InputError(Problem(f"cannot be exported: {reason}", str(source)))
        with ZipFile(built[0]) as archive:
            units = json.loads((Path(target) / "units.json").read_text())
            return {name: archive.read(name) for name in archive.namelist()}, units


def _complete_description(root: Element) -> None:
    """Add the attributes and elements that FMI 2.0 requires and PythonFMU omits.

    Remove the date, for reproducible builds.
    """
    root.attrib.pop("generationDateAndTime", None)
    root.set("guid", "")
    # `UnitDefinitions` follow `CoSimulation`, as the FMI 2.0 schema requires
    names = {real.get("unit", "") for real in root.iter("Real")} - {""}
    add_units(root, names)
    if names:
        definitions = root[-1]
        root.remove(definitions)
        root.insert([child.tag for child in root].index("CoSimulation") + 1, definitions)
    unknowns = []
    for index, variable in enumerate(root.iter("ScalarVariable"), start=1):
        if "variability" not in variable.attrib:
            # FMI's default "continuous" is for variables of type Real, but not for parameters
            if "arameter" in variable.get("causality", "local"):
                variable.set("variability", "fixed")
            elif variable.find("Real") is None:
                variable.set("variability", "discrete")
        if _is_initial_unknown(variable.attrib):
            unknowns.append(index)
    structure = root.find("ModelStructure")
    if unknowns and structure is not None:
        group = ElementTree.SubElement(structure, "InitialUnknowns")
        for index in unknowns:
            ElementTree.SubElement(group, "Unknown", index=str(index))


def _is_initial_unknown(attributes: Mapping[str, str]) -> bool:
    if attributes.get("causality") == "calculatedParameter":
        return True
    has_exact_start = (
        attributes.get("variability") == "constant" or attributes.get("initial") == "exact"
    )
    return attributes.get("causality") == "output" and not has_exact_start
