"""Physical units as FMI defines them: exponents of the SI base units, a factor and an offset.

A value in a unit becomes SI by `si = factor * value + offset` (FMI 2.0 section 2.2.2, FMI 3.0 section 2.4.3).
FMUs bring their own definitions; `parse` reads the Modelica/FMI unit syntax ("kg.m2/s3") for everything else.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True, slots=True)
class Unit:
    """A named unit; two units can be converted if and only if their exponents are equal."""

    name: str
    exponents: tuple[int, ...] = (0,) * len(BASE)
    factor: float = 1.0
    offset: float = 0.0

    def converts_to(self, other: Unit) -> bool:
        """Whether both measure the same quantity."""
        return self.exponents == other.exponents

    def conversion(self, other: Unit) -> tuple[float, float]:
        """(factor, offset) with `value in other = factor * value in self + offset`; exactly (1.0, 0.0) for equal units."""
        return self.factor / other.factor, (self.offset - other.offset) / other.factor


def _unit(name: str, factor: float = 1.0, offset: float = 0.0, **exponents: int) -> Unit:
    return Unit(name, tuple(exponents.get(base, 0) for base in BASE), factor, offset)


KNOWN = {
    unit.name: unit
    for unit in (
        _unit("1"),
        _unit("%", 0.01),
        *(_unit(base, **{base: 1}) for base in BASE),
        _unit("g", 1e-3, kg=1),
        _unit("mm", 1e-3, m=1),
        _unit("cm", 1e-2, m=1),
        _unit("km", 1e3, m=1),
        _unit("ms", 1e-3, s=1),
        _unit("min", 60.0, s=1),
        _unit("h", 3600.0, s=1),
        _unit("deg", math.pi / 180, rad=1),
        _unit("rev", 2 * math.pi, rad=1),
        _unit("rpm", 2 * math.pi / 60, rad=1, s=-1),
        _unit("kn", 1852 / 3600, m=1, s=-1),
        _unit("degC", 1.0, 273.15, K=1),
        _unit("Hz", s=-1),
        _unit("N", kg=1, m=1, s=-2),
        _unit("kN", 1e3, kg=1, m=1, s=-2),
        _unit("Pa", kg=1, m=-1, s=-2),
        _unit("J", kg=1, m=2, s=-2),
        _unit("W", kg=1, m=2, s=-3),
        _unit("C", s=1, A=1),
        _unit("V", kg=1, m=2, s=-3, A=-1),
        _unit("Ohm", kg=1, m=2, s=-3, A=-2),
        _unit("F", kg=-1, m=-2, s=4, A=2),
        _unit("T", kg=1, s=-2, A=-1),
    )
}
_FACTOR = re.compile(r"(1|[A-Za-z%]+)([+-]?\d+)?")


def parse(text: str) -> Unit:
    """The unit written in `text` in Modelica syntax: "kg.m/s2", "m.s-1", "W/(m2.K)".

    Raises ValueError when the text cannot be read or holds an unknown unit.
    """
    if text in KNOWN:
        return KNOWN[text]
    exponents, scale = [0] * len(BASE), 1.0
    for (unit, power), sign in ((_factor(part, text), sign) for part, sign in _factors(text)):
        scale *= unit.factor ** (sign * power)
        exponents = [e + sign * power * k for e, k in zip(exponents, unit.exponents, strict=True)]
    return Unit(text, tuple(exponents), scale)


def _factors(text: str) -> list[tuple[str, int]]:
    """The factors of a unit as they are written, and whether each stands above (1) or below the line (-1)."""
    above, slash, below = text.partition("/")
    if slash and below.startswith("(") and below.endswith(")"):
        below = below[1:-1]
    return [(part, 1) for part in above.split(".")] + [(part, -1) for part in below.split(".") if slash]


def product(units: Iterable[tuple[str, int]]) -> str:
    """The product of units and their powers, in Modelica syntax: [("m/s", 2), ("s", 1)] is "m2/s", what cancels out "1".

    Raises ValueError for a unit whose syntax cannot be read.
    """
    powers: dict[str, int] = {}
    for text, power in units:
        for part, sign in _factors(text):
            match = _FACTOR.fullmatch(part)
            if match is None:
                raise ValueError(f'cannot read the unit "{text}" at "{part}"')
            powers[match.group(1)] = powers.get(match.group(1), 0) + sign * power * int(match.group(2) or 1)
    powers.pop("1", None)
    above, below = ([f"{unit}{abs(n) if abs(n) > 1 else ''}" for unit, n in powers.items() if sign * n > 0] for sign in (1, -1))
    divisor = f"({'.'.join(below)})" if len(below) > 1 else "".join(below)
    return (".".join(above) or "1") + (f"/{divisor}" if below else "")


def _factor(text: str, whole: str) -> tuple[Unit, int]:
    """One factor of a unit, "m2", as known unit and power."""
    match = _FACTOR.fullmatch(text)
    if match is None:
        raise ValueError(f'cannot read the unit "{whole}" at "{text}"')
    unit = KNOWN.get(match.group(1))
    if unit is None or unit.offset:
        raise ValueError(f'unknown unit "{match.group(1)}" in "{whole}"')
    return unit, int(match.group(2) or 1)
