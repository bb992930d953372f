"""Semantics of each language construct, compared with hand-written references; C and interpreter are bit-identical."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cosim.core.errors import ComponentError

TICKS = 500


def run(model, ticks=TICKS, **parameters):
    model.set(**parameters)
    model.initialize()
    yield from model.run(ticks)


def test_matrix_times_vector(compile_both):
    model = compile_both("""model M
  parameter Real A[2, 3] = {{1, 2, 3}, {4, 5, 6}};
  input Real x[3];
  output Real y[2];
  output Real s;
  output Real v[3];
equation
  when sample(0, 0.01) then
    y = A*x;
    s = x*x;
    v = {1, 2}*A + 2*x;
  end when;
end M;""")
    a = np.arange(6.0).reshape(2, 3) * 0.7 - 1.1
    for _, inputs in run(model, A=a):
        x = inputs["x"]
        assert list(model.get("y")) == [a[i, 0] * x[0] + a[i, 1] * x[1] + a[i, 2] * x[2] for i in range(2)]
        assert model.get("s") == x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
        assert list(model.get("v")) == [1 * a[0, j] + 2 * a[1, j] + 2 * x[j] for j in range(3)]


def test_matrix_products_transpose_and_slices(compile_both):
    model = compile_both("""model M
  input Real A[2, 3];
  output Real P[2, 2];
  output Real row[3];
  output Real column[2];
  output Real part[2];
equation
  when sample(0, 0.01) then
    P = A*transpose(A) + identity(2);
    row = A[2, :];
    column = A[:, 3];
    part = A[1, 2:3];
  end when;
end M;""")
    for _, inputs in run(model, 50):
        a = inputs["A"]
        np.testing.assert_allclose(model.get("P"), a @ a.T + np.eye(2), rtol=1e-14, atol=1e-14)
        assert list(model.get("row")) == list(a[1])
        assert list(model.get("column")) == list(a[:, 2])
        assert list(model.get("part")) == list(a[0, 1:])


def test_array_functions(compile_both):
    model = compile_both("""model M
  input Real x[4];
  input Integer k[3];
  output Real y[6];
  output Integer n[4];
  output Real c[3];
equation
  when sample(0, 0.01) then
    y = {sum(x), product(x), max(x), min(x), x[2]^2, x[1]^3};
    n = {sum(k), max(k), min(k), size(x, 1)};
    c = cross(x[1:3], {1.0, 2.0, 3.0}) + cat(1, {x[4]}, fill(0.5, 2));
  end when;
end M;""")
    for _, inputs in run(model):
        x, k = inputs["x"], [int(i) for i in inputs["k"]]
        expected = [x[0] + x[1] + x[2] + x[3], x[0] * x[1] * x[2] * x[3], max(x), min(x), x[1] * x[1], math.pow(x[0], 3)]
        assert list(model.get("y")) == expected
        assert list(model.get("n")) == [sum(k), max(k), min(k), 4]
        np.testing.assert_allclose(
            model.get("c"), np.cross(x[:3], [1, 2, 3]) + np.array([x[3], 0.5, 0.5]), rtol=1e-13, atol=1e-14
        )


def test_dynamic_subscripts_read_and_write(compile_both):
    model = compile_both("""model M
  input Integer k(min = 1, max = 4);
  input Real x;
  output Real q[4](each start = 0, each fixed = true);
  output Real y;
algorithm
  when sample(0, 0.01) then
    q[k] := x;
    y := q[5 - k] + q[k];
  end when;
end M;""")
    q = [0.0] * 4
    for _, inputs in run(model):
        k = int(inputs["k"])
        q[k - 1] = inputs["x"]
        assert list(model.get("q")) == q
        assert model.get("y") == q[4 - k] + q[k - 1]


def test_two_dynamic_subscripts(compile_both):
    model = compile_both("""model M
  input Integer i(min = 1, max = 2);
  input Integer j(min = 1, max = 3);
  parameter Real A[2, 3] = {{1, 2, 3}, {4, 5, 6}};
  output Real y;
equation
  when sample(0, 0.01) then
    y = A[i, j];
  end when;
end M;""")
    for _, inputs in run(model, 50):
        assert model.get("y") == 3 * inputs["i"] + inputs["j"] - 3


def test_a_subscript_out_of_range_fails_with_variable_and_line(compile_both):
    model = compile_both("""model M
  input Integer k;
  parameter Real wx[3] = {1, 2, 3};
  output Real y;
equation
  when sample(0, 0.01) then
    y = wx[k];
  end when;
end M;""")
    model.set(k=4)
    model.initialize()
    assert model.c.step(0.0, 0.01) == "wx: subscript outside 1..3 (M.mo:7)"
    with pytest.raises(ComponentError, match=r"M: step failed at t = 0 s: wx: subscript outside 1..3 \(M.mo:7\)"):
        model.python.step(0.0, 0.01)


def test_a_subscript_is_only_checked_where_it_is_evaluated(compile_both):
    model = compile_both("""model M
  input Integer k;
  parameter Real wx[3] = {1, 2, 3};
  output Real y;
  output Boolean b;
equation
  when sample(0, 0.01) then
    y = if k >= 1 and k <= 3 then wx[k] else -1;
    b = k >= 1 and k <= 3 and wx[k] > 1.5;
  end when;
end M;""")
    for _, inputs in run(model):
        inside = 1 <= inputs["k"] <= 3
        assert (model.get("y"), model.get("b")) == (inputs["k"] if inside else -1, inside and inputs["k"] > 1.5)


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
    for _, inputs in run(model):
        a, b = inputs["a"], inputs["b"]
        assert list(model.get("y")) == [0.0 + a[0] * 1 + a[1] * 2, 0.0 + b[0] + b[1] * 2 + b[2] * 3 + b[3] * 4]
        assert (model.get("r"), model.get("angle")) == (math.sqrt(a[0] * a[0] + a[1] * a[1]), math.atan2(a[1], a[0]))
        assert list(model.get("d")) == list(2 * a)
        assert list(model.get("e")) == list(2 * (2 * b) + b)


def test_enumerations_as_state_input_and_parameter(compile_both):
    model = compile_both("""type Mode = enumeration(idle, climb, hold);
model M
  parameter Mode first = Mode.climb;
  input Mode wanted;
  output Mode mode(start = Mode.idle, fixed = true);
  output Integer number;
equation
  when sample(0, 0.01) then
    mode = if pre(mode) == Mode.idle then first elseif wanted > Mode.climb then Mode.hold else pre(mode);
    number = Integer(mode);
  end when;
end M;""")
    assert model.c.variables["mode"].enumeration == (("idle", ""), ("climb", ""), ("hold", ""))
    assert model.c.variables["mode"].start == 1
    mode = 1
    for _, inputs in run(model, 50, first=2):
        mode = 2 if mode == 1 else 3 if inputs["wanted"] > 2 else mode
        assert (model.get("mode"), model.get("number")) == (mode, mode)


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
    for _, inputs in run(model):
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
    for _, inputs in run(model):
        x, k = inputs["x"], int(inputs["k"])
        quotient = math.trunc(x / 0.7)
        real = [math.floor(x), math.ceil(x), x - math.floor(x / 0.7) * 0.7, x - quotient * 0.7, quotient, np.sign(x)]
        assert list(model.get("r")) == real
        assert list(model.get("n")) == [math.floor(x), k % 3, int(math.fmod(k, 3)), int(k / 3), k % -3, abs(k)]


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
    for _, i in run(model):
        a, b, c, p, q = i["a"], i["b"], i["c"], i["p"], i["q"]
        assert list(model.get("y")) == [a - (b - c), (a - b) - c, a / (b * c), (a / b) * c, -(a + b) * c, -(a * a)]
        assert list(model.get("l")) == [p or (q and not p), (p or q) and not p, (a < b) == (b < c), (not (p and q)) != p]


def test_integer_quotients_are_real(compile_both):
    model = compile_both("""model M
  input Integer k(min = 1);
  output Real y;
equation
  when sample(0, 0.01) then
    y = 10/3 + 1/k + k/4;
  end when;
end M;""")
    for _, inputs in run(model, 50):
        assert model.get("y") == 10 / 3 + 1 / inputs["k"] + inputs["k"] / 4


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
    for k, inputs in run(model):
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
    for _, inputs in run(model, 20):
        u = inputs["u"]
        assert list(model.get("y")) == [u, u * u, u * u * u, u * u * u + 1]


def test_algorithms_keep_their_order_and_unassigned_variables_their_value(compile_both):
    model = compile_both(
        """model M
  input Real u;
  output Real total(start = 1, fixed = true);
  output Integer hits(start = 0, fixed = true);
  output Real q[3](each start = 0, each fixed = true);
algorithm
  when sample(0, 0.01) then
    if u > 1 then
      hits := hits + 1;
    elseif u < -1 then
      hits := pre(hits) - 1;
    end if;
    q := {q[3], q[1], q[2]};
    q[1] := q[1] + u;
    total := total + q[1] + q[2] + q[3];
  end when;
end M;"""
    )
    total, hits, q = 1.0, 0, [0.0, 0.0, 0.0]
    for _, inputs in run(model):
        u = inputs["u"]
        hits += (u > 1) - (u < -1)
        q = [q[2] + u, q[0], q[1]]
        total = total + q[0] + q[1] + q[2]
        assert (model.get("total"), model.get("hits"), list(model.get("q"))) == (total, hits, q)


def test_loops_assign_elements(compile_both):
    model = compile_both("""model M
  input Real u[8];
  output Real y[8](each start = 0, each fixed = true);
algorithm
  when sample(0, 0.01) then
    for i in 1:8 loop
      y[i] := u[9 - i]*i;
    end for;
  end when;
end M;""")
    for _, inputs in run(model, 50):
        assert list(model.get("y")) == list(inputs["u"][::-1] * np.arange(1, 9))


def test_pre_edge_and_change_see_the_tick_before(compile_both):
    model = compile_both("""model M
  input Real u;
  Real twice;
  output Real before;
  output Boolean rising;
  output Boolean changed;
  output Boolean armed(start = false, fixed = true);
equation
  twice = 2*u;
  when sample(0, 0.01) then
    before = pre(twice);
    rising = edge(armed);
    changed = change(armed);
    armed = u > 0;
  end when;
end M;""")
    model.set(u=0.25)
    model.initialize()
    before, was = 0.5, False
    for _, inputs in model.run(TICKS):
        armed = inputs["u"] > 0
        assert model.get("before") == before
        assert (model.get("rising"), model.get("changed")) == (armed and not was, armed != was)
        before, was = 2 * inputs["u"], armed


def test_when_with_a_condition_is_active_once_when_it_becomes_true(compile_both):
    model = compile_both("""model M
  input Real u;
  output Integer rises(start = 0, fixed = true);
  output Real ticks(start = 0, fixed = true);
  output Boolean high;
equation
  high = u > 0.5;
  when high then
    rises = pre(rises) + 1;
  end when;
  when sample(0, 0.01) then
    ticks = pre(ticks) + 1;
  end when;
end M;""")
    model.set(u=1.0)
    model.initialize()
    rises, high = 0, True
    for _, inputs in model.run(TICKS):
        rises += inputs["u"] > 0.5 and not high
        high = inputs["u"] > 0.5
        assert (model.get("rises"), model.get("high")) == (rises, high)


def test_elsewhen_is_active_if_no_earlier_branch_is(compile_both):
    model = compile_both("""model M
  input Real u;
  output Real y(start = 0, fixed = true);
  output Real z(start = 0, fixed = true);
equation
  when u > 1 then
    y = pre(y) + 1;
  elsewhen u < 2 then
    y = pre(y) - 1;
  end when;
  when sample(0, 0.02) then
    z = u;
  elsewhen u > 0 then
    z = -u;
  end when;
  when sample(0, 0.01) then
  end when;
end M;""")
    model.set(u=-1.0)
    model.initialize()
    y, z, was = 0.0, 0.0, -1.0
    for k, inputs in model.run(TICKS):
        u = inputs["u"]
        y += 1 if u > 1 and was <= 1 else -1 if u < 2 and was >= 2 else 0
        z = u if k % 2 == 0 else -u if u > 0 and was <= 0 else z
        was = u
        assert (model.get("y"), model.get("z")) == (y, z)


def test_a_when_clause_can_have_a_clock_and_a_condition(compile_both):
    text = """model M
  input Real u;
  output Integer n(start = 0, fixed = true);
  output Integer k(start = 0, fixed = true);
equation
  when {{sample(0, 0.02), u > 1}} then
    n = pre(n) + 1;
  end when;
  when sample(0, {0}) then
    k = pre(k) + 1;
  end when;
end M;"""
    single = compile_both(text.format("0.02"))
    single.initialize()
    single.step(0.0, 0.1)
    assert (single.get("n"), single.get("k")) == (5, 5)
    double = compile_both(text.format("0.01").replace("M;", "N;").replace("model M", "model N"))
    double.set(u=0.0)
    double.initialize()
    n, was = 0, 0.0
    for tick, inputs in double.run(TICKS):
        n += tick % 2 == 0 or (inputs["u"] > 1 and was <= 1)
        was = inputs["u"]
        assert (double.get("n"), double.get("k")) == (n, tick + 1)


def test_a_when_clause_with_initial_is_active_at_the_initialization_only(compile_both):
    model = compile_both("""model M
  parameter Integer n0 = 3;
  output Integer n(start = 0, fixed = true);
  output Integer k(start = 0, fixed = true);
algorithm
  when initial() then
    n := n0;
  end when;
equation
  when sample(0, 0.01) then
    k = pre(k) + n;
  end when;
end M;""")
    model.set(n0=4)
    model.initialize()
    assert (model.get("n"), model.get("k")) == (4, 0)
    model.step(0.0, 0.02)
    assert (model.get("n"), model.get("k")) == (4, 8)


def test_array_valued_choices_and_functions_inside_expressions(compile_both):
    model = compile_both("""package P
  function turned
    input Real v[2];
    output Real w[2];
  algorithm
    w := {-v[2], v[1]};
  end turned;
end P;
model M
  input Real u[2];
  input Boolean b;
  output Real y[2];
  output Real z;
  output Boolean c;
equation
  when sample(0, 0.01) then
    y = 2*(if b then P.turned(u) else u) + {1, 1};
    z = 1 + (if b then sum(P.turned(u)) else u[1]);
    c = b and sum(P.turned(u)) > 0 or not b and sum(P.turned(2*u)) > 1;
  end when;
end M;""")
    for _, i in run(model):
        u, b = i["u"], i["b"]
        turned = np.array([-u[1], u[0]])
        assert list(model.get("y")) == list(2 * (turned if b else u) + 1)
        assert model.get("z") == 1 + (turned[0] + turned[1] if b else u[0])
        assert model.get("c") == ((turned.sum() > 0) if b else (-(2 * u[1]) + 2 * u[0] > 1))


def test_arrays_of_one_element_and_columns_of_one(compile_both):
    model = compile_both("""model M
  input Real a[1];
  input Real B[2, 1];
  output Real y;
  output Real c[2];
equation
  when sample(0, 0.01) then
    y = a[1] + B[2, 1];
    c = B[:, 1] + {1, 2};
  end when;
end M;""")
    for _, i in run(model, 20):
        assert model.get("y") == i["a"][0] + i["B"][1, 0]
        assert list(model.get("c")) == list(i["B"][:, 0] + [1, 2])


def test_nested_branches_keep_their_statements_together(compile_both):
    model = compile_both("""model M
  input Real u;
  input Integer k;
  output Real y(start = 0, fixed = true);
  output Real z(start = 0, fixed = true);
algorithm
  when sample(0, 0.01) then
    if u > 1 then
      y := 1;
    else
      assert(u < 10, "too large");
      if k > 0 then
        y := 2;
      elseif k < -2 then
        y := 3;
      end if;
    end if;
    if u > 0 then
      z := 5;
    else
      if k > 0 then
        z := 6;
      end if;
      y := y + 1;
    end if;
  end when;
end M;""")
    y = z = 0.0
    for _, i in run(model):
        u, k = i["u"], i["k"]
        y = 1.0 if u > 1 else 2.0 if k > 0 else 3.0 if k < -2 else y
        if u > 0:
            z = 5.0
        else:
            z = 6.0 if k > 0 else z
            y += 1
        assert (model.get("y"), model.get("z")) == (y, z)


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
    for _, i in run(model, 50):
        assert model.get("copy.y") == i["vehicle.position.y"]
        assert model.get("scaled.x") == 2 * i["vehicle.position.x"]
        assert model.get("scaled.y") == (0 if i["vehicle.touching"] else i["vehicle.position.y"])


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
    for _, inputs in run(model, 100):
        u = inputs["u"]
        assert (model.get("y"), model.get("z")) == ((1, 2) if u > 1 else (3 * u, 3) if u < -1 else (u, 0))


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
    for _, inputs in run(model, 20, p=False):
        assert (model.get("y"), model.get("z")) == (2 * inputs["u"], 2)


def test_a_violated_assertion_stops_with_its_message(compile_both):
    model = compile_both("""model M
  input Real u;
  output Real y;
equation
  when sample(0, 0.01) then
    y = u;
    assert(u < 2, "u is \\"too\\" large");
  end when;
end M;""")
    model.set(u=1.0)
    model.initialize()
    model.step(0.0)
    model.set(u=2.5)
    assert model.c.step(0.01, 0.01) == 'u is "too" large (M.mo:7)'
    with pytest.raises(ComponentError, match='u is "too" large'):
        model.python.step(0.01, 0.01)


@pytest.mark.parametrize(
    ("inputs", "reason"),
    [
        ({"k": 2**31 - 1}, "Integer overflow"),
        ({"d": 0}, "division by zero in div(), mod() or rem()"),
        ({"x": -1.0}, "y is not a finite number"),
        ({"x": 1e12}, "Integer overflow"),
        pytest.param({"k": 2**31 - 1, "x": -1.0}, "Integer overflow", id="the first failure counts"),
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
    with pytest.raises(ComponentError, match=f"M: step failed at t = 0 s: {reason.replace('(', '.').replace(')', '.')}"):
        model.python.step(0.0, 0.01)


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


def test_an_algorithm_without_when_is_computed_at_every_event(compile_both):
    model = compile_both("""model M
  input Real u;
  output Real y;
algorithm
  y := 1;
  if u > 0 then
    y := y + u;
  end if;
equation
  when sample(0, 0.01) then
  end when;
end M;""")
    for _, inputs in run(model, 50):
        assert model.get("y") == (1 + inputs["u"] if inputs["u"] > 0 else 1)
