"""Export of a vehicle that is given by a file."""

import json
from pathlib import Path
from typing import Any

from cosim.core.errors import InputError, Problem
from cosim.export.fmu.block import Block

from ..catalogue import FAMILIES, model_from_data
from ..vehicles.multirotor.equations import multirotor_block
from ..vehicles.planar_vessel.equations import planar_vessel_block
from ..vehicles.planar_vessel.planar_vessel import PlanarVessel
from ..vehicles.submerged.equations import submerged_block
from ..vehicles.surface_vessel.equations import surface_vessel_block
from ..vehicles.surface_vessel.surface_vessel import SurfaceVessel


def vehicle_block(path: Path) -> Block:
    """Return a vehicle for export.

    Raises:
        InputError: The file is not JSON, or the data are wrong; lists all problems.
    """
    try:
        data: Any = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(Problem(f"cannot be read: {error}", str(path))) from None
    if not isinstance(data, dict) or "family" not in data:
        raise InputError(
            Problem(
                (
                    'is no vehicle file; expected an object with "family", one of: '
                    f"{', '.join(FAMILIES)}"
                ),
                str(path),
            )
        )
    try:
        model = model_from_data(data, path.stem)
    except InputError as error:
        problems = (
            Problem(each.message, f"{path}: {'.'.join(each.subject[1:])}")
            for each in error.problems
        )
        raise InputError(list(problems)) from None
    description = str(data.get("description", model.name))
    if model.airframe:
        return multirotor_block(model.airframe, f"{description} in free flight")
    if isinstance(model.boat, SurfaceVessel):
        return surface_vessel_block(model.boat, f"{description} afloat")
    if isinstance(model.boat, PlanarVessel):
        return planar_vessel_block(model.boat, f"{description} on calm water")
    assert model.craft is not None
    return submerged_block(model.craft, f"{description} in open water")
