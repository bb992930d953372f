"""From sources to `fmus/`: what `cosim build` does, and the manifest that says what came of what."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem, did_you_mean
from ..core.resources import cache_directory
from .sources import SOURCE_KINDS, Source, classify_source, export_source, find_sources, resolve_source_path, tool_versions

#: FMI version -> folder of the FMUs
FMU_FOLDERS = {2: Path("fmus"), 3: Path("fmus/fmi3")}
MANIFEST = Path("fmus/manifest.json")


@dataclass(frozen=True, slots=True)
class BuildResult:
    """One source that was exported, and the FMUs that were written (FMI version -> file)."""

    source: Path
    fmus: Mapping[int, Path]


def build(
    sources: Sequence[Path] | None, root: Path, report: Callable[[BuildResult], None] = lambda built: None
) -> list[BuildResult]:
    """Export sources (None: all below `root`) to `fmus/` and `fmus/fmi3/`, and write down in the manifest what came of what.

    Building all also removes FMUs whose source is gone. `report` is called after each source.
    """
    manifest = read_manifest(root)
    selected = _select_sources(sources, root)
    if sources is None:
        _remove_orphans(manifest, selected, root)
    finished = []
    for source in selected:
        fmus = fmu_files(source, root)
        files = export_source(source, fmus)
        entry = _manifest_entry(source, files, fmus, root)
        manifest = (manifest if sources is None else read_manifest(root)) | {source.manifest_key: entry}
        _write_manifest(manifest, root)
        finished.append(BuildResult(source.path, fmus))
        report(finished[-1])
    return finished


def _remove_orphans(manifest: dict[str, Any], sources: Sequence[Source], root: Path) -> None:
    for name in manifest.keys() - {source.manifest_key for source in sources}:
        for fmu in manifest.pop(name)["fmus"]:
            (root / fmu).unlink(missing_ok=True)


def build_to(source: Path, model: str | None, target: Path, fmi_version: int = 2) -> Path:
    """Export one file anywhere to `target`; `model` names the model when it is not the one named as the Modelica file."""
    described = classify_source(source, model)
    if fmi_version not in described.fmi_versions:
        raise InputError(Problem(f"a {described.kind.name} cannot be exported as FMI {fmi_version}.0", str(source)))
    export_source(described, {fmi_version: target}, model)
    return target


def cached_fmu(source: Path, model: str | None) -> Path:
    """The FMI 2.0 FMU of a Modelica model, built on demand and kept per user until anything it depends on changes."""
    described = classify_source(source, model)
    files = sorted(source.resolve().parent.rglob("*.mo"))
    exporter = sorted(path for path in Path(__file__).parent.rglob("*") if path.suffix in (".py", ".c", ".h"))
    contents = [(str(path), file_hash(path)) for path in [*files, *exporter]]
    key = sha256(json.dumps([str(source.resolve()), model, tool_versions(described), contents]).encode())
    target = cache_directory() / "fmus" / key.hexdigest()[:24] / f"{described.name}.fmu"
    return target if target.is_file() else build_to(source, model, target)


def fmu_files(source: Source, root: Path) -> dict[int, Path]:
    """FMI version -> the FMU of a source below `root`."""
    return {version: root / FMU_FOLDERS[version] / source.kind.folder / f"{source.name}.fmu" for version in source.fmi_versions}


def _select_sources(sources: Sequence[Path] | None, root: Path) -> list[Source]:
    known = {source.path.resolve(): source for source in find_sources(root)}
    if sources is None:
        return list(known.values())
    places = {str(path.relative_to(root.resolve())) for path in known}
    problems = []
    files = [resolve_source_path(path) for path in sources]
    for path in files:
        if path.resolve() not in known:
            where = ", ".join(kind.pattern for kind in SOURCE_KINDS)
            problems.append(Problem(f"is no source of an FMU ({where}){did_you_mean(str(path), places)}", str(path)))
    if problems:
        raise InputError(problems)
    return [known[path.resolve()] for path in files]


# -- the manifest --------------------------------------------------------------------------------------------------------------


def read_manifest(root: Path) -> dict[str, Any]:
    """Names of FMUs -> {"sources": file -> sha256, "fmus": file -> sha256, "tools": name -> version}; {} without a manifest."""
    path = root / MANIFEST
    try:
        return json.loads(path.read_text()) if path.is_file() else {}
    except json.JSONDecodeError as error:
        raise InputError(Problem(f"is no JSON: {error}; remove it and run `cosim build`", str(path))) from None


def _write_manifest(manifest: Mapping[str, Any], root: Path) -> None:
    (root / MANIFEST).write_text(json.dumps(manifest, indent=1, sort_keys=True) + "\n")


def _manifest_entry(source: Source, files: Iterable[Path], fmus: Mapping[int, Path], root: Path) -> dict[str, Any]:
    return {"sources": _file_hashes(files, root), "fmus": _file_hashes(fmus.values(), root), "tools": tool_versions(source)}


def _file_hashes(files: Iterable[Path], root: Path) -> dict[str, str]:
    root = root.resolve()
    return {path.resolve().relative_to(root).as_posix(): file_hash(path) for path in files}


def file_hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
