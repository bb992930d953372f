"""Algorithms: order of statements, loops, branches and assertions.

C and interpreter are compared bit for bit, both with references written by hand.
"""

from __future__ import annotations

import numpy as np
import pytest

from cosim.core.errors import ComponentError


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
    for _, inputs in model.simulate():
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
    for _, inputs in model.simulate(50):
        assert list(model.get("y")) == list(inputs["u"][::-1] * np.arange(1, 9))


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
    for _, i in model.simulate():
        u, k = i["u"], i["k"]
        if u > 1:
            y = 1.0
        elif k > 0:
            y = 2.0
        elif k < -2:
            y = 3.0
        if u > 0:
            z = 5.0
        else:
            z = 6.0 if k > 0 else z
            y += 1
        assert (model.get("y"), model.get("z")) == (y, z)


def test_a_branch_that_a_constant_excludes_may_have_subscripts_out_of_range(compile_both):
    model = compile_both("""package P
  constant Integer axes = 2;
  function height
    input Real position[axes];
    output Real y;
  algorithm
    if axes > 2 then
      y := position[3];
    else
      y := 0.5*position[2];
    end if;
  end height;
end P;
model M
  input Real u[2];
  output Real y;
equation
  when sample(0, 0.01) then
    y = P.height(u);
  end when;
end M;""")
    for _, inputs in model.simulate(10):
        assert model.get("y") == 0.5 * inputs["u"][1]


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
    for _, inputs in model.simulate(50):
        assert model.get("y") == (1 + inputs["u"] if inputs["u"] > 0 else 1)


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
