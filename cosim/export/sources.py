"""The sources of FMUs: which kinds there are, where they live, and how each becomes an FMU."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path

from ..errors import CosimError, InputError, Problem
from .block import Block
from .compiler import compiler_version, find_compiler
from .package import write_fmu
from .python_class import write_python_fmu


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of source: where its files lie, which package reads it, and how (None: PythonFMU exports it, as FMI 2.0 only).

    Its FMUs lie in `folder` below `fmus/`.
    """

    name: str
    pattern: str
    tool: str
    load: Callable[[Path, str | None], Block] | None
    folder: str = ""


@dataclass(frozen=True, slots=True)
class Source:
    """A file that becomes an FMU; `name` is the FMU's file name without ending."""

    path: Path
    kind: Kind
    name: str

    @property
    def key(self) -> str:
        """The name with the folder of its kind: what the manifest calls it."""
        return f"{self.kind.folder}/{self.name}".lstrip("/")

    @property
    def fmi_versions(self) -> Sequence[int]:
        return (2, 3) if self.kind.load else (2,)


def _load_modelica(path: Path, model: str | None) -> Block:
    from .modelica import load

    return load(path, model)


def _load_equations(path: Path, model: str | None) -> Block:
    from ..python_component import load_object

    block = load_object(f"{path.name}:block", path.parent)
    try:
        return block()
    except CosimError:
        raise
    except Exception as error:
        raise InputError(Problem(f"block() failed: {type(error).__name__}: {error}", str(path))) from error


KINDS = (
    Kind("Modelica model", "controllers/modelica/*.mo", "rumoca", _load_modelica),
    Kind("PythonFMU class", "controllers/python/*.py", "pythonfmu", None, "python"),
    Kind("equations", "plant_src/vehicles/*/equations.py", "casadi", _load_equations),
)


def find_sources(root: Path) -> list[Source]:
    """All sources below `root` that `cosim build` exports, ordered by the names of their FMUs, which must differ."""
    paths = [path for kind in KINDS for path in root.glob(kind.pattern) if not path.name.startswith("_")]
    sources = sorted(map(source_of, paths), key=lambda source: source.key)
    clashes = [(a, b) for a, b in pairwise(sources) if a.key == b.key]
    if clashes:
        raise InputError([Problem(f'becomes "{a.key}.fmu" as {b.path} does; rename one', str(a.path)) for a, b in clashes])
    return sources


def source_of(path: Path, model: str | None = None) -> Source:
    """What kind of source a file is, and the name of its FMU. Raises InputError for files that cannot be exported."""
    if path.suffix == ".mo":
        return Source(path, KINDS[0], snake_case((model or path.stem).rpartition(".")[2]))
    if path.name == "equations.py":
        return Source(path, KINDS[2], path.resolve().parent.name)
    if path.suffix == ".py":
        return Source(path, KINDS[1], snake_case(path.stem))
    raise InputError(Problem("cannot be exported; expected a .mo or .py file", str(path)))


def snake_case(name: str) -> str:
    """
    >>> snake_case("ArDroneCascaded"), snake_case("PIDController")
    ('ar_drone_cascaded', 'pid_controller')
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def export(source: Source, targets: Mapping[int, Path], model: str | None = None) -> list[Path]:
    """Export to one file per FMI version; the result lists all files that went in."""
    tool_version(source.kind.tool)
    if source.kind.load is None:
        write_python_fmu(source.path, targets[2])
        return [source.path]
    block = replace(source.kind.load(source.path, model), identifier=source.name)
    for fmi_version, target in targets.items():
        write_fmu(block, fmi_version, target)
    return [*_with_relative_imports(source.path), *block.resources.values()]


def _with_relative_imports(path: Path) -> list[Path]:
    """A Python file and the files of its package that it imports, directly or not; other files stand alone."""
    files, new = [path], [path] if path.suffix == ".py" else []
    while new:
        imported = {file.resolve() for known in new for file in _relative_imports(known)}
        new = sorted(imported - {file.resolve() for file in files})
        files += new
    return files


def _relative_imports(path: Path) -> Iterator[Path]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = path.resolve().parents[node.level - 1].joinpath(*(node.module or "").split("."))
            named = (base / alias.name for alias in node.names)
            yield from (file for module in (base, *named) if (file := module.with_suffix(".py")).is_file())


def tool_version(package: str) -> str:
    """The version of an installed package that exporting needs; raises InputError when it is missing."""
    try:
        return version(package)
    except PackageNotFoundError:
        raise InputError(f'exporting needs "{package}", which is not installed: pip install "fmi-cosim[build]"') from None


def tools(source: Source) -> dict[str, str]:
    """Names and versions of everything that turns this source into an FMU."""
    versions = {source.kind.tool: tool_version(source.kind.tool)}
    if source.kind.load is not None:
        versions["compiler"] = compiler_version(tuple(find_compiler()))
    return versions
