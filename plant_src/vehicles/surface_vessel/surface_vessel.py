"""Floating vessels in six degrees of freedom: the reader of their data, and their variables.

One hull or two, whose strips the surface of the water cuts.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import Problem

from ..common.interface import (
    EXTERNAL_LOADS,
    FLOATING_INITIAL_PARAMETERS,
    FLOATING_INPUTS,
    VESSEL_OUTPUTS,
    VESSEL_STATES,
    WAVE_PARAMETERS,
    attribute_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    matrix_parameter,
)
from ..common.shapes import Body, Boxes, inertia_problems
from ..vessel import boat as boat_data
from ..vessel.actuators import actuator_inputs, actuator_parameters
from ..vessel.boat import Boat, BoatReader, boat_parameters

#: stations of both hulls from bow to stern (spacings), and their sides
_STATIONS = np.tile([2.0, 1.0, 0.0, -1.0, -2.0], 2)
_SIDES = np.repeat([1.0, -1.0], 5)

#: steps of the iteration for the equilibrium
_ITERATIONS = 200


@dataclass(frozen=True)
class HullForm:
    """Form of one hull or of two equal ones (`vessel/strips.py`).

    Attributes:
        count: Number of hulls, 1 or 2.
        length: Length of the waterline (m).
        beam: Beam of each hull (m).
        offset: Distance of the centre lines of two hulls from the middle (m).
        depth: Height of the hulls from the bottom to the deck edge (m).
        bottom: Height of the bottom above O (m).
        waterplane_centre: Centre of the waterplane ahead of O (m).
        waterplane_coefficient: Area of the waterplane of a hull over length times beam.
        transverse_moment: Second moment of the waterplane about the x axis (m4).
        longitudinal_moment: Second moment about the y axis through its centre (m4).
        vertical_drag_coefficient: Drag coefficient of the bottoms.
        cross_flow_drag_coefficient: Drag coefficient of the immersed sides in cross-flow.
    """

    count: int
    length: float
    beam: float
    offset: float
    depth: float
    bottom: float
    waterplane_centre: float
    waterplane_coefficient: float
    transverse_moment: float
    longitudinal_moment: float
    vertical_drag_coefficient: float = 0.0
    cross_flow_drag_coefficient: float = 0.0

    @property
    def area(self) -> float:
        """Area of the waterplane of all hulls (m2)."""
        return self.count * self.waterplane_coefficient * self.length * self.beam

    @property
    def strip_beam(self) -> float:
        """Beam of a strip (m): two strips side by side cover a single hull."""
        return self.beam / (3 - self.count)

    @property
    def drag_point_ahead(self) -> float:
        """Distance ahead of the four points at which the bottom drag acts (m)."""
        return self.length / 12**0.5

    @property
    def drag_point_abeam(self) -> float:
        """Distance of these points to port (m)."""
        return self.offset if self.count == 2 else self.beam / 12**0.5


@dataclass(frozen=True, kw_only=True)
class SurfaceVessel(Boat):
    """A vessel in six degrees of freedom.

    Attributes:
        inertia: Inertia tensor about the centre of mass (kg m2, body frame), shape (3, 3).
        quadratic_damping: Matrix D_q of the load -D_q (|nu_r| nu_r), products by elements, shape
            (6, 6).
        hull: Form of the hulls.
    """

    inertia: np.ndarray
    quadratic_damping: np.ndarray
    hull: HullForm

    @property
    def draught(self) -> float:
        """Mean draught of boxes with the waterplane of the hulls (m)."""
        return self.mass / self.water_density / self.hull.area

    @property
    def metacentric_heights(self) -> tuple[float, float]:
        """Transverse and longitudinal metacentric height (m)."""
        volume = self.mass / self.water_density
        lever = self.hull.bottom + self.draught / 2 - self.centre_of_mass[2]
        return (
            lever + self.hull.transverse_moment / volume,
            lever + self.hull.longitudinal_moment / volume,
        )

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from super().problems()
        yield from (self.problem(text, "inertia") for text in inertia_problems(self.inertia))
        if (np.diag(self.quadratic_damping) < 0).any():
            diagonal = np.diag(self.quadratic_damping).tolist()
            text = f"found the diagonal {diagonal}, expected numbers of at least 0"
            yield self.problem(text, "quadratic_damping")
        if not self.draught < self.hull.depth:
            text = (
                f"found {self.hull.depth:g}: the vessel sinks, because its draught at rest is "
                f"{self.draught:.4g} m"
            )
            yield self.problem(text, "hull", "depth")
        elif not min(self.metacentric_heights) > 0:
            yield self.problem(self._instability(), "centre_of_mass")
        elif text := self._imbalance():
            yield self.problem(text, "centre_of_mass")

    def _instability(self) -> str:
        """Return what would make the vessel stable.

        The height of the centre of mass, or else the moment of the waterplane.
        """
        (transverse, longitudinal), z = self.metacentric_heights, self.centre_of_mass[2]
        lower = min(transverse, longitudinal)
        key = "longitudinal_moment (length)"
        if transverse == lower:
            key = "transverse_moment (beam, offset)"
        return (
            f"found z = {z:g} m: the vessel is not stable: its metacentric heights (transverse, "
            f"longitudinal) are {transverse:.4g}, {longitudinal:.4g} m, expected > 0: z must be "
            f"below {z + lower:.4g} m, or hull.{key} larger"
        )

    def _imbalance(self) -> str:
        """Return why the vessel does not rest with its deck above the water; "" if it does."""
        x, y, _ = self.centre_of_mass
        if x == self.hull.waterplane_centre and y == 0:
            return ""
        found = (
            f"found {x - self.hull.waterplane_centre:g} m ahead of the centre of the waterplane "
            f"and {y:g} m to port"
        )
        if (attitude := rest(self)) is None:
            return f"{found}: the vessel capsizes"
        if attitude.freeboard > 0:
            return ""
        heel, trim = math.degrees(attitude.heel), math.degrees(attitude.trim)
        return (
            f"{found}: at rest it heels by {heel:.3g} and trims by {trim:.3g} degrees, a deck edge "
            "is under water"
        )

    def body(self, boxes: Boxes) -> Body:
        """Return the rigid body for Bullet, whose frame has its origin in O.

        Products of inertia have no influence on contact.
        """
        x, y, z = np.diag(self.inertia).tolist()
        return Body(self.mass, (x, y, z), boxes(np.eye(3)))


class Rest(NamedTuple):
    """Attitude of a vessel at rest.

    Attributes:
        heel: Heel (rad), positive to starboard.
        trim: Trim (rad), positive by the bow.
        freeboard: Height of the lowest deck edge above the water (m).
    """

    heel: float
    trim: float
    freeboard: float


def rest(vessel: SurfaceVessel) -> Rest | None:
    """Return the attitude at rest on calm water.

    None if the vessel has none, so that it capsizes. Boxes at the stations give the buoyancy, as in
    the equations (`vessel/strips.py`). Newton's method with the stiffness of the upright hull and
    half of each step finds the height, roll and pitch at which it balances the weight.
    """
    hull = vessel.hull
    middle, centre = hull.bottom + hull.depth / 2, np.array(vessel.centre_of_mass)
    spacing = math.sqrt(hull.longitudinal_moment / hull.area / 2)
    offset = math.sqrt(hull.transverse_moment / hull.area)
    points = np.column_stack(
        [hull.waterplane_centre + spacing * _STATIONS, offset * _SIDES, np.full(10, middle)]
    )
    strip_mass = vessel.water_density * hull.area * hull.depth / 10
    height, roll, pitch = -hull.bottom - vessel.draught, 0.0, 0.0
    for _ in range(_ITERATIONS):
        up = np.array(
            [-math.sin(pitch), math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch)]
        )
        extent = max(hull.depth * abs(up[2]), hull.strip_beam * abs(up[1]), spacing * abs(up[0]))
        share = np.clip(0.5 - (height + points @ up) / extent, 0, 1)
        lifted = points.copy()
        lifted[:, 2] += hull.depth**2 * up[2] / extent / 2 * (share - 1)
        force = strip_mass * share.sum() - vessel.mass
        middle_of_plane = np.array([hull.waterplane_centre, 0, 0])
        lever = strip_mass * share @ lifted - vessel.mass * centre - force * middle_of_plane
        turn = np.cross(lever, up)[:2] / (vessel.mass * np.array(vessel.metacentric_heights))
        height += (
            force / (vessel.water_density * hull.area) + hull.waterplane_centre * turn[1]
        ) / 2
        roll, pitch = roll + turn[0] / 2, pitch + turn[1] / 2
        if not max(abs(roll), abs(pitch)) < math.pi / 3:
            return None
    deck = hull.bottom + hull.depth
    half_width = hull.offset + hull.beam / 2
    freeboard = math.inf
    for ahead, side in product((-1, 1), repeat=2):
        x = hull.waterplane_centre + ahead * hull.length / 2
        corner = (x, side * half_width, deck)
        freeboard = min(freeboard, height + float(np.dot(corner, up)))
    return Rest(roll, pitch, freeboard)


#: required keys of the file
KEYS = (*boat_data.KEYS, "inertia", "hull")
_OPTIONAL_KEYS = (*boat_data.OPTIONAL_KEYS, "quadratic_damping")
#: required and optional keys of "hull"
HULL_KEYS = ("count", "length", "beam", "depth", "bottom")
_DRAG_KEYS = ("vertical_drag_coefficient", "cross_flow_drag_coefficient")
_HULL_OPTIONAL_KEYS = (
    "offset",
    "waterplane_centre",
    "waterplane_coefficient",
    "transverse_moment",
    "longitudinal_moment",
    *_DRAG_KEYS,
)


class SurfaceVesselReader(BoatReader[SurfaceVessel]):
    """Reader of the data of a floating vessel (`plant_src/vehicles/data/README.md`)."""

    keys, optional_keys, vehicle_class = KEYS, _OPTIONAL_KEYS, SurfaceVessel
    velocities = ("u", "v", "w", "p", "q", "r")

    def read_values(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Read the attributes of the vessel, and the collision shape."""
        return {
            **self.read_boat(data, self.read_boxes(data)),
            "inertia": self.read_inertia(data),
            "quadratic_damping": self.read_nu_matrix(data, "quadratic_damping", [0.0] * 6),
            "hull": self.read_hull(data.get("hull")),
        }

    def read_hull(self, value: Any) -> HullForm:
        """Read the form of the hulls."""
        data = self.read_data(value, path := ("hull",), HULL_KEYS, _HULL_OPTIONAL_KEYS)
        length, beam, depth = (
            self.entry(data, key, "m", path=path, above=0.0) for key in ("length", "beam", "depth")
        )
        count = self.integer(data.get("count", 1), (*path, "count"), 1, 2)
        if count == 2 and "offset" not in data:
            self.add_problem(path, '"offset" is missing: two hulls have a distance from the middle')
        offset = self.entry(data, "offset", "m", 0.0, path, low=0.0) if count == 2 else 0.0
        fullness = self.entry(data, "waterplane_coefficient", "1", 1.0, path, low=0.01, high=1.0)
        if count == 2 and "offset" in data and 2 * offset < beam:
            overlap = f"found {offset:g}: the hulls overlap"
            expected = f"expected at least half of the beam, {beam / 2:g}"
            self.add_problem((*path, "offset"), f"{overlap}, {expected}")
        area = count * fullness * length * beam
        defaults = {
            "transverse_moment": (area * (offset**2 + beam**2 / 12), offset + beam / 2),
            "longitudinal_moment": (fullness * area * length**2 / 12, length / 2),
        }
        moments = {}
        for key, (default, reach) in defaults.items():
            moments[key] = self.entry(data, key, "m4", default, path, above=0.0)
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
            bottom=self.entry(data, "bottom", "m", 0.0, path),
            waterplane_centre=self.entry(data, "waterplane_centre", "m", 0.0, path),
            waterplane_coefficient=fullness,
            **moments,
            **{key: self.entry(data, key, "1", 0.0, path, low=0.0) for key in _DRAG_KEYS},
        )


_INITIAL_PARAMETERS = (*initial_variables("xy", "uvw", "pqr"), *FLOATING_INITIAL_PARAMETERS)


def variables(vessel: SurfaceVessel, slots: tuple[int, int] | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs, in the order of the equations.

    Parameters other than `initial.*` start at the values of the vessel.

    Args:
        vessel: Data of the vessel.
        slots: Numbers of elements of the arrays of propellers and rudders. None means the numbers
            of the vessel.
    """
    slots = slots or vessel.slots
    velocities = "u, v, w, p, q, r"
    return (
        *_INITIAL_PARAMETERS,
        *inertia_variables(vessel.mass, vessel.inertia, "total mass"),
        *boat_parameters(vessel, velocities),
        matrix_parameter(
            "quadratic_damping",
            f"load over squared velocity relative to the water, for {velocities}",
            vessel.quadratic_damping,
        ),
        *attribute_parameters(vessel.hull, _HULL_PARAMETERS),
        *actuator_parameters(vessel.propellers, vessel.rudders, slots),
        *WAVE_PARAMETERS,
        *EXTERNAL_LOADS,
        *actuator_inputs(vessel.propellers, vessel.rudders, slots),
        *FLOATING_INPUTS,
        *VESSEL_OUTPUTS,
    )


#: attribute, and name, unit, smallest value and description of its parameter
_HULL_PARAMETERS = (
    ("area", "waterplane_area", "m2", 0.0, "area of the waterplane of all hulls"),
    (
        "transverse_moment",
        "transverse_moment",
        "m4",
        0.0,
        "second moment of the waterplane about the x axis",
    ),
    (
        "longitudinal_moment",
        "longitudinal_moment",
        "m4",
        0.0,
        "second moment of the waterplane about the y axis through its centre",
    ),
    ("waterplane_centre", "waterplane_centre", "m", None, "centre of the waterplane ahead of O"),
    (
        "strip_beam",
        "strip_beam",
        "m",
        0.0,
        "beam of a strip: of each of two hulls, half of that of a single one",
    ),
    ("length", "hull_length", "m", 0.0, "length of the waterline"),
    ("depth", "hull_depth", "m", 0.0, "height of the hulls from the bottom to the deck edge"),
    ("bottom", "hull_bottom", "m", None, "height of the bottom of the hulls above O"),
    (
        "drag_point_ahead",
        "drag_point.x",
        "m",
        0.0,
        "distance of the points of the bottom drag ahead and aft of the waterplane's centre",
    ),
    (
        "drag_point_abeam",
        "drag_point.y",
        "m",
        0.0,
        "distance of the points of the bottom drag from the centre line",
    ),
    (
        "vertical_drag_coefficient",
        "vertical_drag_coefficient",
        "1",
        0.0,
        "drag coefficient of the bottoms",
    ),
    (
        "cross_flow_drag_coefficient",
        "cross_flow_drag_coefficient",
        "1",
        0.0,
        "drag coefficient of the immersed sides in cross-flow",
    ),
)


def states(propeller_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of a vessel, then the propeller speeds."""
    return (*VESSEL_STATES, *element_states("propeller_speed", propeller_slots))
