"""Physical units as FMI defines them: exponents of the SI base units, a factor and an offset.

A value is converted to SI by `si = factor * value + offset` (FMI 2.0 section 2.2.2, FMI 3.0 section
2.4.3). FMUs define their own units; `parse_unit` reads the Modelica/FMI unit syntax ("kg.m2/s3") of
other texts, and common spellings such as "W/m²" or "°C". `named_unit` accepts any text.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

from .errors import nearest_name

BASE_UNITS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")

#: SI prefix -> factor; "u" stands for micro
PREFIXES = {
    "da": 1e1,
    "h": 1e2,
    "k": 1e3,
    "M": 1e6,
    "G": 1e9,
    "T": 1e12,
    "P": 1e15,
    "E": 1e18,
    "d": 1e-1,
    "c": 1e-2,
    "m": 1e-3,
    "u": 1e-6,
    "n": 1e-9,
    "p": 1e-12,
    "f": 1e-15,
    "a": 1e-18,
}

#: offset of the conversion to SI of the units whose zero is not that of SI (K)
OFFSETS = {"degC": 273.15, "degF": 459.67 * 5 / 9}


def _exponents(*powers: int) -> tuple[int, ...]:
    """Return exponents of all base units from those of kg, m, s and A."""
    return (*powers, *(0,) * (len(BASE_UNITS) - len(powers)))


_ONE, _LENGTH, _AREA, _VOLUME, _MASS, _TIME = (
    _exponents(),
    _exponents(0, 1),
    _exponents(0, 2),
    _exponents(0, 3),
    _exponents(1),
    _exponents(0, 0, 1),
)
_FREQUENCY, _SPEED, _FORCE, _PRESSURE = (
    _exponents(0, 0, -1),
    _exponents(0, 1, -1),
    _exponents(1, 1, -2),
    _exponents(1, -1, -2),
)
_ENERGY, _POWER, _CHARGE, _DOSE = (
    _exponents(1, 2, -2),
    _exponents(1, 2, -3),
    _exponents(0, 0, 1, 1),
    _exponents(0, 2, -2),
)
_CURRENT, _KELVIN, _AMOUNT, _LIGHT, _ANGLE = (
    _exponents(*(0,) * BASE_UNITS.index(base), 1) for base in ("A", "K", "mol", "cd", "rad")
)

_UnitTable = Mapping[str, tuple[float, tuple[int, ...]]]

#: SI units and their equals, with SI prefixes -> exponents
_COHERENT = {
    "m": _LENGTH,
    "s": _TIME,
    "A": _CURRENT,
    "K": _KELVIN,
    "mol": _AMOUNT,
    "cd": _LIGHT,
    "rad": _ANGLE,
    "Hz": _FREQUENCY,
    "N": _FORCE,
    "Nm": _ENERGY,
    "Pa": _PRESSURE,
    "J": _ENERGY,
    "W": _POWER,
    "VA": _POWER,
    "var": _POWER,
    "C": _CHARGE,
    "V": _exponents(1, 2, -3, -1),
    "Ohm": _exponents(1, 2, -3, -2),
    "S": _exponents(-1, -2, 3, 2),
    "F": _exponents(-1, -2, 4, 2),
    "H": _exponents(1, 2, -2, -2),
    "Wb": _exponents(1, 2, -2, -1),
    "T": _exponents(1, 0, -2, -1),
    "lm": _LIGHT,
    "lx": (0, -2, 0, 0, 0, 0, 1, 0),
    "Bq": _FREQUENCY,
    "Gy": _DOSE,
    "Sv": _DOSE,
    "kat": (0, 0, -1, 0, 0, 1, 0, 0),
}

#: units with SI prefixes -> (factor, exponents)
PREFIXED: _UnitTable = {
    **{name: (1.0, exponents) for name, exponents in _COHERENT.items()},
    "g": (1e-3, _MASS),
    "bar": (1e5, _PRESSURE),
    "Wh": (3600.0, _ENERGY),
    "eV": (1.602176634e-19, _ENERGY),
    "cal": (4.184, _ENERGY),
    "Ah": (3600.0, _CHARGE),
    "l": (1e-3, _VOLUME),
    "L": (1e-3, _VOLUME),
}

#: units without SI prefixes -> (factor, exponents)
UNPREFIXED: _UnitTable = {
    "1": (1.0, _ONE),
    "sr": (1.0, _ONE),
    "%": (1e-2, _ONE),
    "ppm": (1e-6, _ONE),
    "kg": (1.0, _MASS),
    "t": (1e3, _MASS),
    "lb": (0.45359237, _MASS),
    "min": (60.0, _TIME),
    "h": (3600.0, _TIME),
    "d": (86400.0, _TIME),
    "in": (0.0254, _LENGTH),
    "ft": (0.3048, _LENGTH),
    "yd": (0.9144, _LENGTH),
    "mi": (1609.344, _LENGTH),
    "nmi": (1852.0, _LENGTH),
    "ha": (1e4, _AREA),
    "deg": (math.pi / 180, _ANGLE),
    "arcmin": (math.pi / 10800, _ANGLE),
    "arcsec": (math.pi / 648000, _ANGLE),
    "gon": (math.pi / 200, _ANGLE),
    "rev": (2 * math.pi, _ANGLE),
    "rpm": (2 * math.pi / 60, (0, 0, -1, 0, 0, 0, 0, 1)),
    "kn": (1852 / 3600, _SPEED),
    "mph": (1609.344 / 3600, _SPEED),
    "lbf": (4.4482216152605, _FORCE),
    "psi": (4.4482216152605 / 0.0254**2, _PRESSURE),
    "atm": (101325.0, _PRESSURE),
    "degC": (1.0, _KELVIN),
    "degF": (5 / 9, _KELVIN),
    "degRk": (5 / 9, _KELVIN),
}

#: abbreviations and words that are no units, in lower case and singular -> the unit
WORDS = {
    "meter": "m",
    "metre": "m",
    "foot": "ft",
    "feet": "ft",
    "mps": "m/s",
    "kmh": "km/h",
    "kph": "km/h",
    "knot": "kn",
    "mps2": "m/s2",
    "second": "s",
    "sec": "s",
    "minute": "min",
    "hour": "h",
    "hertz": "Hz",
    "radian": "rad",
    "degree": "deg",
    "gram": "g",
    "kilogram": "kg",
    "newton": "N",
    "newtonmeter": "N.m",
    "pascal": "Pa",
    "joule": "J",
    "watt": "W",
    "volt": "V",
    "ampere": "A",
    "amp": "A",
    "ohm": "Ohm",
    "kelvin": "K",
    "celsius": "degC",
    "percent": "%",
}


@dataclass(frozen=True, slots=True)
class Unit:
    """Named unit.

    Attributes:
        name: Name, usually in Modelica syntax.
        exponents: Exponents of `BASE_UNITS`; units with equal exponents can be converted into each
            other. Empty if the quantity is unknown; such a unit is compatible with all others, and
            values are not converted.
        factor: Factor of the conversion to SI.
        offset: Offset of the conversion to SI, in SI units.
    """

    name: str
    exponents: tuple[int, ...] = (0,) * len(BASE_UNITS)
    factor: float = 1.0
    offset: float = 0.0

    def converts_to(self, other: Unit) -> bool:
        """Return whether both units measure the same quantity, or one of them an unknown one."""
        return self.exponents == other.exponents or not (self.exponents and other.exponents)

    def conversion(self, other: Unit) -> tuple[float, float]:
        """Return (factor, offset) of other = factor * self + offset.

        Exactly (1.0, 0.0) for equal units and unknown ones.
        """
        if not (self.exponents and other.exponents):
            return 1.0, 0.0
        return self.factor / other.factor, (self.offset - other.offset) / other.factor


KNOWN_UNITS = {
    name: Unit(name, exponents, factor, OFFSETS.get(name, 0.0))
    for name, (factor, exponents) in {**PREFIXED, **UNPREFIXED}.items()
}
#: common spellings -> Modelica syntax, after Unicode compatibility normalization, which converts
#: superscripts
_SPELLINGS = {
    "**": "",
    "^": "",
    "°C": "degC",
    "°": "deg",
    "Ω": "Ohm",
    "μ": "u",
    "−": "-",
    **dict.fromkeys("·⋅∙•*×", "."),
    " .": ".",
    ". ": ".",
    " /": "/",
    "/ ": "/",
}
#: symbol (a unit, or the name of a placeholder in braces) and power
_FACTOR_PATTERN = re.compile(r"(1(?!\d)|\{\w+\}|[^\s\d./(){}+-]+)([+-]?\d{1,3})?")


def named_unit(text: str) -> Unit:
    """Return the unit that a text means.

    A text that `parse_unit` cannot read is a unit of an unknown quantity.
    """
    try:
        return parse_unit(text)
    except ValueError:
        return Unit(text, ())


def parse_unit(text: str) -> Unit:
    """Parse a unit in Modelica syntax or in a common spelling.

    Modelica: "kg.m/s2", "m.s-1", "W/(m2.K)". Common spellings: "N·m", "-".

    Args:
        text: The unit; it becomes the name of the result.

    Raises:
        ValueError: The syntax is wrong or a unit is unknown.
    """
    normalized = _normalize(text)
    if found := _find_unit(normalized):
        return replace(found, name=text)
    exponents, scale = [0] * len(BASE_UNITS), 1.0
    for symbol, power in _split_factors(text):
        unit = _find_unit(symbol)
        if unit is None or unit.offset:
            place = "" if symbol == text else f' in "{text}"'
            raise ValueError(f'unknown unit "{symbol}"{place}{_hint_at_unit(symbol)}')
        scale *= _power(unit.factor, power)
        exponents = [e + power * k for e, k in zip(exponents, unit.exponents, strict=True)]
    if not 0 < scale < math.inf:
        raise ValueError(f'the unit "{text}" is too small or too large')
    return Unit(text, tuple(exponents), scale)


def _hint_at_unit(symbol: str) -> str:
    """Return a hint at the unit that a symbol probably means.

    A short symbol resembles many units by chance; only one of the same letters counts.
    """
    word = symbol.lower()
    if meaning := WORDS.get(word) or WORDS.get(word.removesuffix("s")):
        return f'; did you mean "{meaning}"?'
    letters = sorted(word)
    near = nearest_name(
        symbol,
        KNOWN_UNITS
        if len(symbol) > 3
        else [name for name in KNOWN_UNITS if sorted(name.lower()) == letters],
    )
    return f'; did you mean "{near}"?' if near else ""


@lru_cache(4096)
def _find_unit(symbol: str) -> Unit | None:
    """Return a known unit, with or without an SI prefix; None if there is none."""
    if symbol in KNOWN_UNITS:
        return KNOWN_UNITS[symbol]
    for prefix, factor in PREFIXES.items():
        if symbol.startswith(prefix) and (rest := symbol[len(prefix) :]) in PREFIXED:
            return replace(KNOWN_UNITS[rest], name=symbol, factor=factor * KNOWN_UNITS[rest].factor)
    return None


def _power(factor: float, power: int) -> float:
    try:
        return factor**power
    except OverflowError:
        return math.inf


def _normalize(text: str) -> str:
    """Return the spelling of a unit in Modelica syntax; "1" for a dash."""
    normalized = " ".join(unicodedata.normalize("NFKC", text).split())
    for spelling, replacement in _SPELLINGS.items():
        normalized = normalized.replace(spelling, replacement)
    return "1" if normalized in ("-", "–", "—") else normalized.replace(" ", ".")


def _split_factors(text: str) -> list[tuple[str, int]]:
    """Return the factors of a unit as pairs of symbol and power.

    Raises:
        ValueError: The syntax is wrong.
    """
    numerator, *denominators = _normalize(text).split("/")
    factors = []
    for product, sign in ((numerator, 1), *((denominator, -1) for denominator in denominators)):
        if product.startswith("(") and product.endswith(")"):
            product = product[1:-1]
        for factor in product.split("."):
            match = _FACTOR_PATTERN.fullmatch(factor)
            if match is None:
                raise ValueError(f'cannot read the unit "{text}" at "{factor}"')
            factors.append((match[1], sign * int(match[2] or 1)))
    return factors


def split_unit(text: str) -> list[tuple[str, int]]:
    """Return the factors of a unit as pairs of symbol and power.

    A text that cannot be read is one factor.

    >>> split_unit("kg.m2/s3")
    [('kg', 1), ('m', 2), ('s', -3)]
    """
    try:
        return _split_factors(text)
    except ValueError:
        return [(text, 1)]


def multiply_units(units: Iterable[tuple[str, int]]) -> str:
    """Return the product of units raised to powers, in Modelica syntax.

    >>> multiply_units([("m/s", 2), ("s", 1)])
    'm2/s'

    Args:
        units: Pairs of unit and power. A unit that cannot be read becomes one factor, in
            parentheses.

    Returns:
        The product, "1" if all factors cancel out.
    """
    powers: dict[str, int] = {}
    for text, power in units:
        for symbol, own in split_unit(text):
            name = symbol if _FACTOR_PATTERN.fullmatch(symbol) else f"({symbol})"
            powers[name] = powers.get(name, 0) + power * own
    powers.pop("1", None)
    numerator: list[str] = []
    denominator: list[str] = []
    for unit, n in powers.items():
        if n:
            text = f"{unit}{abs(n)}" if abs(n) > 1 else unit
            (numerator if n > 0 else denominator).append(text)
    divisor = f"({'.'.join(denominator)})" if len(denominator) > 1 else "".join(denominator)
    return (".".join(numerator) or "1") + (f"/{divisor}" if denominator else "")
