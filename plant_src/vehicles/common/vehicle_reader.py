"""Readers of vehicle data: quantities, triangles, and what the files of all families share.

A quantity is a number, or a list of numbers, in SI units, or an object that also states unit and
source:

    "mass": 0.5
    "mass": {"value": 500, "unit": "g", "source": "weighed"}
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from cosim.core.errors import InputError, Problem, abbreviate_names
from cosim.core.json_values import JsonObject
from cosim.core.units import KNOWN_UNITS, PREFIXED, Unit, parse_unit

from ...json_reader import JsonPath, JsonReader, Numbers
from .shapes import (
    BODY_UP,
    Body,
    Boxes,
    ConvexPiece,
    Shape,
    Vector,
    inertia_problems,
    level_box,
    principal_axes,
    quaternion_from_matrix,
)

#: keys that every object of vehicle data may have; they are texts for the reader of the file
TEXT_KEYS = ("source", "note")

#: hint for an angle of more than a turn
RADIANS_EXPECTED = 'radians expected; in degrees? Write {"value": 90, "unit": "deg"}'


class QuantityReader(JsonReader):
    """Reader of vehicle data, which collects all problems."""

    def read_data(
        self, value: Any, path: JsonPath, required: Sequence[str], optional: Sequence[str]
    ) -> JsonObject:
        """Read an object with these keys, those of TEXT_KEYS and no others."""
        found = self.read_object(value, path, required, (*optional, *TEXT_KEYS))
        for key in TEXT_KEYS:
            if key in found:
                self.text(found[key], (*path, key))
        return found

    def text(self, value: Any, path: JsonPath) -> str:
        """Read a text."""
        if not isinstance(value, str):
            self.add_problem(path, f"found {value!r}, expected a text")
            return ""
        return value

    def si_value(self, value: Any, path: JsonPath, unit: str) -> Any:
        """Return a quantity without its unit and source, in SI units.

        The numbers themselves are not checked.

        Args:
            value: The quantity.
            path: Its path.
            unit: SI unit of the result.
        """
        if not isinstance(value, Mapping):
            return value
        self.read_data(value, path, ("value",), ("unit",))
        factor = (
            self._factor(value["unit"], (*path, "unit"), parse_unit(unit))
            if "unit" in value
            else 1.0
        )
        return _scaled(value.get("value", math.nan), factor)

    def _factor(self, name: Any, path: JsonPath, expected: Unit) -> float:
        try:
            found = parse_unit(name)
        except (TypeError, ValueError, AttributeError):
            self.add_problem(path, f"found {name!r}, expected a unit such as {_offered(expected)}")
            return 1.0
        if found.exponents != expected.exponents or found.offset != expected.offset:
            self.add_problem(
                path, f"found {name!r}, expected a unit that converts to {_offered(expected)}"
            )
            return 1.0
        return found.factor / expected.factor

    def quantity(
        self,
        value: Any,
        path: JsonPath,
        unit: str,
        low: float = -math.inf,
        high: float = math.inf,
        above: float | None = None,
    ) -> float:
        """Read a quantity from `low` to `high` (in SI units), and greater than `above`."""
        number = self.si_value(value, path, unit)
        found = self.number(number, path, low, high, _angle_hint(value, unit))
        if above is not None and not found > above:
            self.add_problem(path, f"found {number!r}, expected a number greater than {above:g}")
        return found

    def entry(
        self,
        data: JsonObject,
        key: str,
        unit: str,
        default: float = 1.0,
        path: JsonPath = (),
        **limits: float,
    ) -> float:
        """Read the quantity of a key.

        Args:
            data: Object that has the key.
            key: The key.
            unit: SI unit of the result.
            default: Value if the key is missing.
            path: Path of the object.
            **limits: See `quantity`.
        """
        return self.quantity(data.get(key, default), (*path, key), unit, **limits)

    def vector_quantity(
        self, value: Any, path: JsonPath, unit: str, axes: Sequence[str]
    ) -> Numbers:
        """Read a list of one quantity for each of `axes` (in SI units)."""
        return self.vector(self.si_value(value, path, unit), path, axes)

    def read_vector(
        self,
        data: JsonObject,
        key: str,
        unit: str = "m",
        default: Sequence[float] = (0.0, 0.0, 0.0),
        path: JsonPath = (),
        minimum: float = -math.inf,
    ) -> Vector:
        """Read the quantities of a key along x, y and z; see `entry`."""
        x, y, z = self.vector_quantity(data.get(key, list(default)), (*path, key), unit, "xyz")
        if min(x, y, z) < minimum:
            text = f"found {[x, y, z]}, expected numbers of at least {minimum:g}"
            self.add_problem((*path, key), text)
        return x, y, z

    def read_size(self, data: JsonObject, path: JsonPath, default: Sequence[float]) -> Vector:
        """Read the edges "size" of a box (m)."""
        size = self.read_vector(data, "size", "m", default, path)
        if not min(size) > 0:
            text = f"found {list(size)}, expected edges greater than 0"
            self.add_problem((*path, "size"), text)
        return size

    def read_matrix(
        self,
        value: Any,
        path: JsonPath,
        axes: Sequence[str],
        unit: str = "1",
        diagonal: Sequence[str] = (),
    ) -> np.ndarray:
        """Read the diagonal of a square matrix, or its rows.

        Args:
            value: Numbers of the diagonal, or rows, as a quantity.
            path: Path of the value.
            axes: Names of the elements of a row.
            unit: SI unit of the result.
            diagonal: Names of the elements of the diagonal if they differ.
        """
        numbers = self.si_value(value, path, unit)
        is_list = isinstance(numbers, list) and len(numbers) == len(axes)
        if is_list and all(isinstance(row, list) for row in numbers):
            rows = [self.vector(row, (*path, str(i)), axes) for i, row in enumerate(numbers)]
            return np.array(rows)
        return np.diag(self.vector(numbers, path, diagonal or axes))


def _angle_hint(value: Any, unit: str) -> str:
    """Return a hint for an angle without a unit that is more than a turn; "" for anything else."""
    number = value.get("value") if isinstance(value, Mapping) and "unit" not in value else value
    is_large = unit == "rad" and isinstance(number, int | float) and abs(number) > 2 * math.pi
    return f": {RADIANS_EXPECTED}" if is_large else ""


def _offered(unit: Unit) -> str:
    """Return the name of a unit, and those of the other known units of the same quantity."""
    prefixed = [f"{prefix}{unit.name}" for prefix in "mk" if unit.name in PREFIXED]
    others = [
        name
        for name, known in KNOWN_UNITS.items()
        if known.exponents == unit.exponents and name != unit.name
    ]
    return abbreviate_names(map(repr, (unit.name, *prefixed, *others)))


def _scaled(value: Any, factor: float) -> Any:
    """Return a number, or nested lists of numbers, times a factor.

    Anything else is returned as it is.
    """
    if factor == 1.0:
        return value
    if isinstance(value, list | tuple):
        return [_scaled(each, factor) for each in value]
    return (
        value * factor if isinstance(value, int | float) and not isinstance(value, bool) else value
    )


#: sense of rotation seen from the tip of the thrust's axis -> sign of the reaction torque about
#: this axis
TORQUE_SIGNS = {"clockwise": 1.0, "counter-clockwise": -1.0}

#: largest number of triangles
MAX_TRIANGLES = 20_000


def read_visual(data: JsonObject) -> np.ndarray | None:
    """Return the triangles of the key "visual" (m, body frame), or None without this key.

    Args:
        data: Vehicle data; "visual" is {"vertices": [[x, y, z], ...], "faces": [[a, b, c], ...]},
            vertices counted from 0.

    Returns:
        Corners of the triangles, shape (n, 3, 3).

    Raises:
        InputError: If the mesh is invalid; the subject is the path of the value.
    """
    if "visual" not in data:
        return None
    reader = JsonReader()
    triangles = read_triangles(reader, data["visual"], ("visual",))
    if reader.problems:
        raise InputError(reader.problems)
    return triangles


def read_triangles(reader: JsonReader, value: Any, path: JsonPath) -> np.ndarray | None:
    """Read {"vertices": [[x, y, z], ...], "faces": [[a, b, c], ...]}.

    Return triangles (n, 3, 3), None if they are invalid.
    """
    mesh = reader.read_object(value, path, ("vertices", "faces"), ("source", "note"))
    try:
        vertices = np.array(mesh.get("vertices"), np.float64)
        faces = np.array(mesh.get("faces"), np.int64)
    except (TypeError, ValueError):
        vertices, faces = np.zeros(0), np.zeros(0, np.int64)
    lists = (
        vertices.ndim == faces.ndim == 2
        and vertices.shape[1] == faces.shape[1] == 3
        and np.isfinite(vertices).all()
    )
    text = (
        f"expected vertices [[x, y, z], ...] and 1 to {MAX_TRIANGLES} faces [[a, b, c], ...] of "
        "them"
    )
    if (
        not lists
        or not 0 < len(faces) <= MAX_TRIANGLES
        or not (0 <= faces.min() <= faces.max() < len(vertices))
    ):
        reader.add_problem(path, text)
        return None
    triangles: np.ndarray = vertices[faces]
    return triangles


@dataclass(frozen=True)
class Vehicle:
    """A vehicle that is given by data.

    Attributes:
        kind: Kind of vehicle, for messages.
        name: Name of the model.
        mass: Total mass (kg).

    Raises:
        InputError: For physically impossible values, all together; a problem's subject begins with
            the name of the attribute.
    """

    kind: ClassVar[str]
    name: str
    mass: float

    def __post_init__(self) -> None:
        if problems := list(self.problems()):
            raise InputError(problems)

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from self.size_problems("mass")

    def size_problems(self, *names: str) -> Iterator[Problem]:
        """Yield a problem for each of the attributes that is not finite or not greater than 0."""
        for name in names:
            if not 0 < (value := getattr(self, name)) < math.inf:
                text = f"found {value!r}, expected a finite number greater than 0"
                yield self.problem(text, name)

    def problem(self, text: str, *subject: str) -> Problem:
        """Return a problem of an attribute."""
        return Problem(text, f"{self.kind} {self.name}: {'.'.join(subject)}", subject)

    def body(self, boxes: Boxes) -> Body:
        """Return the rigid body for Bullet with this collision shape."""
        raise NotImplementedError


@dataclass(frozen=True)
class FreeVehicle(Vehicle):
    """A vehicle that moves freely in six degrees of freedom.

    Attributes:
        inertia: Inertia tensor about the centre of mass (kg m2, body frame), shape (3, 3); that of
            a multirotor has locked rotors.
    """

    inertia: np.ndarray

    def body(self, boxes: Boxes) -> Body:
        """Return the rigid body for Bullet, in its principal axes."""
        moments, to_body = principal_axes(self.inertia)
        x, y, z = moments.tolist()
        axes = quaternion_from_matrix(to_body)
        return Body(self.mass, (x, y, z), boxes(to_body), axes=axes)

    def inertia_problems(self) -> Iterator[Problem]:
        """Yield a problem if no rigid body has this inertia."""
        for text in inertia_problems(self.inertia):
            yield self.problem(text, "inertia")


_Vehicle = TypeVar("_Vehicle", bound=Vehicle)


@dataclass(frozen=True)
class CollisionBox:
    """A box of the collision shape in the body frame.

    Edges and centre (m), and its angle about the z axis (rad).
    """

    size: Vector
    position: Vector
    yaw: float

    def corners(self) -> np.ndarray:
        """Return the corners (m, body frame), shape (8, 3)."""
        x, y, z = (np.array(list(product((-0.5, 0.5), repeat=3))) * self.size).T
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return np.column_stack([cosine * x - sine * y, sine * x + cosine * y, z]) + self.position

    def shape_in(self, to_body: np.ndarray) -> Shape:
        """Return the box in the frame from which `to_body` (3, 3) rotates into the body frame."""
        return level_box(to_body, self.size, self.position, self.yaw)


#: element of "boxes"
Collision = CollisionBox | ConvexPiece


def edges_around(boxes: Sequence[Collision]) -> Vector:
    """Return the edges (m) of the box around all boxes; 1 m if there are none."""
    unit_box = CollisionBox((1.0,) * 3, (0.0,) * 3, 0.0)
    corners = np.concatenate([box.corners() for box in boxes or (unit_box,)])
    length, width, height = np.ptp(corners, axis=0).tolist()
    return length, width, height


@dataclass(frozen=True)
class VehicleData(Generic[_Vehicle]):
    """A vehicle, its collision shape and its crash speed (m/s)."""

    vehicle: _Vehicle
    boxes: tuple[Collision, ...]
    crash_speed: float

    def body(self, **changes: Any) -> Body:
        """Return the rigid body for Bullet with other values of some attributes of the vehicle.

        Raises InputError if these are impossible.
        """
        vehicle = replace(self.vehicle, **changes)
        return vehicle.body(lambda to_body: tuple(box.shape_in(to_body) for box in self.boxes))


class VehicleReader(QuantityReader, Generic[_Vehicle]):
    """Reader of the data of one family of vehicles.

    Attributes:
        keys: Required keys of the file.
        optional_keys: Optional keys, besides those that vehicles of all families have.
        vehicle_class: Class of the vehicles.
    """

    keys: Sequence[str]
    optional_keys: Sequence[str]
    vehicle_class: Callable[..., _Vehicle]

    def read_values(self, data: JsonObject) -> dict[str, Any]:
        """Read the attributes of the vehicle without its name, and its collision shape "boxes"."""
        raise NotImplementedError

    def check(self, vehicle: _Vehicle) -> None:
        """Record what is wrong with a possible vehicle."""

    def read(
        self, name: str, data: JsonObject, common_keys: Sequence[str]
    ) -> VehicleData[_Vehicle]:
        """Read the data of a vehicle.

        Args:
            name: Name of the vehicle.
            data: JSON object (`plant_src/vehicles/data/README.md`).
            common_keys: Keys that vehicles of all families have.

        Raises:
            InputError: With all problems; the subject of each is the path of the value.
        """
        data = self.read_data(data, (), self.keys, (*self.optional_keys, *common_keys))
        values = self.read_values(data)
        boxes = values.pop("boxes")
        crash_speed = self.entry(data, "crash_speed", "m/s", above=0.0)
        if self.problems:
            raise InputError(self.problems)
        try:
            vehicle = self.vehicle_class(name=name, **values)
        except InputError as error:
            for problem in error.problems:
                self.add_problem(problem.subject, problem.message)
            raise InputError(self.problems) from None
        self.check(vehicle)
        if self.problems:
            raise InputError(self.problems)
        return VehicleData(vehicle, boxes, crash_speed)

    def source_of(
        self, key: str, data: JsonObject, path: JsonPath, common: JsonObject, of: str
    ) -> tuple[JsonObject, JsonPath]:
        """Return the object that states a key of an element, and its path.

        Values of an element at `path` replace those of the object `common` of all elements, whose
        key is `of`.
        """
        return (data, path) if key in data else (common, (of,))

    def read_label(self, data: JsonObject, path: JsonPath, kind: str) -> str:
        """Read the label of an element; by default its kind and number."""
        return self.text(data.get("label", f"{kind} {int(path[-1]) + 1}"), (*path, "label"))

    def elements(self, data: JsonObject, key: str) -> list[tuple[JsonPath, Any]]:
        """Read a list with at least one element; return its elements with their paths."""
        value = data.get(key, [{}])
        if not isinstance(value, list) or not value:
            self.add_problem((key,), f"found {value!r}, expected a list with at least one element")
            return []
        return [((key, str(i)), each) for i, each in enumerate(value)] if key in data else []

    def read_inertia(self, data: JsonObject) -> np.ndarray:
        """Read three moments of inertia, or three rows of a tensor."""
        value = data.get("inertia", [1.0] * 3)
        return self.read_matrix(value, ("inertia",), "xyz", "kg.m2", ("xx", "yy", "zz"))

    def read_axis(self, value: Any, path: JsonPath) -> Vector:
        """Read the direction of a thrust and return it as a unit vector."""
        x, y, z = self.vector_quantity(value, path, "1", "xyz")
        length = math.hypot(x, y, z)
        if not length:
            self.add_problem(path, "found the zero vector, expected a direction")
            return BODY_UP
        return x / length, y / length, z / length

    def read_boxes(self, data: JsonObject) -> tuple[Collision, ...]:
        """Read the collision shape."""
        return tuple(self.read_box(box, path) for path, box in self.elements(data, "boxes"))

    def read_box(self, value: Any, path: JsonPath) -> Collision:
        """Read one box or convex piece of the collision shape."""
        if isinstance(value, Mapping) and "points" in value:
            return self.read_piece(
                self.read_data(value, path, ("points",), ()).get("points"), (*path, "points")
            )
        data = self.read_data(value, path, ("size",), ("position", "yaw"))
        size = self.read_size(data, path, (1.0, 1.0, 1.0))
        position = self.read_vector(data, "position", path=path)
        turn = 2 * math.pi
        yaw = self.entry(data, "yaw", "rad", 0.0, path, low=-turn, high=turn)
        return CollisionBox(size, position, yaw)

    def read_piece(self, value: Any, path: JsonPath) -> ConvexPiece:
        """Read the points of a convex piece."""
        numbers = self.si_value(value, path, "m")
        given = numbers if isinstance(numbers, list) else []
        rows = [self.vector(row, (*path, str(i)), "xyz") for i, row in enumerate(given)]
        if len(rows) < 4 or np.linalg.matrix_rank(np.array(rows) - rows[0], tol=1e-9) < 3:
            self.add_problem(
                path, f"found {len(rows)} points, expected at least 4 that do not lie in a plane"
            )
            rows = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        return ConvexPiece(tuple((x, y, z) for x, y, z in rows))
