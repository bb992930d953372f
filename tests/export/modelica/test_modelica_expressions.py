"""Expressions: arithmetic, rounding, precedence, enumerations and functions.

C and interpreter are compared bit for bit, both with references written by hand.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from cosim.core.errors import ComponentError


def test_elementary_functions(compile_both):
    model = compile_both("""model M
  input Real x;
  input Real y;
  output Real e[12];
equation
  when sample(0, 0.01) then
    e = {sin(x), cos(x), tan(x), asin(x/3), acos(x/3), atan(x), exp(x),
         log(abs(x)), log10(abs(x)), sinh(x), tanh(y), sqrt(abs(y))};
  end when;
end M;""")
    for _, inputs in model.simulate():
        x, y = inputs["x"], inputs["y"]
        m = math
        expected = [m.sin(x), m.cos(x), m.tan(x), m.asin(x / 3), m.acos(x / 3), m.atan(x), m.exp(x)]
        expected += [m.log(abs(x)), m.log10(abs(x)), m.sinh(x), m.tanh(y), m.sqrt(abs(y))]
        assert list(model.get("e")) == expected


def test_rounding_and_remainders(compile_both):
    model = compile_both("""model M
  input Real x;
  input Integer k;
  output Real r[6];
  output Integer n[6];
equation
  when sample(0, 0.01) then
    r = {floor(x), ceil(x), mod(x, 0.7), rem(x, 0.7), div(x, 0.7), 1.0*sign(x)};
    n = {integer(x), mod(k, 3), rem(k, 3), div(k, 3), mod(k, -3), abs(k)};
  end when;
end M;""")
    for _, inputs in model.simulate():
        x, k = inputs["x"], int(inputs["k"])
        quotient = math.trunc(x / 0.7)
        real = [
            math.floor(x),
            math.ceil(x),
            x - math.floor(x / 0.7) * 0.7,
            x - quotient * 0.7,
            quotient,
            np.sign(x),
        ]
        assert list(model.get("r")) == real
        assert list(model.get("n")) == [
            math.floor(x),
            k % 3,
            int(math.fmod(k, 3)),
            int(k / 3),
            k % -3,
            abs(k),
        ]


def test_grouping_and_precedence_are_those_of_modelica(compile_both):
    model = compile_both("""model M
  input Real a;
  input Real b;
  input Real c;
  input Boolean p;
  input Boolean q;
  output Real y[6];
  output Boolean l[4];
equation
  when sample(0, 0.01) then
    y = {a - (b - c), a - b - c, a/(b*c), a/b*c, -(a + b)*c, -a^2};
    l = {p or q and not p, (p or q) and not p, (a < b) == (b < c), not (p and q) <> p};
  end when;
end M;""")
    for _, i in model.simulate():
        a, b, c, p, q = i["a"], i["b"], i["c"], i["p"], i["q"]
        assert list(model.get("y")) == [
            a - (b - c),
            (a - b) - c,
            a / (b * c),
            (a / b) * c,
            -(a + b) * c,
            -(a * a),
        ]
        assert list(model.get("l")) == [
            p or (q and not p),
            (p or q) and not p,
            (a < b) == (b < c),
            (not (p and q)) != p,
        ]


def test_integer_quotients_are_real(compile_both):
    model = compile_both("""model M
  input Integer k(min = 1);
  output Real y;
equation
  when sample(0, 0.01) then
    y = 10/3 + 1/k + k/4;
  end when;
end M;""")
    for _, inputs in model.simulate(50):
        assert model.get("y") == 10 / 3 + 1 / inputs["k"] + inputs["k"] / 4


def test_enumerations_as_state_input_and_parameter(compile_both):
    model = compile_both("""type Mode = enumeration(idle, climb, hold);
model M
  parameter Mode first = Mode.climb;
  input Mode wanted;
  output Mode mode(start = Mode.idle, fixed = true);
  output Integer number;
equation
  when sample(0, 0.01) then
    mode = if pre(mode) == Mode.idle then first
      elseif wanted > Mode.climb then Mode.hold else pre(mode);
    number = Integer(mode);
  end when;
end M;""")
    assert model.c.variables["mode"].enumeration == (("idle", ""), ("climb", ""), ("hold", ""))
    assert model.c.variables["mode"].start == 1
    mode = 1
    for _, inputs in model.simulate(50, first=2):
        if mode == 1:
            mode = 2
        elif inputs["wanted"] > 2:
            mode = 3
        assert (model.get("mode"), model.get("number")) == (mode, mode)


def test_functions_with_arrays_loops_locals_and_size(compile_both):
    model = compile_both("""package P
  function weighted "sum of w[i]*i up to k"
    input Real w[:];
    input Integer k = 2;
    output Real s;
  protected
    Integer n = size(w, 1);
    Real scaled[size(w, 1)];
  algorithm
    for i in 1:n loop
      scaled[i] := w[i]*i;
    end for;
    s := 0;
    for i in 1:n loop
      if i <= k then
        s := s + scaled[i];
      end if;
    end for;
  end weighted;
  function polar "two results"
    input Real x;
    input Real y;
    output Real r;
    output Real angle;
  algorithm
    r := sqrt(x^2 + y^2);
    angle := atan2(y, x);
  end polar;
  function doubled
    input Real w[:];
    output Real d[size(w, 1)];
  algorithm
    d := 2*w;
  end doubled;
end P;
model M
  input Real a[3];
  input Real b[5];
  output Real y[2];
  output Real r;
  output Real angle;
  output Real d[3];
  output Real e[5];
algorithm
  when sample(0, 0.01) then
    y := {P.weighted(a), P.weighted(b, 4)};
    (r, angle) := P.polar(a[1], a[2]);
    d := P.doubled(a);
    e := P.doubled(P.doubled(b)) + b;
  end when;
end M;""")
    for _, inputs in model.simulate():
        a, b = inputs["a"], inputs["b"]
        assert list(model.get("y")) == [
            0.0 + a[0] * 1 + a[1] * 2,
            0.0 + b[0] + b[1] * 2 + b[2] * 3 + b[3] * 4,
        ]
        assert (model.get("r"), model.get("angle")) == (
            math.sqrt(a[0] * a[0] + a[1] * a[1]),
            math.atan2(a[1], a[0]),
        )
        assert list(model.get("d")) == list(2 * a)
        assert list(model.get("e")) == list(2 * (2 * b) + b)


@pytest.mark.parametrize(
    ("inputs", "reason"),
    [
        ({"k": 2**31 - 1}, "Integer overflow"),
        ({"d": 0}, "division by zero in div(), mod() or rem()"),
        ({"x": -1.0}, "y is not a finite number"),
        ({"x": 1e12}, "Integer overflow"),
        pytest.param(
            {"k": 2**31 - 1, "x": -1.0}, "Integer overflow", id="the first failure counts"
        ),
    ],
)
def test_an_undefined_arithmetic_result_is_a_failure(compile_both, inputs, reason):
    model = compile_both("""model M
  input Integer k;
  parameter Integer d = 1;
  input Real x;
  output Integer n;
  output Real y;
equation
  when sample(0, 0.01) then
    n = k + 1 + div(5, d) + integer(x);
    y = sqrt(x);
  end when;
end M;""")
    model.set(**inputs)
    model.initialize()
    assert model.c.step(0.0, 0.01) == reason
    with pytest.raises(
        ComponentError,
        match=f"M: step failed at t = 0 s: {reason.replace('(', '.').replace(')', '.')}",
    ):
        model.python.step(0.0, 0.01)
