"""Reader of the data of a floating vessel: JSON to vessel and collision boxes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.errors import InputError

from ..common.shapes import Body
from ..common.vehicle_reader import Collision, boxes_in
from ..vessel import boat_data
from ..vessel.boat_data import BoatReader
from .surface_vessel import HullForm, SurfaceVessel

#: required keys of the file
KEYS = (*boat_data.KEYS, "inertia", "hull")
_OPTIONAL_KEYS = (*boat_data.OPTIONAL_KEYS, "quadratic_damping")
#: required and optional keys of "hull"
HULL_KEYS = ("count", "length", "beam", "depth", "bottom")
_HULL_OPTIONAL_KEYS = (
    *(
        "offset",
        "waterplane_centre",
        "waterplane_coefficient",
        "transverse_moment",
        "longitudinal_moment",
    ),
    *("vertical_drag_coefficient", "cross_flow_drag_coefficient"),
)
_VELOCITIES = ("u", "v", "w", "p", "q", "r")


@dataclass(frozen=True)
class SurfaceVesselData:
    """Data of a floating vessel: vessel, collision boxes and crash speed (m/s)."""

    vessel: SurfaceVessel
    boxes: tuple[Collision, ...]
    crash_speed: float

    def body_with(self, mass: float, inertia: np.ndarray) -> Body:
        """Return the rigid body for Bullet with another mass (kg) and inertia tensor (kg m2).

        Raises InputError.
        """
        return replace(self.vessel, mass=mass, inertia=inertia).body(
            boxes_in(self.boxes, np.eye(3))
        )


def read_surface_vessel(
    name: str, data: Mapping[str, Any], keys: tuple[str, ...]
) -> SurfaceVesselData:
    """Read the data of a floating vessel.

    Args:
        name: Name of the vehicle.
        data: JSON object (`plant_src/vehicles/data/README.md`).
        keys: Keys that vehicles of all families have.

    Raises:
        InputError: With all problems; the subject of each is the path of the value.
    """
    reader = _SurfaceVesselReader(_VELOCITIES)
    vessel = reader.read_vessel(name, data, keys)
    if reader.problems or vessel is None:
        raise InputError(reader.problems)
    return vessel


class _SurfaceVesselReader(BoatReader):
    def read_vessel(self, name: str, data: Any, keys: tuple[str, ...]) -> SurfaceVesselData | None:
        """Read all data; None if the vessel is impossible."""
        data = self.read_data(data, (), KEYS, (*_OPTIONAL_KEYS, *keys))
        boxes = self.read_boxes(data)
        values: dict[str, Any] = {
            **self.read_boat(data, boxes),
            "inertia": self.read_inertia(data.get("inertia", [1.0] * 3)),
            "quadratic_damping": self.read_matrix(
                data.get("quadratic_damping", [0.0] * 6), ("quadratic_damping",)
            ),
            "hull": self.read_hull(data.get("hull")),
        }
        crash_speed = self.quantity(
            data.get("crash_speed", 1.0), ("crash_speed",), "m/s", above=0.0
        )
        if self.problems:
            return None
        return self.construct(
            lambda: SurfaceVesselData(SurfaceVessel(name=name, **values), boxes, crash_speed)
        )

    def read_hull(self, value: Any) -> HullForm:
        """Read the form of the hulls."""
        data = self.read_data(value, path := ("hull",), HULL_KEYS, _HULL_OPTIONAL_KEYS)
        length, beam, depth = (
            self.quantity(data.get(key, 1.0), (*path, key), "m", above=0.0)
            for key in HULL_KEYS[1:4]
        )
        count = self.integer(data.get("count", 1), (*path, "count"), 1, 2)
        if count == 2 and "offset" not in data:
            self.add_problem(path, '"offset" is missing: two hulls have a distance from the middle')
        offset = (
            self.quantity(data.get("offset", 0.0), (*path, "offset"), "m", low=0.0)
            if count == 2
            else 0.0
        )
        fullness = self.quantity(
            data.get("waterplane_coefficient", 1.0),
            (*path, "waterplane_coefficient"),
            "1",
            0.01,
            1.0,
        )
        if count == 2 and "offset" in data and 2 * offset < beam:
            self.add_problem(
                (*path, "offset"),
                (
                    f"found {offset:g}: the hulls overlap, expected at least half of the beam, "
                    f"{beam / 2:g}"
                ),
            )
        area = count * fullness * length * beam
        moments = {
            "transverse_moment": area * (offset**2 + beam**2 / 12),
            "longitudinal_moment": fullness * area * length**2 / 12,
        }
        reaches = {"transverse_moment": offset + beam / 2, "longitudinal_moment": length / 2}
        for key, reach in reaches.items():
            moments[key] = self.quantity(data.get(key, moments[key]), (*path, key), "m4", above=0.0)
            if not self.problems and moments[key] > (limit := area * reach**2):
                text = (
                    f"found {moments[key]:g}, expected at most {limit:.4g}: area of the waterplane "
                    "times squared half extent"
                )
                self.add_problem((*path, key), text)
        return HullForm(
            count=count,
            length=length,
            beam=beam,
            offset=offset,
            depth=depth,
            bottom=self.quantity(data.get("bottom", 0.0), (*path, "bottom"), "m"),
            waterplane_centre=self.quantity(
                data.get("waterplane_centre", 0.0), (*path, "waterplane_centre"), "m"
            ),
            waterplane_coefficient=fullness,
            **moments,
            **{
                key: self.quantity(data.get(key, 0.0), (*path, key), "1", low=0.0)
                for key in _HULL_OPTIONAL_KEYS[5:]
            },
        )
