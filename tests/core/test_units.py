import math
import re

import numpy as np
import pytest

from cosim.core.units import (
    BASE_UNITS,
    PREFIXED,
    PREFIXES,
    UNPREFIXED,
    WORDS,
    Unit,
    multiply_units,
    named_unit,
    parse_unit,
)


@pytest.mark.parametrize(
    ("text", "like"),
    [
        ("N", "kg.m/s2"),
        ("N.m", "kg.m2/s2"),
        ("W/(m2.K)", "kg/(s3.K)"),
        ("m/s2", "m.s-2"),
        ("1/s", "Hz"),
        ("V.A", "J/s"),
    ],
)
def test_derived_units_have_the_exponents_of_their_definition(text, like):
    assert parse_unit(text).exponents == parse_unit(like).exponents
    assert parse_unit(text).factor == parse_unit(like).factor


@pytest.mark.parametrize(
    ("text", "like"),
    [
        ("N·m", "N.m"),
        ("N⋅m", "N.m"),
        ("N*m", "N.m"),
        ("N m", "N.m"),
        ("N\N{NO-BREAK SPACE}m", "N.m"),
        ("W/m²", "W/m2"),
        ("m³", "m3"),
        ("m·s⁻¹", "m.s-1"),
        ("m/s^2", "m/s2"),
        ("m/s**2", "m/s2"),
        ("m^-1", "1/m"),
        ("m / s", "m/s"),
        ("W/(m²·K)", "W/(m2.K)"),
        ("W/m²/K", "W/(m2.K)"),
        ("(kg m)/s²", "N"),
        ("°C", "degC"),
        ("\N{DEGREE CELSIUS}", "degC"),
        ("°", "deg"),
        ("°/s", "deg/s"),
        ("Ω", "Ohm"),
        ("\N{OHM SIGN}", "Ohm"),
        ("-", "1"),
        ("–", "1"),
        ("—", "1"),
        (" m ", "m"),
    ],
)
def test_a_common_spelling_means_what_it_says(text, like):
    found, expected = parse_unit(text), parse_unit(like)
    assert (found.name, found.exponents, found.factor, found.offset) == (
        text,
        expected.exponents,
        expected.factor,
        expected.offset,
    )


#: texts that would take very long, or overflow
HOSTILE = [
    "a" * 10_000,
    "x" + " " * 100_000 + "x",
    "km999",
    "mm999",
    "km-999",
    "m" + "9" * 5000,
    "m9999",
    "h99.h99",
    "/" * 10_000,
]


@pytest.mark.parametrize(
    "text", ["bar_g", "bar(g)", "€/kWh", "$/MWh", "10^3 m", "people", "{", "/", "m//", *HOSTILE]
)
def test_a_text_that_is_no_known_unit_is_a_unit_by_its_name(text):
    unit, metre = named_unit(text), parse_unit("m")
    assert unit == Unit(text, ())
    assert unit.converts_to(unit)
    assert unit.converts_to(metre)
    assert metre.converts_to(unit)
    assert unit.conversion(metre) == metre.conversion(unit) == (1.0, 0.0)


def test_degrees_become_radians():
    factor, offset = parse_unit("deg").conversion(parse_unit("rad"))
    assert (180 * factor, offset) == (math.pi, 0.0)


@pytest.mark.parametrize(
    ("text", "like", "value", "expected"),
    [
        ("bar", "Pa", 1, 1e5),
        ("degF", "degC", 212, 100),
        ("degRk", "K", 1.8, 1),
        ("kW.h", "J", 1, 3.6e6),
        ("d", "h", 1, 24),
        ("l", "m3", 1000, 1),
    ],
)
def test_units_of_the_modelica_standard_library_are_converted(text, like, value, expected):
    factor, offset = parse_unit(text).conversion(parse_unit(like))
    assert factor * value + offset == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "like", "value", "expected"),
    [
        ("mA", "A", 5, 5e-3),
        ("mV", "V", 2, 2e-3),
        ("kHz", "1/s", 1, 1e3),
        ("t", "kg", 1.5, 1500),
        ("H", "V.s/A", 1, 1),
        ("Wb", "V.s", 1, 1),
        ("F", "A.s/V", 1, 1),
        ("T", "Wb/m2", 1, 1),
        ("S", "1/Ohm", 1, 1),
        ("µF", "F", 1, 1e-6),
        ("kN.m", "N.m", 1, 1e3),
        ("Nm", "N.m", 1, 1),
        ("kWh", "MJ", 1, 3.6),
        ("hPa", "mbar", 1, 1),
        ("psi", "Pa", 1, 6894.757293168),
        ("nmi/h", "kn", 1, 1),
        ("lbf.ft", "N.m", 1, 1.3558179483314),
        ("mAh", "C", 1, 3.6),
        ("dm3", "l", 1, 1),
    ],
)
def test_technical_units_and_si_prefixes_are_converted(text, like, value, expected):
    unit, target = parse_unit(text), parse_unit(like)
    assert unit.exponents == target.exponents
    factor, _ = unit.conversion(target)
    assert factor * value == pytest.approx(expected, rel=1e-12)


def test_no_prefixed_unit_has_the_name_of_another_unit_with_another_meaning():
    prefixed = {f"{prefix}{name}": (prefix, name) for prefix in PREFIXES for name in PREFIXED}
    assert len(prefixed) == len(PREFIXES) * len(PREFIXED)
    for text, (prefix, name) in prefixed.items():
        assert parse_unit(text).factor == pytest.approx(
            PREFIXES[prefix] * PREFIXED[name][0], rel=1e-15
        )
    assert set(prefixed).intersection({*PREFIXED, *UNPREFIXED}) == {"kg"}


def test_an_unknown_unit_is_refused_with_the_nearest_one():
    with pytest.raises(ValueError, match=r'unknown unit "ohm" in "ohm\.m"; did you mean "Ohm"'):
        parse_unit("ohm.m")


@pytest.mark.parametrize(
    ("text", "hint"),
    [("mps", '; did you mean "m/s"?'), ("rmp", '; did you mean "rpm"?'), ("psj", ""), ("sm", "")],
)
def test_a_short_unknown_unit_has_no_hint_at_a_unit_that_resembles_it_by_chance(text, hint):
    with pytest.raises(ValueError, match=f'^unknown unit "{text}"{re.escape(hint)}$'):
        parse_unit(text)


def test_celsius_becomes_kelvin():
    factor, offset = parse_unit("degC").conversion(parse_unit("K"))
    assert factor * 20 + offset == 293.15


def test_revolutions_per_minute_are_an_angular_velocity():
    factor, _ = parse_unit("rev/min").conversion(parse_unit("rad/s"))
    assert factor == pytest.approx(2 * math.pi / 60, rel=1e-15)


def test_rad_per_second_does_not_convert_to_hertz():
    assert not parse_unit("rad/s").converts_to(parse_unit("Hz"))


def test_the_same_unit_needs_no_conversion():
    assert parse_unit("km/h").conversion(parse_unit("km/h")) == (1.0, 0.0)


@pytest.mark.parametrize(
    "text",
    ["", "parsec", "m//", "(m", "bar_g", "10^3 m", "1e-3", "W/m2K", "€/kWh", "{m}", "m/(s.(kg.K))"],
)
def test_unreadable_input_is_refused(text):
    with pytest.raises(ValueError, match="unit"):
        parse_unit(text)


@pytest.mark.parametrize(
    ("factors", "expected"),
    [
        ([("m", 1)], "m"),
        ([("m/s", 2), ("s", 1)], "m2/s"),
        ([("kg.m2/s3", 1), ("s", 1)], "kg.m2/s2"),
        ([("m.s-1", 1)], "m/s"),
        ([("W/(m2.K)", 2)], "W2/(m4.K2)"),
        ([("rad", 1), ("rad", -1)], "1"),
        ([("1", 1), ("s", -1)], "1/s"),
    ],
)
def test_products_of_units(factors, expected):
    assert multiply_units(factors) == expected
    exponents = np.zeros(len(BASE_UNITS), int)
    for text, power in factors:
        exponents += power * np.array(parse_unit(text).exponents)
    assert parse_unit(expected).exponents == tuple(exponents)


@pytest.mark.parametrize(
    ("factors", "expected"),
    [
        ([("°C", 1), ("s", 1)], "degC.s"),
        ([("N·m", 2), ("s", 1)], "N2.m2.s"),
        ([("W/m²", 1), ("s", 1)], "W.s/m2"),
        ([("-", 1), ("s", 1)], "s"),
        ([("bar_g", 2), ("s", 1)], "bar_g2.s"),
        ([("€/kWh", 1), ("s", 1)], "€.s/kWh"),
        ([("bar(g)", 1), ("s", 1)], "(bar(g)).s"),
        ([("10^3 m", 1), ("s", -1)], "(10^3 m)/s"),
        ([("m//", 1), ("m//", -1)], "1"),
    ],
)
def test_products_of_units_of_any_spelling(factors, expected):
    assert multiply_units(factors) == expected


@pytest.mark.parametrize("text", HOSTILE)
def test_products_with_any_text_are_texts(text):
    assert isinstance(multiply_units([(text, 2), ("s", 1)]), str)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("metre", "m"),
        ("Meters", "m"),
        ("newton", "N"),
        ("N*metre", "m"),
        ("degrees/s", "deg"),
        ("celsius", "degC"),
        ("knots", "kn"),
    ],
)
def test_a_written_out_unit_has_its_symbol_as_hint(text, unit):
    with pytest.raises(ValueError, match=f'; did you mean "{unit}"'):
        parse_unit(text)


def test_the_hints_at_units_are_units():
    for unit in WORDS.values():
        parse_unit(unit)
