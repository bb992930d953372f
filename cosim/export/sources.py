"""The sources of FMUs: which kinds there are, where they live, and how each becomes an FMU."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path

from ..core.errors import CosimError, InputError, Problem
from .fmu.block import Block
from .fmu.compiler import compiler_version, find_compiler
from .fmu.package import write_fmu
from .fmu.validation import DESCRIPTION_FILE
from .foreign.c_sources import write_c_fmu
from .foreign.python_class import files_of_python_fmu, write_python_fmu
from .foreign.relative_imports import with_relative_imports


@dataclass(frozen=True, slots=True)
class SourceKind:
    """A kind of source: where its files lie, which package reads it, and how.

    Either `load` reads it as a block, which becomes an FMU of each version, or `write` makes its FMI 2.0 FMU and returns the
    files that went in. Its FMUs lie in `folder` below `fmus/`.
    """

    name: str
    pattern: str
    package: str
    load_block: Callable[[Path, str | None], Block] | None
    folder: str = ""
    write_fmi2: Callable[[Path, Path], list[Path]] | None = None
    compiled: bool = True


@dataclass(frozen=True, slots=True)
class Source:
    """A file that becomes an FMU; `name` is the FMU's file name without ending."""

    path: Path
    kind: SourceKind
    name: str

    @property
    def manifest_key(self) -> str:
        """The name with the folder of its kind: what the manifest calls it."""
        return f"{self.kind.folder}/{self.name}".lstrip("/")

    @property
    def fmi_versions(self) -> Sequence[int]:
        return (2, 3) if self.kind.load_block else (2,)


def _load_modelica(path: Path, model: str | None) -> Block:
    from .modelica import load_block

    return load_block(path, model)


def _load_equations(path: Path, model: str | None) -> Block:
    from ..components.python_import import load_object

    block = load_object(f"{path.name}:block", path.parent)
    try:
        return block()
    except CosimError:
        raise
    except Exception as error:
        raise InputError(Problem(f"block() failed: {type(error).__name__}: {error}", str(path))) from error


def _write_python(path: Path, target: Path) -> list[Path]:
    write_python_fmu(path, target)
    return files_of_python_fmu(path)


SOURCE_KINDS = (
    SourceKind("Modelica model", "controllers/modelica/*.mo", "rumoca", _load_modelica),
    SourceKind("PythonFMU class", "controllers/python/*.py", "pythonfmu", None, "python", _write_python, compiled=False),
    SourceKind("equations", "plant_src/**/equations.py", "casadi", _load_equations),
    SourceKind("PythonFMU class", "plant_src/*_fmu.py", "pythonfmu", None, "python", _write_python, compiled=False),
    SourceKind("C controller", f"controllers/c/*/{DESCRIPTION_FILE}", "fmpy", None, "c", write_c_fmu),
)


def find_sources(root: Path) -> list[Source]:
    """All sources below `root` that `cosim build` exports, ordered by the names of their FMUs, which must differ."""
    paths = [path for kind in SOURCE_KINDS for path in root.glob(kind.pattern) if not path.name.startswith("_")]
    sources = sorted(map(classify_source, paths), key=lambda source: source.manifest_key)
    clashes = [(a, b) for a, b in pairwise(sources) if a.manifest_key == b.manifest_key]
    if clashes:
        raise InputError(
            [Problem(f'becomes "{a.manifest_key}.fmu" as {b.path} does; rename one', str(a.path)) for a, b in clashes]
        )
    return sources


def classify_source(path: Path, model: str | None = None) -> Source:
    """What kind of source a file is, and the name of its FMU. Raises InputError for files that cannot be exported."""
    path = resolve_source_path(path)
    if path.suffix == ".mo":
        return Source(path, SOURCE_KINDS[0], snake_case((model or path.stem).rpartition(".")[2]))
    if path.name == "equations.py":
        return Source(path, SOURCE_KINDS[2], path.resolve().parent.name)
    if path.suffix == ".py":
        return Source(path, SOURCE_KINDS[1], snake_case(path.stem))
    if path.name == DESCRIPTION_FILE:
        return Source(path, SOURCE_KINDS[-1], path.resolve().parent.name)
    raise InputError(
        Problem(f"cannot be exported; expected a .mo or .py file, or a C controller's {DESCRIPTION_FILE}", str(path))
    )


def resolve_source_path(path: Path) -> Path:
    """The file that stands for a source: a controller in C may be named by its folder."""
    return path / DESCRIPTION_FILE if (path / DESCRIPTION_FILE).is_file() else path


def snake_case(name: str) -> str:
    """
    >>> snake_case("ArDroneCascaded"), snake_case("PIDController")
    ('ar_drone_cascaded', 'pid_controller')
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def export_source(source: Source, targets: Mapping[int, Path], model: str | None = None) -> list[Path]:
    """Export to one file per FMI version; the result lists all files that went in."""
    tool_version(source.kind.package)
    if source.kind.load_block is None:
        assert source.kind.write_fmi2 is not None
        return source.kind.write_fmi2(source.path, targets[2])
    block = replace(source.kind.load_block(source.path, model), identifier=source.name)
    for fmi_version, target in targets.items():
        write_fmu(block, fmi_version, target)
    return [*with_relative_imports(source.path), *block.resources.values()]


def tool_version(package: str) -> str:
    """The version of an installed package that exporting needs; raises InputError when it is missing."""
    try:
        return version(package)
    except PackageNotFoundError:
        raise InputError(f'exporting needs "{package}", which is not installed: pip install "fmi-cosim[build]"') from None


def tool_versions(source: Source) -> dict[str, str]:
    """Names and versions of everything that turns this source into an FMU."""
    versions = {source.kind.package: tool_version(source.kind.package)}
    if source.kind.compiled:
        versions["compiler"] = compiler_version(tuple(find_compiler()))
    return versions
