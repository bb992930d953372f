"""Table of the known units: factor and exponents of the SI base units, and the SI prefixes.

Sources: BIPM, SI brochure (9th edition), and NIST SP 811 for units outside of the SI.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

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


def _power(*exponents: int) -> tuple[int, ...]:
    """Return exponents of all base units from those of kg, m, s and A."""
    return (*exponents, *(0,) * (len(BASE_UNITS) - len(exponents)))


_ONE, _LENGTH, _AREA, _VOLUME, _MASS, _TIME = (
    _power(),
    _power(0, 1),
    _power(0, 2),
    _power(0, 3),
    _power(1),
    _power(0, 0, 1),
)
_FREQUENCY, _SPEED, _FORCE, _PRESSURE = (
    _power(0, 0, -1),
    _power(0, 1, -1),
    _power(1, 1, -2),
    _power(1, -1, -2),
)
_ENERGY, _POWER, _CHARGE, _DOSE = (
    _power(1, 2, -2),
    _power(1, 2, -3),
    _power(0, 0, 1, 1),
    _power(0, 2, -2),
)
_KELVIN, _AMOUNT, _LIGHT, _ANGLE = (
    (0,) * BASE_UNITS.index(base) + (1,) for base in ("K", "mol", "cd", "rad")
)

_UnitTable = Mapping[str, tuple[float, tuple[int, ...]]]

#: units with SI prefixes -> (factor, exponents)
PREFIXED: _UnitTable = {
    "m": (1.0, _LENGTH),
    "g": (1e-3, _MASS),
    "s": (1.0, _TIME),
    "A": (1.0, _power(0, 0, 0, 1)),
    "K": (1.0, _power(*_KELVIN)),
    "mol": (1.0, _power(*_AMOUNT)),
    "cd": (1.0, _power(*_LIGHT)),
    "rad": (1.0, _power(*_ANGLE)),
    "Hz": (1.0, _FREQUENCY),
    "N": (1.0, _FORCE),
    "Nm": (1.0, _ENERGY),
    "Pa": (1.0, _PRESSURE),
    "bar": (1e5, _PRESSURE),
    "J": (1.0, _ENERGY),
    "Wh": (3600.0, _ENERGY),
    "eV": (1.602176634e-19, _ENERGY),
    "cal": (4.184, _ENERGY),
    "W": (1.0, _POWER),
    "VA": (1.0, _POWER),
    "var": (1.0, _POWER),
    "C": (1.0, _CHARGE),
    "Ah": (3600.0, _CHARGE),
    "V": (1.0, _power(1, 2, -3, -1)),
    "Ohm": (1.0, _power(1, 2, -3, -2)),
    "S": (1.0, _power(-1, -2, 3, 2)),
    "F": (1.0, _power(-1, -2, 4, 2)),
    "H": (1.0, _power(1, 2, -2, -2)),
    "Wb": (1.0, _power(1, 2, -2, -1)),
    "T": (1.0, _power(1, 0, -2, -1)),
    "lm": (1.0, _power(*_LIGHT)),
    "lx": (1.0, (0, -2, 0, 0, 0, 0, 1, 0)),
    "Bq": (1.0, _FREQUENCY),
    "Gy": (1.0, _DOSE),
    "Sv": (1.0, _DOSE),
    "kat": (1.0, (0, 0, -1, 0, 0, 1, 0, 0)),
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
    "deg": (math.pi / 180, _power(*_ANGLE)),
    "arcmin": (math.pi / 10800, _power(*_ANGLE)),
    "arcsec": (math.pi / 648000, _power(*_ANGLE)),
    "gon": (math.pi / 200, _power(*_ANGLE)),
    "rev": (2 * math.pi, _power(*_ANGLE)),
    "rpm": (2 * math.pi / 60, (0, 0, -1, 0, 0, 0, 0, 1)),
    "kn": (1852 / 3600, _SPEED),
    "mph": (1609.344 / 3600, _SPEED),
    "lbf": (4.4482216152605, _FORCE),
    "psi": (4.4482216152605 / 0.0254**2, _PRESSURE),
    "atm": (101325.0, _PRESSURE),
    "degC": (1.0, _power(*_KELVIN)),
    "degF": (5 / 9, _power(*_KELVIN)),
    "degRk": (5 / 9, _power(*_KELVIN)),
}

#: abbreviations and words that are no units, in lower case and singular -> the unit
WORDS = {
    **{
        "meter": "m",
        "metre": "m",
        "foot": "ft",
        "feet": "ft",
        "mps": "m/s",
        "kmh": "km/h",
        "kph": "km/h",
        "knot": "kn",
    },
    **{
        "mps2": "m/s2",
        "second": "s",
        "sec": "s",
        "minute": "min",
        "hour": "h",
        "hertz": "Hz",
        "radian": "rad",
        "degree": "deg",
    },
    **{
        "gram": "g",
        "kilogram": "kg",
        "newton": "N",
        "newtonmeter": "N.m",
        "pascal": "Pa",
        "joule": "J",
        "watt": "W",
    },
    **{
        "volt": "V",
        "ampere": "A",
        "amp": "A",
        "ohm": "Ohm",
        "kelvin": "K",
        "celsius": "degC",
        "percent": "%",
    },
}
