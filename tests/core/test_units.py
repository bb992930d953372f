import math

import pytest

from cosim.core.units import BASE_UNITS, multiply_units, parse_unit


@pytest.mark.parametrize(
    ("text", "like"),
    [("N", "kg.m/s2"), ("N.m", "kg.m2/s2"), ("W/(m2.K)", "kg/(s3.K)"), ("m/s2", "m.s-2"), ("1/s", "Hz"), ("V.A", "J/s")],
)
def test_derived_units_have_the_exponents_of_their_definition(text, like):
    assert parse_unit(text).exponents == parse_unit(like).exponents
    assert parse_unit(text).factor == parse_unit(like).factor


def test_degrees_become_radians():
    factor, offset = parse_unit("deg").conversion(parse_unit("rad"))
    assert (180 * factor, offset) == (math.pi, 0.0)


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


@pytest.mark.parametrize("text", ["parsec", "m/s^2", "kg m", "m//", "(m"])
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
    exponents = [sum(power * parse_unit(text).exponents[i] for text, power in factors) for i in range(len(BASE_UNITS))]
    assert list(parse_unit(expected).exponents) == exponents
