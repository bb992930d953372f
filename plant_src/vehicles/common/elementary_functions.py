"""Sine, cosine, arctangent and exponential in plain arithmetic, as CasADi expressions: faster than those of the C library where
many are needed, accurate to 1e-13 or better, and the same on every machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import zip_longest

import casadi as ca

_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(12))
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(9))
_ARCTANGENT = tuple((-1) ** k / (2 * k + 1) for k in range(20))
_EXPONENTIAL = tuple(1 / math.factorial(k) for k in range(7))

#: a whole turn in two parts, the first with so few digits that its multiples are exact
_TWO_PI_HIGH = 6.28125
_TWO_PI_LOW = 0.001935307179586476925286766559

#: what is taken away from it is rounded to a whole number: it is so large that its last place counts 1
_ROUNDING_MAGIC = 1.5 * 2.0**52

_SQUARINGS = 8


def sine_and_cosine(angle: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Of an angle (rad) below 1e6: series for a quarter of what is left of it without whole turns, doubled twice."""
    turns = _ROUNDING_MAGIC - (_ROUNDING_MAGIC - angle * (1 / (2 * math.pi)))
    quarter = ((angle - turns * _TWO_PI_HIGH) - turns * _TWO_PI_LOW) * 0.25
    square = quarter * quarter
    sine, cosine = quarter * _polynomial(_SINE[:8], square), _polynomial(_COSINE, square)
    for _ in range(2):
        sine, cosine = 2 * sine * cosine, 1 - 2 * sine * sine
    return sine, cosine


def sine_of_right_angle_share(share: ca.SX) -> ca.SX:
    """The sine of a share, from -1 to 1, of a right angle; to 1e-15."""
    angle = share * (math.pi / 2)
    return angle * _polynomial(_SINE, angle * angle)


def arctangent(y: ca.SX, x: ca.SX) -> ca.SX:
    """The angle (rad) of (x, y), x >= 0, from the x axis, to 1e-15; 0 in the origin. A series for what is left of it without
    0, 45 or 90 degrees."""
    size = ca.fabs(y)
    flat, steep = size <= (math.sqrt(2) - 1) * x, size > (math.sqrt(2) + 1) * x
    top = ca.if_else(flat, size, ca.if_else(steep, -x, size - x))
    bottom = ca.if_else(flat, x, ca.if_else(steep, size, size + x))
    rest = top / (bottom + 1e-300)
    base = ca.if_else(flat, 0, ca.if_else(steep, math.pi / 2, math.pi / 4))
    return ca.sign(y) * (base + rest * _polynomial(_ARCTANGENT, rest * rest))


def exponential(x: ca.SX) -> ca.SX:
    """Of a number of moderate size (|x| < 3 for 1e-13): a power of a series."""
    power = _polynomial(_EXPONENTIAL, x * 2.0**-_SQUARINGS)
    for _ in range(_SQUARINGS):
        power = power * power
    return power


def _polynomial(coefficients: Sequence[float], x: ca.SX) -> ca.SX:
    """A polynomial, the lowest power first, in pairs (Estrin's scheme): they do not wait for each other."""
    terms = [ca.SX(coefficient) for coefficient in coefficients]
    while len(terms) > 1:
        terms = [low + high * x for low, high in zip_longest(terms[::2], terms[1::2], fillvalue=ca.SX(0))]
        x = x * x
    return terms[0]
