"""Timing of sampled models: ticks in [t, t + h), start times, several rates, models without a
clock.
"""

from __future__ import annotations

import pytest

from cosim.core.errors import ComponentError

COUNTER = """model Counter
  parameter Real Ts(unit = "s") = 0.01;
  input Real u;
  output Integer n(start = 0, fixed = true);
  output Real t(start = -1, fixed = true);
  output Real sum_u(start = 0, fixed = true);
equation
  when sample(0, Ts) then
    n = pre(n) + 1;
    t = time;
    sum_u = pre(sum_u) + u;
  end when;
end Counter;"""


def test_one_tick_per_step_and_no_drift_over_100_seconds(compile_both):
    model = compile_both(COUNTER)
    model.initialize()
    for k in range(10_000):
        assert model.c.step(k * 0.01, 0.01) is None
        assert (model.get("n"), model.get("t")) == (k + 1, k * 0.01)


def test_a_long_step_runs_all_its_ticks_with_constant_inputs(compile_both):
    model = compile_both(COUNTER)
    model.initialize()
    model.set(u=2.0)
    model.step(0.0, 0.05)
    assert (model.get("n"), model.get("t"), model.get("sum_u")) == (5, 0.04, 10.0)
    model.step(0.05, 0.05)
    assert (model.get("n"), model.get("t")) == (10, 0.09)


def test_a_step_shorter_than_the_period_runs_a_tick_only_if_it_contains_one(compile_both):
    model = compile_both(COUNTER)
    model.initialize()
    counts = []
    for k in range(8):
        model.step(k * 0.004, 0.004)
        counts.append(model.get("n"))
    assert counts == [1, 1, 2, 2, 2, 3, 3, 4]


@pytest.mark.parametrize(
    ("start", "first"), [(3.0, 3.0), (0.005, 0.01), (7.28, 7.28), (-0.025, 0.0)]
)
def test_the_first_tick_is_the_first_one_not_before_the_start_time(compile_both, start, first):
    model = compile_both(COUNTER)
    model.initialize(start)
    k = 0
    while model.get("n") == 0:
        model.step(start + k * 0.01, 0.01)
        k += 1
    assert model.get("t") == pytest.approx(first, abs=1e-12)


def test_a_period_parameter_takes_effect_at_the_initialization(compile_both):
    model = compile_both(COUNTER)
    assert model.c.variables["Ts"].variability == "fixed"
    model.set(Ts=0.02)
    model.initialize()
    model.step(0.0, 0.1)
    assert (model.get("n"), model.get("t")) == (5, 0.08)
    assert model.c.block.step_size == 0.01


def test_a_period_that_is_not_positive_is_a_failure(compile_both):
    model = compile_both(COUNTER)
    model.set(Ts=0.0)
    assert model.c.initialize() == "the period of sample() must be positive"
    with pytest.raises(ComponentError, match=r"the period of sample\(\) must be positive"):
        model.python.initialize()


def test_an_offset_delays_the_first_tick(compile_both):
    model = compile_both(COUNTER.replace("sample(0, Ts)", "sample(0.03, Ts)"))
    model.initialize()
    model.step(0.0, 0.05)
    assert (model.get("n"), model.get("t")) == (2, 0.04)


def test_two_rates_tick_together_where_they_meet(compile_both):
    model = compile_both("""model M
  input Real u;
  output Integer fast(start = 0, fixed = true);
  output Integer slow(start = 0, fixed = true);
  output Integer seen;
  output Real held(start = 0, fixed = true);
equation
  when sample(0, 0.01) then
    fast = pre(fast) + 1;
    seen = slow;
  end when;
  when sample(0, 0.03) then
    slow = pre(slow) + 1;
    held = u;
  end when;
end M;""")
    assert model.c.block.step_size == 0.01
    model.initialize()
    held = 0.0
    for k, inputs in model.run(300):
        held = inputs["u"] if k % 3 == 0 else held
        assert [model.get(name) for name in ("fast", "slow", "seen", "held")] == [
            k + 1,
            k // 3 + 1,
            k // 3 + 1,
            held,
        ]


def test_a_long_step_keeps_the_order_of_two_rates(compile_both):
    model = compile_both("""model M
  output Integer a(start = 0, fixed = true);
  output Integer b(start = 0, fixed = true);
equation
  when sample(0, 0.02) then
    b = pre(b) + 1;
  end when;
  when sample(0.01, 0.02) then
    a = 10*pre(a) + b;
  end when;
end M;""")
    model.initialize()
    model.step(0.0, 0.1)
    assert model.get("a") == 12345


def test_a_model_without_a_clock_is_computed_at_the_end_of_the_step(compile_both):
    model = compile_both("""model M
  parameter Real k = 2;
  input Real u;
  output Real y;
equation
  y = k*u + time;
end M;""")
    assert model.c.block.step_size == 0.01
    assert (model.c.variables["u"].variability, model.c.variables["y"].variability) == (
        "continuous",
        "continuous",
    )
    model.set(u=1.0)
    model.initialize(5.0)
    assert model.get("y") == 7.0
    model.set(u=3.0, k=4.0)
    model.step(5.0, 0.5)
    assert model.get("y") == 17.5


def test_a_step_after_a_failed_step_can_succeed(compile_both):
    model = compile_both(
        COUNTER.replace("    t = time;", '    t = time;\n    assert(u < 1, "too large");')
    )
    model.initialize()
    model.set(u=5.0)
    assert model.c.step(0.0, 0.01) == "too large (Counter.mo:11)"
    model.set(u=0.0)
    assert model.c.step(0.01, 0.01) is None
