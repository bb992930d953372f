"""Arrays: products, functions, slices and subscripts.

C and interpreter are compared bit for bit, both with references written by hand.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from cosim.core.errors import ComponentError


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
    for _, inputs in model.simulate(A=a):
        x = inputs["x"]
        assert list(model.get("y")) == [
            a[i, 0] * x[0] + a[i, 1] * x[1] + a[i, 2] * x[2] for i in range(2)
        ]
        assert model.get("s") == x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
        assert list(model.get("v")) == [1 * a[0, j] + 2 * a[1, j] + 2 * x[j] for j in range(3)]


def test_the_size_of_an_array_is_a_constant(compile_both):
    model = compile_both("""model M
  parameter Real A[2, 3] = {{1, 2, 3}, {4, 5, 6}};
  parameter Integer rows = size(A, 1);
  parameter Integer columns = size(A, 2);
  input Real u;
  output Real x[rows];
  output Real y[columns];
equation
  when sample(0, 0.01) then
    x = fill(u, rows);
    y = u*ones(columns);
  end when;
end M;""")
    for _, inputs in model.simulate(10):
        assert list(model.get("x")) == [inputs["u"]] * 2
        assert list(model.get("y")) == [inputs["u"]] * 3


def test_calls_with_constant_arguments_are_sizes_steps_and_bounds_inside_functions(compile_both):
    model = compile_both("""package P
  function raised
    input Real u;
    output Real y;
  algorithm
    y := sum(fill(u, integer(3.7)));
    for i in max(1, 0):div(5, 2):5 loop
      y := y + i;
    end for;
  end raised;
end P;
model M
  input Real u;
  output Real y;
equation
  when sample(0, 0.01) then
    y = P.raised(u);
  end when;
end M;""")
    for _, inputs in model.simulate(10):
        u = inputs["u"]
        assert model.get("y") == u + u + u + 1 + 3 + 5


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
    for _, inputs in model.simulate(50):
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
    for _, inputs in model.simulate():
        x, k = inputs["x"], [int(i) for i in inputs["k"]]
        expected = [
            x[0] + x[1] + x[2] + x[3],
            x[0] * x[1] * x[2] * x[3],
            max(x),
            min(x),
            x[1] * x[1],
            math.pow(x[0], 3),
        ]
        assert list(model.get("y")) == expected
        assert list(model.get("n")) == [sum(k), max(k), min(k), 4]
        np.testing.assert_allclose(
            model.get("c"),
            np.cross(x[:3], [1, 2, 3]) + np.array([x[3], 0.5, 0.5]),
            rtol=1e-13,
            atol=1e-14,
        )


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
    for _, i in model.simulate(20):
        assert model.get("y") == i["a"][0] + i["B"][1, 0]
        assert list(model.get("c")) == list(i["B"][:, 0] + [1, 2])


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
    for _, inputs in model.simulate():
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
    for _, inputs in model.simulate(50):
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
    with pytest.raises(
        ComponentError, match=r"M: step failed at t = 0 s: wx: subscript outside 1..3 \(M.mo:7\)"
    ):
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
    for _, inputs in model.simulate():
        inside = 1 <= inputs["k"] <= 3
        assert (model.get("y"), model.get("b")) == (
            inputs["k"] if inside else -1,
            inside and inputs["k"] > 1.5,
        )


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
    for _, i in model.simulate():
        u, b = i["u"], i["b"]
        turned = np.array([-u[1], u[0]])
        assert list(model.get("y")) == list(2 * (turned if b else u) + 1)
        assert model.get("z") == 1 + (turned[0] + turned[1] if b else u[0])
        assert model.get("c") == ((turned.sum() > 0) if b else (-(2 * u[1]) + 2 * u[0] > 1))


def test_a_function_may_iterate_over_an_array_of_any_size(compile_both):
    model = compile_both("""model Votes
  function count
    input Boolean b[:];
    output Integer n;
  algorithm
    n := sum({if b[i] then 1 else 0 for i in 1:size(b, 1)});
  end count;
  input Boolean u[3];
  output Integer y;
equation
  y = count(u);
end Votes;""")
    for _, values in model.simulate(20):
        assert model.get("y") == sum(values["u"])
