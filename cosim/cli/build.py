"""`cosim build`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from ..export.build import Built


@click.command()
@click.argument("sources", nargs=-1, type=click.Path(path_type=Path))
@click.option("--check", is_flag=True, help="Build nothing; fail when fmus/ is not what its sources say.")
def command(sources: tuple[Path, ...], check: bool) -> int:
    """Export SOURCES (default: all controllers and plants) to fmus/ and fmus/fmi3/, and write fmus/manifest.json.

    Needs a C compiler and the extra "build". --check compares the hashes of all sources with the manifest and the behaviour
    of freshly built FMUs with those in fmus/ (exit code 3 when they differ).
    """
    from .. import resources
    from ..errors import CheckError
    from ..export.build import build
    from ..export.check import check as check_fmus

    root = resources.root()
    if check:
        if problems := check_fmus(root):
            raise CheckError("\n".join(map(str, problems)))
        click.echo("every FMU is what its source says")
        return 0
    build(list(sources) or None, root, _report)
    return 0


def _report(built: Built) -> None:
    names = ", ".join(path.as_posix()[path.as_posix().rindex("fmus/") :] for path in built.fmus.values())
    click.echo(f"{_shown(built.source)} -> {names}")


def _shown(source: Path) -> Path:
    """A path as the user would write it, where that is shorter."""
    return source.relative_to(Path.cwd()) if source.is_relative_to(Path.cwd()) else source
