"""Export of all sources to `fmus/` (`cosim build`), and its manifest."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem, did_you_mean
from ..core.json_values import parse_object
from ..results.files import write_file
from .cache import cached_file, file_hash
from .fmu_sources import (
    SOURCE_KINDS,
    Source,
    classify_source,
    export_source,
    find_sources,
    resolve_source_path,
    tool_versions,
)
from .foreign.pythonfmu_export import write_python_fmu

#: FMI version -> folder of the FMUs
FMU_FOLDERS = {2: Path("fmus"), 3: Path("fmus/fmi3")}
MANIFEST = Path("fmus/manifest.json")


@dataclass(frozen=True, slots=True)
class BuildResult:
    """An exported source and its FMUs (FMI version -> file)."""

    source: Path
    fmus: Mapping[int, Path]


def build(
    sources: Sequence[Path] | None,
    root: Path,
    report: Callable[[BuildResult], None] = lambda _result: None,
) -> list[BuildResult]:
    """Export sources to `fmus/` and `fmus/fmi3/` and record them in the manifest.

    Args:
        sources: The files to export. None exports all sources below `root` and removes FMUs whose
            source no longer exists.
        root: The project folder.
        report: Called after each exported source.

    Returns:
        One result per source, in the order of export.

    Raises:
        InputError: A file is not a source below `root`, or a source cannot be exported.
    """
    manifest = read_manifest(root)
    selected = _select_sources(sources, root)
    if sources is None:
        for name in manifest.keys() - {source.manifest_key for source in selected}:
            for fmu in manifest.pop(name)["fmus"]:
                (root / fmu).unlink(missing_ok=True)
    results = []
    for source in selected:
        fmus = fmu_files(source, root)
        files = export_source(source, fmus)
        entry = {
            "sources": _file_hashes(files, root),
            "fmus": _file_hashes(fmus.values(), root),
            "tools": tool_versions(source),
        }
        manifest = (manifest if sources is None else read_manifest(root)) | {
            source.manifest_key: entry
        }
        write_file(root / MANIFEST, json.dumps(manifest, indent=1, sort_keys=True) + "\n")
        results.append(BuildResult(source.path, fmus))
        report(results[-1])
    return results


def build_to(
    source: Path,
    model: str | None,
    target: Path,
    fmi_version: int = 2,
    *,
    include: Sequence[Path] = (),
    library_path: Sequence[Path] = (),
    values: Mapping[str, Any] | None = None,
) -> Path:
    """Export one source file to one FMU.

    Args:
        source: The source file; it may be anywhere.
        model: Name of the Modelica model, or of the Python class. None selects the model with the
            name of the file, or the only class.
        target: The FMU to write.
        fmi_version: 2 or 3.
        include: Further files of the FMU of a Python source, see `write_python_fmu`.
        library_path: Folders of Modelica libraries, which are searched before those of
            MODELICAPATH.
        values: Values of parameters of a Modelica model by name, also of structural parameters.

    Returns:
        `target`.

    Raises:
        InputError: The file cannot be exported, or not for this FMI version, or files or values are
            given for another kind of FMU.
    """
    classified = classify_source(source, model)
    if fmi_version not in classified.fmi_versions:
        raise InputError(
            Problem(
                f"a {classified.kind.name} cannot be exported as FMI {fmi_version}.0", str(source)
            )
        )
    if classified.kind.package == "pythonfmu" and not values:
        write_python_fmu(classified.path, target, include, model)
    elif include:
        raise InputError(Problem("only the FMU of a Python class can include files", str(source)))
    else:
        from .modelica import ModelicaOptions

        if values and classified.kind.package != "rumoca":
            raise InputError(
                Problem("only parameters of Modelica models can be set when building", str(source))
            )
        export_source(
            classified, {fmi_version: target}, model, ModelicaOptions(library_path, values or {})
        )
    return target


def cached_fmu(source: Path, model: str | None, library_path: Sequence[Path] = ()) -> Path:
    """Return the FMI 2.0 FMU of a Modelica model from the user's cache.

    The FMU is built if the model, the packages beside it, a library that it uses, the exporter or
    the tools have changed since the last build.

    Args:
        source: The Modelica file.
        model: Name of the model. None selects the model with the name of the file.
        library_path: Folders of Modelica libraries, which are searched before those of
            MODELICAPATH.

    Raises:
        InputError: The model cannot be exported, or the cache cannot be written.
        OutputError: The disk is full or defective.
    """
    from .modelica.frontend.libraries import find_libraries, library_folders
    from .modelica.frontend.model_files import readable_files

    classified = classify_source(source, model)
    files = readable_files(source)
    exporter = sorted(
        path for path in Path(__file__).parent.rglob("*") if path.suffix in (".py", ".c", ".h")
    )
    contents = [(str(path), file_hash(path)) for path in [*files, *exporter]]
    contents += [
        (str(library.path), library.digest)
        for library in find_libraries([source], library_folders(library_path), ())
    ]
    key = sha256(
        json.dumps([str(source.resolve()), model, tool_versions(classified), contents]).encode()
    )
    return cached_file(
        key.hexdigest()[:24],
        f"{classified.name}.fmu",
        lambda target: build_to(source, model, target, library_path=library_path),
    )


def fmu_files(source: Source, root: Path) -> dict[int, Path]:
    """Return the path of a source's FMU below `root` for each FMI version."""
    return {
        version: root / FMU_FOLDERS[version] / source.kind.folder / f"{source.name}.fmu"
        for version in source.fmi_versions
    }


def _select_sources(sources: Sequence[Path] | None, root: Path) -> list[Source]:
    known = {source.path.resolve(): source for source in find_sources(root)}
    if sources is None:
        return list(known.values())
    known_names = {str(path.relative_to(root.resolve())) for path in known}
    problems = []
    files = [resolve_source_path(path) for path in sources]
    for path in files:
        if path.resolve() not in known:
            patterns = ", ".join(kind.pattern for kind in SOURCE_KINDS)
            text = (
                "is not a source of an FMU of cosim "
                f"({patterns}){did_you_mean(str(path), known_names)}"
            )
            problems.append(
                Problem(f"{text}; --output FILE.fmu exports a source of your own", str(path))
            )
    if problems:
        raise InputError(problems)
    return [known[path.resolve()] for path in files]


# -- the manifest


def read_manifest(root: Path) -> dict[str, Any]:
    """Return the manifest of the built FMUs, or {} if there is none.

    Returns:
        For each FMU name, the keys "sources" (file -> SHA-256), "fmus" (file -> SHA-256) and
        "tools" (name -> version).

    Raises:
        InputError: The file is not valid JSON.
    """
    path = root / MANIFEST
    try:
        manifest = parse_object(path.read_text()) if path.is_file() else {}
    except ValueError as error:
        raise InputError(
            Problem(f"is not valid JSON: {error}; remove it and run `cosim build`", str(path))
        ) from None
    return manifest


def _file_hashes(files: Iterable[Path], root: Path) -> dict[str, str]:
    root = root.resolve()
    return {path.resolve().relative_to(root).as_posix(): file_hash(path) for path in files}
