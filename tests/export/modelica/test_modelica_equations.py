"""Equations outside `when`, records and initialization.

C and interpreter are compared bit for bit, both with references written by hand.
"""

from __future__ import annotations

import pytest


def test_continuous_equations_are_sorted_across_components(compile_both):
    model = compile_both("""model M
  block Gain
    parameter Real k = 1;
    input Real u;
    output Real y;
  equation
    y = k*u;
  end Gain;
  block Delay
    input Real u;
    output Real y(start = 0, fixed = true);
    discrete Real x(start = 0, fixed = true);
  equation
    when sample(0, 0.01) then
      y = pre(x);
      x = u;
    end when;
  end Delay;
  input Real u;
  output Real y;
  Gain last(k = 2);
  Delay delay;
  Gain first(k = 3);
equation
  y = last.y;
  last.u = delay.y + time;
  connect(first.y, delay.u);
  first.u = u;
end M;""")
    held = 0.0
    for k, inputs in model.simulate():
        assert model.get("y") == 2 * (held + k * 0.01)
        held = 3 * inputs["u"]


def test_unrolled_for_equations_may_build_on_each_other(compile_both):
    model = compile_both("""model M
  input Real u;
  output Real y[4];
equation
  y[4] = y[3] + 1;
  for i in 2:3 loop
    y[i] = y[i - 1]*u;
  end for;
  y[1] = u;
  when sample(0, 0.01) then
  end when;
end M;""")
    for _, inputs in model.simulate(20):
        u = inputs["u"]
        assert list(model.get("y")) == [u, u * u, u * u * u, u * u * u + 1]


def test_if_equations_outside_when(compile_both):
    model = compile_both("""model M
  input Real u;
  output Real y;
  output Real z;
equation
  if u > 1 then
    y = 1;
    z = y + 1;
  elseif u < -1 then
    y = 3*u;
    z = 3;
  else
    y = u;
    z = 0;
  end if;
  when sample(0, 0.01) then
  end when;
end M;""")
    for _, inputs in model.simulate(100):
        u = inputs["u"]
        expected = (u, 0)
        if u > 1:
            expected = (1, 2)
        elif u < -1:
            expected = (3 * u, 3)
        assert (model.get("y"), model.get("z")) == expected


def test_if_equations_on_parameters_outside_when(compile_both):
    model = compile_both("""model M
  parameter Boolean p = true;
  input Real u;
  output Real y;
  output Real z;
equation
  if p then
    y = u;
    z = 1;
  else
    y = 2*u;
    z = 2;
  end if;
  when sample(0, 0.01) then
  end when;
end M;""")
    for _, inputs in model.simulate(20, p=False):
        assert (model.get("y"), model.get("z")) == (2 * inputs["u"], 2)


def test_records_flatten_to_dotted_names(compile_both):
    model = compile_both("""record Vector
  Real x(unit = "m");
  Real y(unit = "m");
end Vector;
record State
  Vector position;
  Boolean touching;
end State;
model M
  input State vehicle;
  output Vector copy;
  output Vector scaled;
  Vector inner_;
equation
  copy = vehicle.position;
  inner_ = copy;
  scaled.x = 2*inner_.x;
  scaled.y = if vehicle.touching then 0 else inner_.y;
  when sample(0, 0.01) then
  end when;
end M;""")
    shown = {name: (v.causality, v.unit) for name, v in model.c.variables.items()}
    assert shown == {
        "vehicle.position.x": ("input", "m"),
        "vehicle.position.y": ("input", "m"),
        "vehicle.touching": ("input", ""),
        "copy.x": ("output", "m"),
        "copy.y": ("output", "m"),
        "scaled.x": ("output", "m"),
        "scaled.y": ("output", "m"),
    }
    for _, i in model.simulate(50):
        assert model.get("copy.y") == i["vehicle.position.y"]
        assert model.get("scaled.x") == 2 * i["vehicle.position.x"]
        assert model.get("scaled.y") == (0 if i["vehicle.touching"] else i["vehicle.position.y"])


def test_initial_equations_initial_algorithms_and_initial(compile_both):
    model = compile_both("""model M
  parameter Real x0 = 2;
  parameter Integer n0 = 3;
  input Real u;
  output Real x;
  output Integer n;
  output Real seen;
  output Boolean starting;
equation
  starting = initial();
  when {initial(), sample(0, 0.01)} then
    seen = u;
  end when;
  when sample(0, 0.01) then
    x = pre(x) + u;
    n = pre(n) + 1;
  end when;
initial equation
  x = 2*x0 + u;
initial algorithm
  n := n0;
end M;""")
    model.set(x0=5.0, n0=7, u=0.5)
    model.initialize()
    assert [model.get(name) for name in ("x", "n", "seen", "starting")] == [10.5, 7, 0.5, True]
    model.set(u=1.5)
    model.step(0.0)
    assert [model.get(name) for name in ("x", "n", "seen", "starting")] == [12.0, 8, 1.5, False]


def test_initialization_can_be_repeated(compile_both):
    model = compile_both("""model M
  input Real u;
  output Real x(start = 4, fixed = true);
  output Real y;
equation
  y = x + u;
  when sample(0, 0.01) then
    x = pre(x) + u;
  end when;
end M;""")
    for u in (1.0, 2.0, 3.0):
        model.set(u=u)
        model.initialize()
        assert (model.get("x"), model.get("y")) == (4.0, 4.0 + u)
    model.step(0.0)
    model.initialize()
    assert model.get("x") == 4.0


def test_record_constructors_and_functions_with_records(compile_both):
    model = compile_both("""model M
  record Phasor
    Real re;
    Real im;
  end Phasor;
  function product
    input Phasor a;
    input Phasor b;
    output Phasor c;
  algorithm
    c := Phasor(a.re*b.re - a.im*b.im, a.re*b.im + a.im*b.re);
  end product;
  function square
    input Phasor a;
    output Real size;
  protected
    Phasor c;
  algorithm
    c := product(a, Phasor(a.re, -a.im));
    size := c.re;
  end square;
  input Real u;
  input Real v;
  output Real re;
  output Real im;
  output Real size;
  Phasor p;
  Phasor q = product(p, Phasor(2, u));
equation
  p = Phasor(u, v);
  re = q.re;
  im = q.im;
  size = square(q);
end M;""")
    for _, inputs in model.simulate(20):
        p = complex(inputs["u"], inputs["v"])
        expected = p * complex(2, inputs["u"])
        assert complex(model.get("re"), model.get("im")) == pytest.approx(expected, rel=1e-14)
        assert model.get("size") == pytest.approx(abs(expected) ** 2, rel=1e-13)


def test_a_declared_value_of_an_input_is_its_start_value(compile_both):
    model = compile_both("model M\n  input Real u = 2.5;\n  output Real y = 2*u;\nend M;")
    model.initialize()
    assert model.get("y") == 5
    model.set(u=3.0)
    model.step(0.0)
    assert model.get("y") == 6
