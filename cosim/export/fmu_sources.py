"""Kinds of FMU sources, their file patterns and their exporters."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

from ..components.python_import import with_imported_siblings
from ..core import resources
from ..core.errors import CosimError, InputError, Problem
from .fmu.block import Block
from .fmu.compiler import compiler_version, find_compiler
from .fmu.description_xml import DESCRIPTION_FILE
from .fmu.package import write_fmu
from .foreign.c_sources import write_c_fmu
from .foreign.pythonfmu_export import write_python_fmu
from .plant import VEHICLE_PROGRAM, vehicle_block

if TYPE_CHECKING:
    from .modelica import ModelicaOptions


#: suffix of a source file -> kind of the members that a reference names
MEMBERS = {".py": "Class", ".mo": "Model"}


@dataclass(frozen=True, slots=True)
class SourceKind:
    """A kind of source with its exporter: either `load_block` or `write_fmi2`."""

    name: str
    #: glob pattern of the source files, relative to the project folder
    pattern: str
    #: distribution package that the exporter needs
    package: str
    #: read a source file (and the named model in it) as a block, which is exported for FMI 2.0 and
    #: 3.0
    load_block: Callable[[Path, str | None, ModelicaOptions | None], Block] | None
    #: folder of the FMUs below `fmus/`
    folder: str = ""
    #: write the FMI 2.0 FMU of a source file and return the files that it was made from
    write_fmi2: Callable[[Path, Path], list[Path]] | None = None
    #: Python file below the project folder that makes the block of a data file; the FMU is also
    #: made from what it imports
    program: str = ""
    #: true if the exporter runs the C compiler
    compiled: bool = True


@dataclass(frozen=True, slots=True)
class Source:
    """A source file; `name` is the name of its FMU without the suffix."""

    path: Path
    kind: SourceKind
    name: str

    @property
    def manifest_key(self) -> str:
        """Key of the FMU in the manifest: its folder and name."""
        return f"{self.kind.folder}/{self.name}".lstrip("/")

    @property
    def fmi_versions(self) -> Sequence[int]:
        """FMI versions that the source can be exported for."""
        return (2, 3) if self.kind.load_block else (2,)


def _load_modelica(path: Path, model: str | None, options: ModelicaOptions | None) -> Block:
    from .modelica import ModelicaOptions, load_block

    return load_block(path, model, options or ModelicaOptions())


def _load_equations(path: Path, _model: str | None, _options: ModelicaOptions | None) -> Block:
    from ..components.python_import import load_object

    create_block: Callable[[], Block] = load_object(f"{path.name}:block", path.parent)
    try:
        return create_block()
    except CosimError:
        raise
    except Exception as error:
        raise InputError(
            Problem(f"block() failed: {type(error).__name__}: {error}", str(path))
        ) from error


def _load_vehicle(path: Path, _model: str | None, _options: ModelicaOptions | None) -> Block:
    return vehicle_block(path)


#: equations of small models, a file for each FMU
_FORCES = "plant_src/replica/forces/*.py"

SOURCE_KINDS = (
    SourceKind("Modelica model", "controllers/modelica/*.mo", "rumoca", _load_modelica),
    SourceKind(
        "PythonFMU class",
        "controllers/python/*.py",
        "pythonfmu",
        None,
        "python",
        write_python_fmu,
        compiled=False,
    ),
    SourceKind("equations", "plant_src/**/equations.py", "casadi", _load_equations),
    SourceKind("equations", _FORCES, "casadi", _load_equations),
    SourceKind(
        "vehicle file",
        "plant_src/vehicles/data/*.json",
        "casadi",
        _load_vehicle,
        program=VEHICLE_PROGRAM,
    ),
    SourceKind(
        "PythonFMU class",
        "plant_src/*_fmu.py",
        "pythonfmu",
        None,
        "python",
        write_python_fmu,
        compiled=False,
    ),
    SourceKind(
        "C controller", f"controllers/c/*/{DESCRIPTION_FILE}", "fmpy", None, "c", write_c_fmu
    ),
)


def find_sources(root: Path) -> list[Source]:
    """Return all sources below `root`, sorted by the names of their FMUs; Python classes come last.

    Files whose names begin with an underscore are ignored. The plant as a Python class runs the
    equations of other FMUs when it is exported, so these are built before.

    Raises:
        InputError: Two sources have the same FMU name.
    """
    paths: list[Path] = []
    for kind in SOURCE_KINDS:
        paths += [path for path in root.glob(kind.pattern) if not path.name.startswith("_")]
    sources = sorted(map(classify_source, paths), key=lambda source: source.manifest_key)
    clashes = [(a, b) for a, b in pairwise(sources) if a.manifest_key == b.manifest_key]
    if clashes:
        raise InputError(
            [
                Problem(
                    f'has the same FMU name "{a.manifest_key}.fmu" as {b.path}; rename one',
                    str(a.path),
                )
                for a, b in clashes
            ]
        )
    return sorted(sources, key=lambda source: source.kind.load_block is None)


def vehicle_files(root: Path) -> dict[str, Path]:
    """Return the shipped vehicle files by name.

    Vehicles with equations of their own are included.
    """
    templates = {
        path.stem: path
        for path in root.glob("plant_src/vehicles/*/*.json")
        if path.parent.name == path.stem
    }
    return templates | {
        source.name: source.path
        for source in find_sources(root)
        if source.kind.name == "vehicle file"
    }


def classify_source(path: Path, model: str | None = None) -> Source:
    """Determine the kind of a source file and the name of its FMU.

    Args:
        path: The source file, or the folder of a C controller.
        model: Name of the Modelica model, or of the Python class. None selects the model with the
            name of the file.

    Raises:
        InputError: The file cannot be exported.
    """
    path = resolve_source_path(path)
    if model and path.suffix not in MEMBERS:
        raise InputError(
            Problem(
                f'contains no models or classes to choose from; write it without ":{model}"',
                str(path),
            )
        )
    if path.suffix == ".mo":
        return Source(path, SOURCE_KINDS[0], snake_case((model or path.stem).rpartition(".")[2]))
    if path.name == "equations.py" and not model:
        return Source(path, SOURCE_KINDS[2], path.resolve().parent.name)
    if path.resolve().match(_FORCES) and not model:
        return Source(path, SOURCE_KINDS[2], path.stem)
    if path.suffix == ".py":
        return Source(path, SOURCE_KINDS[1], snake_case(model or path.stem))
    if path.name == DESCRIPTION_FILE:
        return Source(path, SOURCE_KINDS[-1], path.resolve().parent.name)
    if path.suffix == ".json":
        return Source(path, SOURCE_KINDS[4], path.stem)
    raise InputError(
        Problem(
            "cannot be exported; expected a .mo or .py file, a vehicle file (.json), or a C "
            f"controller's {DESCRIPTION_FILE}",
            str(path),
        )
    )


def split_reference(reference: str) -> tuple[Path, str | None]:
    """Return the file, and the model or class of "file.mo:Model" or "file.py:Class".

    Raises:
        InputError: There is a colon without a name after it.
    """
    file, _, member = reference.rpartition(":")
    kind = MEMBERS.get(Path(file).suffix)
    if not kind:
        return Path(reference), None
    if not member:
        raise InputError(
            f"{reference}: expected the name of a {kind.lower()} after the colon, as in "
            f"{reference}{kind}"
        )
    return Path(file), member


def resolve_source_path(path: Path) -> Path:
    """Return the model description in the folder of a C controller, else `path` itself."""
    return path / DESCRIPTION_FILE if (path / DESCRIPTION_FILE).is_file() else path


def snake_case(name: str) -> str:
    """Convert a name from CamelCase to snake_case.

    >>> snake_case("ArDroneCascaded"), snake_case("PIDController")
    ('ar_drone_cascaded', 'pid_controller')
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def export_source(
    source: Source,
    targets: Mapping[int, Path],
    model: str | None = None,
    options: ModelicaOptions | None = None,
) -> list[Path]:
    """Export a source to one FMU per FMI version.

    Args:
        source: The source.
        targets: The FMU to write for each FMI version.
        model: Name of the Modelica model. None selects the model with the name of the file.
        options: Libraries and values of parameters of a Modelica model.

    Returns:
        All files that the FMUs were made from.

    Raises:
        InputError: The source is faulty, or a tool for the export is missing.
    """
    tool_version(source.kind.package)
    if source.kind.load_block is None:
        assert source.kind.write_fmi2 is not None
        return source.kind.write_fmi2(source.path, targets[2])
    block = replace(source.kind.load_block(source.path, model, options), identifier=source.name)
    for fmi_version, target in targets.items():
        write_fmu(block, fmi_version, target)
    programs = (
        with_imported_siblings(resources.root() / source.kind.program)
        if source.kind.program
        else []
    )
    return [*with_imported_siblings(source.path), *programs, *block.resources.values()]


def tool_version(package: str) -> str:
    """Return the version of an installed distribution package.

    Raises:
        InputError: The package is not installed.
    """
    try:
        return version(package)
    except PackageNotFoundError:
        raise InputError(
            f'exporting needs "{package}", which is not installed: pip install "fmi-cosim[build]"'
        ) from None


def tool_versions(source: Source) -> dict[str, str]:
    """Return the names and versions of the tools that export a source."""
    versions = {source.kind.package: tool_version(source.kind.package)}
    if source.kind.compiled:
        versions["compiler"] = compiler_version(tuple(find_compiler()))
    return versions
