"""`cosim new vehicle`: the data of a vehicle, as a copy of a shipped vehicle file."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import click

from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean
from ...core.json_values import parse_object


@click.command()
@click.argument("name")
@click.option("--from", "base", required=True, metavar="VEHICLE", help="Vehicle file, or name of a shipped vehicle.")
@click.option(
    "--directory", type=click.Path(path_type=Path), default=Path(), help="Folder of the file; default: the working directory."
)
@click.option(
    "--urdf",
    type=click.Path(path_type=Path),
    help="URDF file with the mass, inertia and collision shape, unless the file of --from has them.",
)
@click.option(
    "--mesh",
    type=click.Path(path_type=Path),
    help="STL, OBJ or GLB file with the shape: inertia for an even density, convex collision pieces, appearance. "
    "Requires the extra mesh.",
)
@click.option("--mesh-scale", default=1.0, help="Factor on the coordinates of --mesh, for example 0.001 for mm.")
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(name: str, base: str, directory: Path, urdf: Path | None, mesh: Path | None, mesh_scale: float, force: bool) -> None:
    """Create NAME.json, a copy of a vehicle file. Change its numbers, and name it in a scenario as "model".

    The file contains geometry, mass and coefficients with their units and sources. No compiler is needed. With --urdf, the
    rotors, thrusters or propellers in the file of --from may have a "link" of the URDF file in place of position and axis.
    """
    if not re.fullmatch(r"[A-Za-z_]\w*", name):
        raise InputError(f'"{name}" is not a name of a vehicle: expected letters, digits and "_"')
    file, source = directory / f"{name}.json", _find_vehicle(base)
    if file.exists() and not force:
        raise InputError([Problem("exists; --force overwrites it", str(file))])
    directory.mkdir(parents=True, exist_ok=True)
    if urdf or mesh:
        from ...export.sources import vehicle_from_mesh, vehicle_from_urdf

        data = parse_object(source.read_text(encoding="utf-8"))
        data = vehicle_from_urdf(urdf, data) if urdf else data
        data = vehicle_from_mesh(mesh, data, mesh_scale) if mesh else data
        file.write_text(json.dumps(data, indent=4) + "\n", encoding="utf-8")
    else:
        shutil.copyfile(source, file)
    family = parse_object(file.read_text(encoding="utf-8")).get("family")
    build = shlex.join(["cosim", "build", str(file), "--output", str(file.with_suffix(".fmu"))])
    click.echo(f"{file}\n\n{_use(file, base, family)}As an FMU:\n  {build}")


def _use(file: Path, base: str, family: Any) -> str:
    """Return how to use the vehicle in a scenario; the controllers of Demo 1 fly multirotors like the AR.Drone only."""
    if base == "ar_drone":
        setting = f"/components/plant/arguments/vehicles/uav/model={file}"
        return f"Fly Demo 1 with it:\n  cosim run demo1_box --set {shlex.quote(setting)}\n"
    text = f'Name it in a scenario, as a vehicle of the plant:\n  {{"model": "{file}", ...}}\n'
    if family == "multirotor":
        text += "multirotor_controller.fmu flies it; its parameters are mass, inertia and rotors (see crazyflie_square).\n"
    return text


def _find_vehicle(base: str) -> Path:
    """Return the path of a vehicle file that is given by its path or by the name of a shipped vehicle."""
    from ...export.sources import vehicle_files

    if base.endswith(".json"):
        if not (path := Path(base)).is_file():
            raise InputError(f'file "{base}" does not exist')
        return path
    files = vehicle_files(resources.root())
    if base not in files:
        raise InputError(f'no vehicle file and no shipped vehicle "{base}"{did_you_mean(base, files)}')
    return files[base]
