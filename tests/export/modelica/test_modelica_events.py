"""Events: `when` clauses, clocks, `pre`, `edge` and `change`.

C and interpreter are compared bit for bit, both with references written by hand.
"""

from __future__ import annotations


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
    for _, inputs in model.run():
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
    for _, inputs in model.run():
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
    for k, inputs in model.run():
        u = inputs["u"]
        if u > 1 and was <= 1:
            y += 1
        elif u < 2 and was >= 2:
            y -= 1
        if k % 2 == 0:
            z = u
        elif u > 0 and was <= 0:
            z = -u
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
    for tick, inputs in double.run():
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


def test_an_edge_of_a_component_input_starts_a_delay(compile_both):
    model = compile_both("""model M
  block OnDelay
    input Boolean u;
    output Boolean y;
  protected
    Boolean waiting(start = false, fixed = true);
    discrete Real t_next;
  initial equation
    pre(u) = false;
    pre(t_next) = time - 1;
  algorithm
    when initial() then
      waiting := u;
      t_next := time - 1;
    elsewhen u then
      waiting := true;
      t_next := time + 0.025;
    elsewhen not u then
      waiting := false;
      t_next := time - 1;
    end when;
  equation
    y = waiting and time >= t_next;
  end OnDelay;
  input Boolean u;
  output Boolean y = delay.y;
  OnDelay delay(u = u);
end M;""")
    model.initialize()
    levels = [False, True, True, True, True, True, False, True, True, False]
    outputs = []
    for k, level in enumerate(levels):
        model.set(u=level)
        model.step(0.01 * k)
        outputs.append(model.get("y"))
    assert outputs == [False, False, False, True, True, True, False, False, False, False]
