"""Clocked equations with inferred clocks against loops in Python; C code and interpreter are equal
bit for bit.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from modelica_interpreter import load_interpreter

from cosim.core.errors import InputError

STEP = 0.01


def outputs(model, values, name: str = "y") -> list[float]:
    """Return an output after each step, with the input constant during the step."""
    model.initialize()
    result = []
    for k, value in enumerate(values):
        model.set(u=value)
        model.step(k * STEP, STEP)
        result.append(model.get(name))
    return result


def random_values(count: int = 100) -> np.ndarray:
    return np.random.default_rng(3).uniform(-1, 1, count)


def test_a_sum_counts_the_ticks_of_its_clock(compile_both):
    model = compile_both("""block Sum
  input Real u;
  output Real y;
  Clock c = Clock(1, 20);
  Real s;
  Real x(start = 10);
equation
  s = sample(u, c);
  x = previous(x) + s;
  y = hold(x);
end Sum;""")
    values = random_values()
    expected = 10 + np.repeat(np.cumsum(values[::5]), 5)
    assert outputs(model, values) == pytest.approx(expected, abs=1e-12)


def test_clocks_are_inferred_through_components_and_conversions(compile_both):
    model = compile_both("""model Rates
  connector ClockInput = input Clock;
  connector ClockOutput = output Clock;
  block Periodic
    parameter Real period = 1;
    ClockOutput c;
  equation
    c = Clock(period);
  end Periodic;
  block Sampler
    ClockInput clock;
    input Real u;
    output Real y;
  equation
    y = sample(u, clock);
  end Sampler;
  input Real u;
  output Real y;
  output Real slow;
  output Real fast;
  Periodic periodic(period = 0.02);
  Sampler sampler;
  Real third;
  Real doubled;
  Real sum(start = 0);
equation
  connect(periodic.c, sampler.clock);
  sampler.u = u;
  third = subSample(sampler.y, 3);
  doubled = superSample(third, 2);
  sum = previous(sum) + doubled;
  y = hold(sampler.y);
  slow = hold(third);
  fast = hold(sum);
end Rates;""")
    values = random_values(60)
    assert outputs(model, values) == list(np.repeat(values[::2], 2))
    assert outputs(model, values, "slow") == list(np.repeat(values[::6], 6))
    sums = np.cumsum(np.repeat(values[::6], 2))
    assert outputs(model, values, "fast") == pytest.approx(np.repeat(sums, 3), abs=1e-12)


def test_shifted_samples_arrive_later_and_backwards_shifted_ones_in_time(compile_both):
    model = compile_both("""model Shifts
  input Real u;
  output Real y;
  output Real half;
  output Real late;
  output Real back;
  Clock c = Clock(4, 100);
  Real x(start = 7);
  Real a(start = 8);
  Real b(start = 9);
  Real d(start = 5);
equation
  x = sample(u, c);
  a = shiftSample(x, 1, 2);
  b = shiftSample(x, 3, 2);
  d = backSample(a, 1, 2);
  y = hold(x);
  half = hold(a);
  late = hold(b);
  back = hold(d);
end Shifts;""")
    values = random_values(40)
    ticks = values[::4]
    assert outputs(model, values) == list(np.repeat(ticks, 4))
    assert outputs(model, values, "half") == [8, 8, *np.repeat(ticks, 4)[:-2]]
    assert outputs(model, values, "late") == [9] * 6 + list(np.repeat(ticks[1:], 4)[:-2])
    assert outputs(model, values, "back") == [8] * 4 + list(np.repeat(ticks, 4)[:-4])


def test_a_clocked_when_clause_knows_its_interval_and_the_first_tick(compile_both):
    model = compile_both("""block Integral
  input Real u;
  output Real y;
  output Real peak;
  Clock c = Clock(0.05);
  Real s;
  Real x(start = 0);
  Real m(start = 0);
equation
  s = sample(u, c);
  when Clock() then
    x = previous(x) + interval()*s;
  end when;
  m = if firstTick() then s else max(previous(m), s);
  y = hold(x);
  peak = hold(m);
end Integral;""")
    values = random_values()
    assert outputs(model, values) == pytest.approx(
        np.repeat(np.cumsum(values[::5]) * 0.05, 5), abs=1e-12
    )
    assert outputs(model, values - 2, "peak") == pytest.approx(
        np.repeat(np.maximum.accumulate(values[::5] - 2), 5)
    )


def test_a_clocked_controller_drives_a_continuous_plant(compile_both):
    """The plant der(x) = u - x is exact over a period: x' = x e^-T + u (1 - e^-T)."""
    model = compile_both("""model Loop
  output Real x(start = 1, fixed = true);
  Clock c = Clock(1, 10);
  Real s;
  Real i(start = 0);
  Real u;
  output Boolean high;
  Boolean h;
equation
  der(x) = hold(u) - x;
  s = sample(x, c);
  i = previous(i) + interval()*(0.5 - s);
  u = 2*(0.5 - s) + i;
  h = s > 0.5;
  high = hold(h);
end Loop;""")
    model.initialize()
    x, i, decay = 1.0, 0.0, math.exp(-0.1)
    for k in range(30):
        model.step(k * 0.1, 0.1)
        i += 0.1 * (0.5 - x)
        assert model.get("high") == (x > 0.5)
        x = x * decay + (2 * (0.5 - x) + i) * (1 - decay)
        assert model.get("x") == pytest.approx(x, abs=1e-6)


def test_a_condition_can_be_a_clock(compile_both):
    model = compile_both("""model Counter
  input Boolean u;
  output Integer y;
  Integer n(start = 0);
  Boolean b;
  Clock c = Clock(b);
equation
  b = u;
  when c then
    n = previous(n) + 1;
  end when;
  y = hold(n);
end Counter;""")
    values = np.random.default_rng(1).random(50) < 0.5
    rising = np.cumsum(values & ~np.concatenate([[False], values[:-1]]))
    assert outputs(model, values) == list(rising)


BAD = {
    "two clocks": (
        "s = sample(u, c); t = sample(u, d); x = s + t;",
        "Bad.mo:8: sample(value, clock) names a clock that conflicts",
    ),
    "two constructors": (
        "s = sample(u, c); x = previous(x) + s; t = x; c2 = d; c2 = c;",
        "Bad.mo:8: unresolved clock schedule for `c2 = c`",
    ),
    "input": (
        "s = sample(u, c); x = previous(x) + s*u; t = x;",
        "Bad.mo:8: u belongs to no clock; write sample() of it",
    ),
    "time": (
        "s = sample(u, c); x = previous(x) + s*time; t = x;",
        "Bad.mo:8: time belongs to no clock; write sample() of it",
    ),
    "before the start": (
        "s = sample(u, c); t = backSample(s, 1, 2); x = t;",
        "Bad.mo:8: backSample would start the clock before",
    ),
    "no clock": (
        "s = sample(u); t = s; x = previous(x) + t;",
        "Bad.mo:8: sample(value) has more than one possible inferred clock",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_clocks_that_cannot_be_translated_end_in_one_line(write_model, case):
    equations, message = BAD[case]
    path = write_model(f"""block Bad
  input Real u;
  output Real y;
  Real s; Real t; Real x(start = 0);
  Clock c = Clock(1, 5);
  Clock d = Clock(0.1);{" Clock c2;" if "c2" in equations else ""}
equation
  {equations}
  y = hold(x);
end Bad;""")
    with pytest.raises(InputError) as error:
        load_interpreter(path)
    assert message in str(error.value)


def test_a_sampled_value_is_the_one_before_a_jump_at_the_same_time(compile_both):
    model = compile_both("""model Jumps
  output Real y;
  output Boolean b;
  output Real before(start = -1, fixed = true);
  Clock c = Clock(0.1);
  Real t(start = 0, fixed = true);
  Real w;
  Real s;
  Boolean r;
equation
  der(t) = 1;
  w = t + (if time < 0.3 then 0 else 5);
  s = sample(w, c);
  y = hold(s);
  r = sample(time >= 0.3 and time < 0.5, c);
  b = hold(r);
  when time >= 0.3 then
    before = pre(w);
  end when;
end Jumps;""")
    model.initialize()
    found = []
    for k in range(60):
        model.step(k * STEP, STEP)
        found.append((model.get("y"), model.get("b"), model.get("before")))
    ticks = [0.0, 0.1, 0.2, 0.3, 5.4, 5.5]
    assert [row[0] for row in found] == pytest.approx(np.repeat(ticks, 10), abs=1e-9)
    assert [row[1] for row in found] == list(
        np.repeat([False, False, False, False, True, True], 10)
    )
    assert [row[2] for row in found] == pytest.approx([-1] * 29 + [0.3] * 31, abs=1e-9)


def test_a_held_value_acts_on_the_plant_after_the_sample_at_the_same_tick(compile_both):
    model = compile_both("""model Loop
  input Real u;
  output Real y(start = 0, fixed = true);
  Clock c = Clock(0.1);
  Real w;
  Real s;
  Real z(start = 0);
  Real h;
equation
  der(y) = h - y;
  w = 0.3*(y + h) + 0.2*u;
  s = sample(w, c);
  z = 1 - s;
  h = hold(z);
end Loop;""")
    values, y, h, expected = random_values(60), 0.0, 0.0, []
    for k, u in enumerate(values):
        if k % 10 == 0:
            h = 1 - 0.3 * (y + h) - 0.2 * u
        y = h + (y - h) * math.exp(-STEP)
        expected.append(y)
    assert outputs(model, values) == pytest.approx(expected, abs=1e-9)


def test_a_fixed_start_value_of_a_clocked_variable_is_its_previous_value_at_the_first_tick(
    compile_both,
):
    model = compile_both("""model Counter
  input Real u;
  output Real y;
  Clock c = Clock(0.02);
  Real s;
  Real n(start = 3, fixed = true);
equation
  s = sample(u, c);
  n = previous(n) + s;
  y = hold(n);
end Counter;""")
    values = random_values(20)
    assert outputs(model, values) == pytest.approx(
        np.repeat(3 + np.cumsum(values[::2]), 2), abs=1e-12
    )


def test_a_clock_with_a_condition_can_act_on_its_condition(compile_both):
    model = compile_both("""model Distance
  output Real y;
  Real x(start = 0, fixed = true);
  Boolean far = x - y >= 0.25;
  Clock c = Clock(far);
  Real s(start = 0);
equation
  der(x) = 1;
  s = sample(x, c);
  y = hold(s);
end Distance;""")
    model.initialize()
    found = []
    for k in range(90):
        model.step(k * STEP, STEP)
        found.append(model.get("y"))
    assert found == pytest.approx(
        [0.25 * math.floor((k + 1) * STEP / 0.25 + 1e-9) for k in range(90)], abs=1e-8
    )
