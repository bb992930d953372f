"""`cosim new vehicle`: the data of a vehicle, as a copy of a shipped vehicle file."""

import json
import re
import shlex
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import click

from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean
from ...scenario.json_document import Document, read_document
from ..options import new_file_options, path_option, refuse_existing

_Result = TypeVar("_Result")

#: keys that a scenario or a study has, and a vehicle file has not
_SCENARIO_KEYS = frozenset({"components", "extends", "scenario"})


@click.command()
@click.argument("name")
@click.option(
    "--from",
    "base",
    required=True,
    metavar="VEHICLE",
    help="Vehicle file, or name of a shipped vehicle.",
)
@new_file_options()
@path_option(
    "--urdf",
    help=(
        "URDF file with the mass, inertia and collision shape, unless the file of --from has them."
    ),
)
@path_option(
    "--mesh",
    help=(
        "STL, OBJ or GLB file with the shape: inertia for an even density, convex collision "
        "pieces, appearance. Requires the extra mesh."
    ),
)
@click.option(
    "--mesh-scale",
    default=1.0,
    help="Factor on the coordinates of --mesh, for example 0.001 for mm.",
)
def vehicle(
    name: str,
    base: str,
    directory: Path,
    urdf: Path | None,
    mesh: Path | None,
    mesh_scale: float,
    force: bool,
) -> None:
    """Create NAME.json, a copy of a vehicle file.

    Change its numbers, and name it in a scenario as "model".

    The file contains geometry, mass and coefficients with their units and sources. No compiler is
    needed. With --urdf, the rotors, thrusters or propellers in the file of --from may have a "link"
    of the URDF file in place of position and axis.
    """
    from ...results.files import write_file

    if not re.fullmatch(r"[A-Za-z_]\w*", name):
        raise InputError(f'"{name}" is not a name of a vehicle: expected letters, digits and "_"')
    file, source = directory / f"{name}.json", read_document(_find_vehicle(base))
    refuse_existing([file], force)
    data, balance, parameters, warnings = _vehicle(source, name, urdf, mesh, mesh_scale)
    text = json.dumps(data, indent=4) + "\n" if urdf or mesh else source.text
    write_file(file, text)
    for warning in warnings:
        click.echo(f"WARNING {warning}", err=True)
    has_own_hull = bool(urdf or mesh) and data["family"] == "surface_vessel"
    build = shlex.join(["cosim", "build", str(file), "--output", str(file.with_suffix(".fmu"))])
    click.echo(
        f"{file}: {balance}\n\n{_use(file, base, parameters, has_own_hull)}As an FMU:\n  {build}"
    )


def _vehicle(
    source: Document, name: str, urdf: Path | None, mesh: Path | None, mesh_scale: float
) -> tuple[Mapping[str, Any], str, Mapping[str, Any], list[str]]:
    """Return the data of a vehicle file with those of a URDF file or mesh.

    Also mass, inertia, centre of mass and performance in words, the parameters of its controller,
    and warnings.

    Raises:
        InputError: A scenario would refuse the data; each problem names the file and the place in
            it.
    """
    from ...export.plant import examine_vehicle, vehicle_from_mesh, vehicle_from_urdf

    if source.problems or not isinstance(source.value, dict):
        raise InputError(
            source.problems
            or [Problem("expected a JSON object with the data of a vehicle", str(source.file))]
        )
    data, balance, warnings = source.value, "", list[str]()

    def located(problem: Problem) -> Problem:
        # keys that were imported are in the file from which they were imported
        imported = dict.fromkeys(data.keys() - source.value.keys(), urdf or mesh)
        return _located(problem, source, imported)

    try:
        for file in filter(None, (urdf, mesh)):
            read = (
                vehicle_from_urdf(file, data)
                if file is urdf
                else vehicle_from_mesh(file, data, mesh_scale)
            )
            data, warnings = read[0], [*warnings, *read[2]]
            centre = ", ".join(f"{round(coordinate, 9) + 0.0:.4g}" for coordinate in read[1])
            balance += f", centre of mass [{centre}] m in {file.name}"
        mass, inertia, parameters, found, performance = examine_vehicle(data, name)
    except InputError as error:
        raise InputError(list(map(located, error.problems))) from None
    balance = f"mass {mass:.4g} kg, inertia {inertia} kg.m2{balance}"
    balance += "".join(f"\n  {key:<12} {text}" for key, text in performance.items())
    warnings += [str(located(problem)) for problem in found]
    return data, balance, parameters, warnings


def _located(problem: Problem, source: Document, imported: Mapping[str, Path | None]) -> Problem:
    """Return a problem of the data with its place in the vehicle file or in the imported file."""
    path = problem.subject[1:]
    if problem.subject[:1] != ("arguments",):
        return problem
    if path and path[0] in imported:
        return Problem(problem.message, f"{imported[path[0]]}: {'.'.join(path)}")
    return Problem(problem.message, source.where(path))


def _use(file: Path, base: str, parameters: Mapping[str, Any], has_own_hull: bool) -> str:
    """Return how to use the vehicle in a scenario.

    The controllers of Demo 1 fly multirotors like the AR.Drone only.
    """
    if base == "ar_drone":
        setting = f"/components/plant/arguments/vehicles/uav/model={file}"
        return f"Fly Demo 1 with it:\n  cosim run demo1_box --set {shlex.quote(setting)}\n"
    text = f'Name it in a scenario, as a vehicle of the plant:\n  {{"model": "{file}", ...}}\n'
    if parameters:
        lines = ",\n".join(f'    "{key}": {json.dumps(value)}' for key, value in parameters.items())
        text += "multirotor_controller.fmu flies it with these parameters (see crazyflie_square):\n"
        text += f'  "parameters": {{\n{lines}}}\n'
    if has_own_hull:
        text += (
            "The imported shape is drawn and collides. Buoyancy, waves and drag act on the "
            'dimensions in "hull".\n'
        )
    return text


def _find_vehicle(base: str) -> Path:
    """Return the path of a vehicle file, given by its path or the name of a shipped vehicle."""
    from ...export.fmu_sources import vehicle_files

    if base.endswith(".json"):
        if not (path := Path(base)).is_file():
            raise InputError(f'file "{base}" does not exist')
        return path
    if Path(base).is_file():
        raise InputError(
            Problem("expected a vehicle file (.json); --urdf and --mesh read other files", base)
        )
    files = vehicle_files(resources.root())
    if base not in files:
        raise InputError(
            f'no vehicle file and no shipped vehicle "{base}"{did_you_mean(base, files)}'
        )
    return files[base]


def read_vehicle_file(file: Path, read: Callable[[Mapping[str, Any], str], _Result]) -> _Result:
    """Return the result of `read` for the data in a vehicle file and the name of the file.

    Raises:
        InputError: The file is no vehicle file; each problem names file, line and column.
    """
    document = read_document(file)
    if document.problems:
        raise InputError(document.problems)
    if not isinstance(document.value, dict):
        raise InputError(Problem("expected an object, the data of a vehicle", document.where(())))
    if "family" not in document.value and not _SCENARIO_KEYS.isdisjoint(document.value):
        raise InputError(
            f"{file} is a scenario or a study, expected a vehicle file; `cosim check {file}` "
            "describes a scenario"
        )
    try:
        return read(document.value, file.stem)
    except InputError as error:
        raise InputError(
            [replace(each, where=document.where(each.subject[1:])) for each in error.problems]
        ) from None
