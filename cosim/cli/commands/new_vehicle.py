"""`cosim new vehicle`: the data of a vehicle, as a copy of a shipped vehicle file."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import click

from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean


@click.command()
@click.argument("name")
@click.option("--from", "base", required=True, metavar="VEHICLE", help="Vehicle file, or name of a shipped vehicle.")
@click.option(
    "--directory", type=click.Path(path_type=Path), default=Path(), help="Folder of the file; default: the working directory."
)
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(name: str, base: str, directory: Path, force: bool) -> None:
    """Create NAME.json, a copy of a vehicle file. Change its numbers, and name it in a scenario as "model".

    The file contains geometry, mass and coefficients with their units and sources. No compiler is needed.
    """
    if not re.fullmatch(r"[A-Za-z_]\w*", name):
        raise InputError(f'"{name}" is not a name of a vehicle: expected letters, digits and "_"')
    file, source = directory / f"{name}.json", _find_vehicle(base)
    if file.exists() and not force:
        raise InputError([Problem("exists; --force overwrites it", str(file))])
    directory.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, file)
    setting = f"/components/plant/arguments/vehicles/uav/model={file}"
    click.echo(
        f"{file}\n\nFly Demo 1 with it:\n  cosim run demo1_box --set {shlex.quote(setting)}\n"
        f"As an FMU:\n  {shlex.join(['cosim', 'build', str(file), '--output', str(file.with_suffix('.fmu'))])}"
    )


def _find_vehicle(base: str) -> Path:
    """Return the path of a vehicle file that is given by its path or by the name of a shipped vehicle."""
    from ...export.sources import find_sources

    if base.endswith(".json"):
        if not (path := Path(base)).is_file():
            raise InputError(f'file "{base}" does not exist')
        return path
    files = {source.name: source.path for source in find_sources(resources.root()) if source.kind.name == "vehicle file"}
    if base not in files:
        raise InputError(f'no vehicle file and no shipped vehicle "{base}"{did_you_mean(base, files)}')
    return files[base]
