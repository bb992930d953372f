"""`cosim build`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...core.errors import CheckError, InputError, Problem

if TYPE_CHECKING:
    from ...export.build import BuildResult


@click.command()
@click.argument("sources", nargs=-1, type=click.Path(path_type=Path))
@click.option("--check", is_flag=True, help="Build nothing; fail when fmus/ is not what its sources say.")
@click.option("--output", type=click.Path(path_type=Path), help="Export one source, which may lie anywhere, to this FMI 2.0 FMU.")
@click.option(
    "--modelica-compiler", type=click.Choice(["cosim", "omc"]), default="cosim", help="For --output: our own, or OpenModelica."
)
def command(sources: tuple[Path, ...], check: bool, output: Path | None, modelica_compiler: str) -> int:
    """Export SOURCES (default: all controllers and plants) to fmus/ and fmus/fmi3/, and write fmus/manifest.json.

    A source is a .mo or .py file, or the folder of a controller in C. With --output it may be one of your own; then
    --modelica-compiler omc exports a model that needs the Modelica Standard Library or more than our own compiler knows
    with OpenModelica (which must be installed; written from its documentation, not tried with it).

    Needs a C compiler and the extra "build". --check compares the hashes of all sources with the manifest and the behaviour
    of freshly built FMUs with those in fmus/ (exit code 3 when they differ).
    """
    from ...core import resources
    from ...export.build import build
    from ...export.build_check import check_fmus as check_fmus

    root = resources.root()
    if check:
        if problems := check_fmus(root):
            raise CheckError("\n".join(map(str, problems)))
        click.echo("every FMU is what its source says")
        return 0
    if output is not None:
        _build_one(sources, output, modelica_compiler)
    elif modelica_compiler != "cosim":
        raise InputError("--modelica-compiler omc needs --output: fmus/ holds what our own compiler makes")
    else:
        build(list(sources) or None, root, _print_built)
    return 0


def _build_one(sources: tuple[Path, ...], output: Path, modelica_compiler: str) -> None:
    from ...export.build import build_to
    from ...export.modelica.frontend.openmodelica import export_with_omc

    if len(sources) != 1:
        raise InputError(f"--output needs one source, found {len(sources)}")
    if not sources[0].exists():
        raise InputError(Problem("does not exist", str(sources[0])))
    if modelica_compiler == "omc":
        export_with_omc(sources[0], output)
    else:
        build_to(sources[0], None, output)
    click.echo(f"{sources[0]} -> {output}")


def _print_built(built: BuildResult) -> None:
    names = ", ".join(path.as_posix()[path.as_posix().rindex("fmus/") :] for path in built.fmus.values())
    click.echo(f"{_relative_to_cwd(built.source)} -> {names}")


def _relative_to_cwd(source: Path) -> Path:
    """A path as the user would write it, where that is shorter."""
    return source.relative_to(Path.cwd()) if source.is_relative_to(Path.cwd()) else source
