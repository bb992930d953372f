"""`cosim build`: export of controllers and plants as FMUs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...core.errors import CheckError, InputError, Problem, nearest_file
from ..options import Texts, flag_option, path_option
from .new_vehicle import read_vehicle_file

if TYPE_CHECKING:
    from ...export.build import BuildResult


@click.command()
@click.argument("sources", nargs=-1)
@flag_option("--check", help="Build nothing; check that the fmus/ of cosim are up to date.")
@path_option(
    "--output",
    help="Export a single source, in any folder, to this FMU.",
)
@click.option(
    "--fmi",
    "fmi_version",
    type=click.Choice(["2", "3"]),
    default="2",
    help="FMI version of --output; default: 2.",
)
@click.option(
    "--include",
    type=click.Path(path_type=Path, exists=True),
    multiple=True,
    help=(
        "File or folder that the Python class reads at run time, for --output; repeatable. The "
        "class finds it below `self.resources` or beside its own file."
    ),
)
@path_option(
    "--library",
    multiple=True,
    metavar="DIR",
    help=(
        "Folder of Modelica libraries for --output, searched before those of MODELICAPATH; "
        "repeatable."
    ),
)
@click.option(
    "--set",
    "values",
    multiple=True,
    metavar="NAME=VALUE",
    help=(
        "Parameter of a Modelica model for --output, also one that selects equations or array "
        "sizes; repeatable."
    ),
)
def command(
    sources: Texts,
    check: bool,
    output: Path | None,
    fmi_version: str,
    include: tuple[Path, ...],
    library: tuple[Path, ...],
    values: Texts,
) -> int:
    """Export controllers and plants to fmus/.

    SOURCES are .mo or .py files, vehicle files, or folders of controllers in C; default: all
    controllers and plants. The FMUs are written to fmus/ (FMI 2.0) and fmus/fmi3/, and their hashes
    to fmus/manifest.json. --output exports a single source of your own. Of a Modelica file it
    exports the model with the name of the file, of a Python file the only PythonFMU class.
    file.mo:Package.Model or file.py:Class exports another one, without --output to a file with its
    name in the working directory (model.fmu). With --output, --fmi selects the FMI version.

    Modelica models, equations and controllers in C require a C compiler, and Modelica models and
    equations the extra "build". --check is for changes of cosim itself: it compares the hashes of
    all sources with the manifest, and the behaviour of newly built FMUs with those in fmus/ (exit
    code 3 if they differ).
    """
    from ...core import resources
    from ...export.build import build
    from ...export.build_check import check_fmus
    from ...export.fmu_sources import classify_source, split_reference
    from ..messages import print_log

    print_log()
    named = [split_reference(source) for source in sources]
    files = [file for file, _ in named]
    if output is None and any(member for _, member in named):
        output = Path(f"{classify_source(*named[0]).name}.fmu")
    root = resources.root()
    if check:
        if sources or output:
            raise InputError(
                "--check compares all FMUs that belong to cosim with their sources and takes no "
                "SOURCES and no --output"
            )
        if problems := check_fmus(root):
            raise CheckError("\n".join(map(str, problems)))
        click.echo("every FMU of cosim is up to date with its source")
        return 0
    for source in files:
        if source.suffix == ".json" and source.is_file():
            from ...export.plant import examine_vehicle

            read_vehicle_file(source, examine_vehicle)
    if output is not None:
        _build_one(named, output, int(fmi_version), include, library, values)
    else:
        for option, is_given, reason in (
            ("--fmi", fmi_version != "2", "fmus/ contains FMUs of both FMI versions"),
            ("--set", values, "the FMUs in fmus/ have the values of their sources"),
            ("--include", include, "the FMUs in fmus/ contain the files that their sources import"),
        ):
            if is_given:
                raise InputError(f"{option} requires --output: {reason}")
        build(files or None, root, _print_built)
    return 0


def _build_one(
    sources: Sequence[tuple[Path, str | None]],
    output: Path,
    fmi_version: int,
    include: tuple[Path, ...],
    library: tuple[Path, ...],
    values: Texts,
) -> None:
    from ...export.build import build_to
    from ...scenario.settings import parse_settings

    if len(sources) != 1:
        raise InputError(f"an FMU of your own requires one source, found {len(sources)}")
    if output.suffix != ".fmu":
        raise InputError(
            f'--output: expected the name of an FMU; found "{output}"; did you mean "{output}.fmu"?'
        )
    source, member = sources[0]
    if not source.exists():
        raise InputError(Problem(f"does not exist{nearest_file(source)}", str(source)))
    build_to(
        source,
        member,
        output,
        fmi_version=fmi_version,
        include=include,
        library_path=library,
        values=parse_settings(values),
    )
    click.echo(f"{source}{f':{member}' if member else ''} -> {output}")


def _print_built(built: BuildResult) -> None:
    names = ", ".join(
        path.as_posix()[path.as_posix().rindex("fmus/") :] for path in built.fmus.values()
    )
    source, here = built.source, Path.cwd()
    source = source.relative_to(here) if source.is_relative_to(here) else source
    click.echo(f"{source} -> {names}")
