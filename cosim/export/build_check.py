"""Check that the FMUs in `fmus/` correspond to their sources (`cosim build --check`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..core.errors import CosimError, Problem
from .behaviour import compare_fmus
from .build import fmu_files, read_manifest
from .cache import file_hash
from .sources import Source, export_source, find_sources


def check_fmus(root: Path) -> list[Problem]:
    """Check that the FMUs in `fmus/` correspond to their sources.

    The hashes of all files must agree with the manifest, and rebuilt FMUs must behave like the
    present ones.

    Args:
        root: The project folder.

    Returns:
        All deviations; empty if there are none.
    """
    manifest, sources = read_manifest(root), find_sources(root)
    problems = _orphans(root, manifest, sources)
    unchanged = []
    for source in sources:
        mismatches = _manifest_mismatches(root, manifest, source)
        problems += mismatches
        if not mismatches:
            unchanged.append(source)
    return problems + _changed_behaviour(root, unchanged)


def _orphans(root: Path, manifest: Mapping[str, Any], sources: Sequence[Source]) -> list[Problem]:
    expected = {path for source in sources for path in fmu_files(source, root).values()}
    present = set((root / "fmus").rglob("*.fmu"))
    listed = {root / fmu for entry in manifest.values() for fmu in entry["fmus"]}
    return [
        Problem("has no source", path.relative_to(root).as_posix())
        for path in sorted((present | listed) - expected)
    ]


def _manifest_mismatches(root: Path, manifest: Mapping[str, Any], source: Source) -> list[Problem]:
    """Return the deviations of a source and its FMUs from their entry in the manifest."""
    entry = manifest.get(source.manifest_key)
    if entry is None:
        return [Problem("has no FMU; run `cosim build`", source.path.relative_to(root).as_posix())]
    problems = []
    for name, recorded in entry["sources"].items():
        if not (root / name).is_file() or file_hash(root / name) != recorded:
            problems.append(
                Problem(f'changed since "{source.manifest_key}" was built; run `cosim build`', name)
            )
    for path in fmu_files(source, root).values():
        name = path.relative_to(root).as_posix()
        if not path.is_file():
            problems.append(Problem("is missing; run `cosim build`", name))
        elif file_hash(path) != entry["fmus"].get(name):
            problems.append(Problem("is not the file that `cosim build` wrote", name))
    return problems


def _changed_behaviour(root: Path, sources: Sequence[Source]) -> list[Problem]:
    problems: list[Problem] = []
    present: list[Path] = []
    rebuilt: list[Path] = []
    with TemporaryDirectory(prefix="cosim-check-") as temporary:
        for source in sources:
            targets = fmu_files(source, Path(temporary))
            try:
                export_source(source, targets)
            except CosimError as error:
                problems.append(
                    Problem(
                        f"can no longer be built: {error}", source.path.relative_to(root).as_posix()
                    )
                )
                continue
            present += fmu_files(source, root).values()
            rebuilt += targets.values()
        for path, difference in compare_fmus(present, rebuilt).items():
            problems.append(
                Problem(
                    f"differs from a rebuild: {difference}", path.relative_to(temporary).as_posix()
                )
            )
    return problems
