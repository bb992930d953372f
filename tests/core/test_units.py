import math

import pytest

from cosim.core.units import BASE, parse, product


@pytest.mark.parametrize(
    ("text", "like"),
    [("N", "kg.m/s2"), ("N.m", "kg.m2/s2"), ("W/(m2.K)", "kg/(s3.K)"), ("m/s2", "m.s-2"), ("1/s", "Hz"), ("V.A", "J/s")],
)
def test_derived_units_have_the_exponents_of_their_definition(text, like):
    assert parse(text).exponents == parse(like).exponents
    assert parse(text).factor == parse(like).factor


def test_degrees_become_radians():
    factor, offset = parse("deg").conversion(parse("rad"))
    assert (180 * factor, offset) == (math.pi, 0.0)


def test_celsius_becomes_kelvin():
    factor, offset = parse("degC").conversion(parse("K"))
    assert factor * 20 + offset == 293.15


def test_revolutions_per_minute_are_an_angular_velocity():
    factor, _ = parse("rev/min").conversion(parse("rad/s"))
    assert factor == pytest.approx(2 * math.pi / 60, rel=1e-15)


def test_rad_per_second_is_no_frequency():
    assert not parse("rad/s").converts_to(parse("Hz"))


def test_the_same_unit_needs_no_conversion():
    assert parse("km/h").conversion(parse("km/h")) == (1.0, 0.0)


@pytest.mark.parametrize("text", ["parsec", "m/s^2", "kg m", "m//", "(m"])
def test_what_cannot_be_read_is_refused(text):
    with pytest.raises(ValueError, match="unit"):
        parse(text)


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
    assert product(factors) == expected
    exponents = [sum(power * parse(text).exponents[i] for text, power in factors) for i in range(len(BASE))]
    assert list(parse(expected).exponents) == exponents
