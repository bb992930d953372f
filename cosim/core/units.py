"""Physical units as FMI defines them: exponents of the SI base units, a factor and an offset.

A value is converted to SI by `si = factor * value + offset` (FMI 2.0 section 2.2.2, FMI 3.0 section 2.4.3).
FMUs define their own units; `parse_unit` reads the Modelica/FMI unit syntax ("kg.m2/s3") of other texts.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True, slots=True)
class Unit:
    """Named unit.

    Attributes:
        name: Name in Modelica syntax.
        exponents: Exponents of `BASE_UNITS`; units with equal exponents can be converted into each other.
        factor: Factor of the conversion to SI.
        offset: Offset of the conversion to SI, in SI units.
    """

    name: str
    exponents: tuple[int, ...] = (0,) * len(BASE_UNITS)
    factor: float = 1.0
    offset: float = 0.0

    def converts_to(self, other: Unit) -> bool:
        """Return whether both units measure the same quantity."""
        return self.exponents == other.exponents

    def conversion(self, other: Unit) -> tuple[float, float]:
        """Return (factor, offset) of other = factor * self + offset; exactly (1.0, 0.0) for equal units."""
        return self.factor / other.factor, (self.offset - other.offset) / other.factor


def _define_unit(name: str, factor: float = 1.0, offset: float = 0.0, **exponents: int) -> Unit:
    return Unit(name, tuple(exponents.get(base, 0) for base in BASE_UNITS), factor, offset)


KNOWN_UNITS = {
    unit.name: unit
    for unit in (
        _define_unit("1"),
        _define_unit("%", 0.01),
        *(_define_unit(base, **{base: 1}) for base in BASE_UNITS),
        _define_unit("g", 1e-3, kg=1),
        _define_unit("mm", 1e-3, m=1),
        _define_unit("cm", 1e-2, m=1),
        _define_unit("km", 1e3, m=1),
        _define_unit("ms", 1e-3, s=1),
        _define_unit("min", 60.0, s=1),
        _define_unit("h", 3600.0, s=1),
        _define_unit("deg", math.pi / 180, rad=1),
        _define_unit("rev", 2 * math.pi, rad=1),
        _define_unit("rpm", 2 * math.pi / 60, rad=1, s=-1),
        _define_unit("kn", 1852 / 3600, m=1, s=-1),
        _define_unit("degC", 1.0, 273.15, K=1),
        _define_unit("Hz", s=-1),
        _define_unit("N", kg=1, m=1, s=-2),
        _define_unit("kN", 1e3, kg=1, m=1, s=-2),
        _define_unit("Pa", kg=1, m=-1, s=-2),
        _define_unit("J", kg=1, m=2, s=-2),
        _define_unit("W", kg=1, m=2, s=-3),
        _define_unit("C", s=1, A=1),
        _define_unit("V", kg=1, m=2, s=-3, A=-1),
        _define_unit("Ohm", kg=1, m=2, s=-3, A=-2),
        _define_unit("F", kg=-1, m=-2, s=4, A=2),
        _define_unit("T", kg=1, s=-2, A=-1),
    )
}
_FACTOR_PATTERN = re.compile(r"(1|[A-Za-z%]+)([+-]?\d+)?")


def parse_unit(text: str) -> Unit:
    """Parse a unit in Modelica syntax such as "kg.m/s2", "m.s-1" or "W/(m2.K)".

    Args:
        text: The unit.

    Raises:
        ValueError: The syntax is wrong or a unit is unknown.
    """
    if text in KNOWN_UNITS:
        return KNOWN_UNITS[text]
    exponents, scale = [0] * len(BASE_UNITS), 1.0
    for (unit, power), sign in ((_parse_factor(part, text), sign) for part, sign in _split_factors(text)):
        scale *= unit.factor ** (sign * power)
        exponents = [e + sign * power * k for e, k in zip(exponents, unit.exponents, strict=True)]
    return Unit(text, tuple(exponents), scale)


def _split_factors(text: str) -> list[tuple[str, int]]:
    """Return the factors of a unit, each with 1 for the numerator or -1 for the denominator."""
    numerator, slash, denominator = text.partition("/")
    if slash and denominator.startswith("(") and denominator.endswith(")"):
        denominator = denominator[1:-1]
    return [(part, 1) for part in numerator.split(".")] + [(part, -1) for part in denominator.split(".") if slash]


def multiply_units(units: Iterable[tuple[str, int]]) -> str:
    """Return the product of units raised to powers, in Modelica syntax.

    >>> multiply_units([("m/s", 2), ("s", 1)])
    'm2/s'

    Args:
        units: Pairs of unit and power.

    Returns:
        The product, "1" if all factors cancel out.

    Raises:
        ValueError: The syntax of a unit is wrong.
    """
    powers: dict[str, int] = {}
    for text, power in units:
        for part, sign in _split_factors(text):
            match = _FACTOR_PATTERN.fullmatch(part)
            if match is None:
                raise ValueError(f'cannot read the unit "{text}" at "{part}"')
            powers[match.group(1)] = powers.get(match.group(1), 0) + sign * power * int(match.group(2) or 1)
    powers.pop("1", None)
    numerator, denominator = (
        [f"{unit}{abs(n) if abs(n) > 1 else ''}" for unit, n in powers.items() if sign * n > 0] for sign in (1, -1)
    )
    divisor = f"({'.'.join(denominator)})" if len(denominator) > 1 else "".join(denominator)
    return (".".join(numerator) or "1") + (f"/{divisor}" if denominator else "")


def _parse_factor(text: str, whole: str) -> tuple[Unit, int]:
    """Return known unit and power of one factor such as "m2"; `whole` is the unit it belongs to, for messages."""
    match = _FACTOR_PATTERN.fullmatch(text)
    if match is None:
        raise ValueError(f'cannot read the unit "{whole}" at "{text}"')
    unit = KNOWN_UNITS.get(match.group(1))
    if unit is None or unit.offset:
        raise ValueError(f'unknown unit "{match.group(1)}" in "{whole}"')
    return unit, int(match.group(2) or 1)
