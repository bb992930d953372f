"""Sine, cosine, arctangent, exponential and logarithm in plain arithmetic, as CasADi expressions.

They are accurate to 1e-13 or better. Unlike those of the C library they are bit-identical on all
machines, and the compiler vectorizes them.
"""

import math
from collections.abc import Sequence
from itertools import zip_longest

import casadi as ca
from casadi import SX

_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(12))
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(9))
_ARCTANGENT = tuple((-1) ** k / (2 * k + 1) for k in range(20))
_EXPONENTIAL = tuple(1 / math.factorial(k) for k in range(7))
_AREA_TANGENT = tuple(2 / (2 * k + 1) for k in range(11))

#: 2 pi as the sum of two numbers; the multiples of the first one are exact in binary
_TWO_PI_HIGH = 6.28125
_TWO_PI_LOW = 0.001935307179586476925286766559

#: subtracting a number from this one rounds the number to an integer, because the last bit has the
#: value 1
_ROUNDING_MAGIC = 1.5 * 2.0**52

_SQUARINGS = 8


def clamp(value: SX) -> SX:
    """Return the value limited to 0 ... 1."""
    return ca.fmin(ca.fmax(value, 0), 1)


def sine_and_cosine(angle: SX) -> tuple[SX, SX]:
    """Return sin and cos of |angle| < 1e6 rad.

    Reduce modulo 2 pi, evaluate the series at a quarter, double twice.
    """
    turns = _ROUNDING_MAGIC - (_ROUNDING_MAGIC - angle * (1 / (2 * math.pi)))
    quarter = ((angle - turns * _TWO_PI_HIGH) - turns * _TWO_PI_LOW) * 0.25
    square = quarter * quarter
    sine, cosine = quarter * _polynomial(_SINE[:8], square), _polynomial(_COSINE, square)
    for _ in range(2):
        sine, cosine = 2 * sine * cosine, 1 - 2 * sine * sine
    return sine, cosine


def sine_of_right_angle_share(share: SX) -> SX:
    """Return sin(share pi / 2) for |share| <= 1, accurate to 1e-15."""
    angle = share * (math.pi / 2)
    return angle * _polynomial(_SINE, angle * angle)


def arctangent(y: SX, x: SX) -> SX:
    """Return atan2(y, x) (rad) for x >= 0, accurate to 1e-15, and 0 at the origin.

    The angle is reduced to the nearest of 0, 45 and 90 degrees, and the series is evaluated for the
    difference.
    """
    size = ca.fabs(y)
    flat, steep = size <= (math.sqrt(2) - 1) * x, size > (math.sqrt(2) + 1) * x
    top = ca.if_else(flat, size, ca.if_else(steep, -x, size - x))
    bottom = ca.if_else(flat, x, ca.if_else(steep, size, size + x))
    rest = top / (bottom + 1e-300)
    base = ca.if_else(flat, 0, ca.if_else(steep, math.pi / 2, math.pi / 4))
    return ca.sign(y) * (base + rest * _polynomial(_ARCTANGENT, rest * rest))


def exponential(x: SX) -> SX:
    """Return exp(x), accurate to 1e-13 for |x| < 3.

    Evaluate the series at x / 256, square eight times.
    """
    power = _polynomial(_EXPONENTIAL, x * 2.0**-_SQUARINGS)
    for _ in range(_SQUARINGS):
        power = power * power
    return power


def logarithm(x: SX) -> SX:
    """Return ln(x) for 0.7 <= x <= 2^31, accurate to 1e-15.

    Halve x to about 1, then evaluate the series of 2 artanh.
    """
    halvings = SX(0)
    for power in (16, 8, 4, 2, 1):
        large = x > 2.0**power / math.sqrt(2)
        x, halvings = x * ca.if_else(large, 2.0**-power, 1), halvings + ca.if_else(large, power, 0)
    ratio = (x - 1) / (x + 1)
    return halvings * math.log(2) + ratio * _polynomial(_AREA_TANGENT, ratio * ratio)


def _polynomial(coefficients: Sequence[float], x: SX) -> SX:
    """Evaluate a polynomial, lowest power first, by Estrin's scheme.

    It adds pairs of terms and squares x, so that its operations can run in parallel, while those of
    Horner's scheme are one chain (Estrin, "Organization of Computer Systems", 1960).
    """
    terms = [SX(coefficient) for coefficient in coefficients]
    while len(terms) > 1:
        terms = [
            low + high * x for low, high in zip_longest(terms[::2], terms[1::2], fillvalue=SX(0))
        ]
        x = x * x
    return terms[0]
