"""Files that the runs of a scenario need, by content hash, so that another machine can run them."""

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path, PurePosixPath
from typing import Any

from ...components.python_import import package_files, package_root
from ...core import __version__, paths, resources
from ...core.errors import InputError, Problem
from ...scenario import load_scenario
from ...scenario.component_sources import FmuSource, texts_in
from ...scenario.nested_systems import Node


def cosim_fingerprint() -> str:
    """Return the version of cosim and a hash of its sources and shipped FMUs.

    Equal results require equal fingerprints.
    """
    package = resources.package_folder()
    sources = sorted(path for path in package.rglob("*.py") if "_bundle" not in path.parts)
    digest = sha256()
    for path in (*sources, *resources.root().glob("fmus/manifest.json")):
        digest.update(path.name.encode() + path.read_bytes())
    return f"{__version__} ({digest.hexdigest()[:12]})"


@dataclass(frozen=True)
class Bundle:
    """Files of a scenario below their common folder `root`.

    `scenario` is the path of the scenario's sources file.
    """

    root: Path
    scenario: PurePosixPath
    #: POSIX path below `root` -> sha256 of the content
    files: Mapping[str, str]

    @cached_property
    def digest(self) -> str:
        """Hash of the files, independent of `root`, and of the cosim that runs them."""
        return sha256(
            json.dumps(
                [cosim_fingerprint(), str(self.scenario), sorted(self.files.items())]
            ).encode()
        ).hexdigest()

    def read_contents(self, hashes: Iterable[str]) -> dict[str, bytes]:
        """Read file contents by their hash.

        Raises:
            InputError: if a file has changed since its hash was computed.
        """
        requested = set(hashes)
        contents = {
            sha: (self.root / path).read_bytes()
            for path, sha in self.files.items()
            if sha in requested
        }
        if changed := [
            sha for sha, content in contents.items() if sha256(content).hexdigest() != sha
        ]:
            names = [path for path, sha in self.files.items() if sha in changed]
            raise InputError(f'"{self.root / names[0]}" was changed while the sweep was running')
        return contents


def collect_bundle(scenario: Path, variants: Iterable[Mapping[str, Any]] = ({},)) -> Bundle:
    """Collect the files of a scenario.

    They include those that it uses only with one of the `variants` of its settings.
    """
    named, used = set[Path](), set[Path]()
    for settings in variants:
        named.update(_scenario_files(scenario, settings))
    for file in named:
        used.update(_package_files(file))
    root = Path(os.path.commonpath([path.parent for path in used]))
    files = {
        path.relative_to(root).as_posix(): sha256(path.read_bytes()).hexdigest()
        for path in sorted(used)
    }
    return Bundle(root, PurePosixPath(scenario.resolve().relative_to(root).as_posix()), files)


def fmu_paths(files: Iterable[str]) -> tuple[str, ...]:
    """Return the paths that are FMUs, sorted."""
    return tuple(sorted(path for path in files if path.endswith(FmuSource.SUFFIX)))


def absolute_paths(scenario: Path, settings: Mapping[str, Any]) -> list[Problem]:
    """Return a problem for each absolute path in a scenario, which another machine would lack."""
    problems = []
    loaded = load_scenario(scenario, _pointer_settings(settings), scenario.parent)
    for node in loaded.root.walk():
        for path, where in _named_files(node):
            if Path(path).is_absolute() and paths.is_file(Path(path)):
                text = (
                    f'absolute path "{path}" cannot be shipped to a cluster; expected a path '
                    "relative to this file"
                )
                problems.append(Problem(text, where))
    return problems


def _scenario_files(scenario: Path, settings: Mapping[str, Any]) -> Iterator[Path]:
    root = load_scenario(scenario, _pointer_settings(settings), scenario.parent).root
    for node in root.walk():
        yield from (file.resolve() for file in node.document.files)
        yield from _existing_files(node.folder, (name for name, _ in _named_files(node)))
    variables = [value for name, value in settings.items() if not name.startswith("/")]
    yield from _existing_files(root.folder, texts_in(variables))


def _existing_files(folder: Path, names: Iterable[str]) -> Iterator[Path]:
    """Return the paths of the names that are files."""
    return filter(paths.is_file, (paths.resolve_path(folder / name) for name in names))


def _pointer_settings(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings that change the scenario's JSON."""
    return {name: value for name, value in settings.items() if name.startswith("/")}


def _named_files(node: Node) -> Iterator[tuple[str, str]]:
    """Yield (path, location) of all files that a system names.

    Texts in arguments and parameters may be files, too.
    """
    for name, component in node.spec.components.items():
        where = node.where("components", name)
        yield from ((path, where) for path in component.texts())
    for i, profile in enumerate(getattr(node.spec, "inputs", ())):
        yield from ((path, node.where("inputs", i)) for path in profile.paths)
    for i, kpi in enumerate(getattr(node.spec, "kpis", ())):
        where = node.where("kpis", i)
        yield kpi.python.rpartition(":")[0], where
        yield from ((path, where) for path in texts_in(kpi.arguments))


def _package_files(path: Path) -> Iterator[Path]:
    """Yield a file and those beside it that it imports.

    Of a file in a Python package, yield all files of the outermost package, also data files.
    """
    root = package_root(path)
    if path.suffix != ".py" or root == path.parent:
        yield from package_files([path]) if path.suffix == ".py" else [path]
        return
    package = root / path.relative_to(root).parts[0]
    yield from (
        each for each in package.rglob("*") if each.is_file() and "__pycache__" not in each.parts
    )
