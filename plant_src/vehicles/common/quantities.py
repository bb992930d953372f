"""Reader of the quantities of vehicle data.

A quantity is a number, or a list of numbers, in SI units, or an object that also states unit and
source:

    "mass": 0.5
    "mass": {"value": 500, "unit": "g", "source": "weighed"}
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from cosim.core.errors import abbreviate_names
from cosim.core.unit_table import PREFIXED
from cosim.core.units import KNOWN_UNITS, Unit, parse_unit

from ...json_reader import JsonPath, JsonReader, Numbers

#: keys that every object of vehicle data may have; they are texts for the reader of the file
TEXT_KEYS = ("source", "note")

#: hint for an angle of more than a turn
RADIANS_EXPECTED = 'radians expected; in degrees? Write {"value": 90, "unit": "deg"}'


class QuantityReader(JsonReader):
    """Reader of vehicle data, which collects all problems."""

    def read_data(
        self, value: Any, path: JsonPath, required: Sequence[str], optional: Sequence[str]
    ) -> Mapping[str, Any]:
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

    def vector_quantity(
        self, value: Any, path: JsonPath, unit: str, axes: Sequence[str]
    ) -> Numbers:
        """Read a list of one quantity for each of `axes` (in SI units)."""
        return self.vector(self.si_value(value, path, unit), path, axes)


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
