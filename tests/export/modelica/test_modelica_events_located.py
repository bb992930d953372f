"""Models with event iteration: located crossings, values before events, delays; C code and
interpreter are equal bit for bit.
"""

from __future__ import annotations

import math
import re

import modelica_hybrid_interpreter as hybrid_interpreter
import numpy as np
import pytest

from cosim.core.errors import ComponentError

BALL = """model Ball
  parameter Real e = 0.8;
  output Real h(start = 1, fixed = true);
  output Real v(start = 0, fixed = true);
  output Integer bounces(start = 0, fixed = true);
equation
  der(h) = v;
  der(v) = -9.81;
  when h < 0 then
    reinit(v, -e*pre(v));
    bounces = pre(bounces) + 1;
  end when;
end Ball;"""


def test_a_bouncing_ball_follows_the_closed_form(compile_both):
    model = compile_both(BALL)
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    first = math.sqrt(2 / 9.81)
    speed, since = 0.8 * 9.81 * first, 1.0 - first
    assert model.get("bounces") == 1
    assert model.get("h") == pytest.approx(speed * since - 9.81 / 2 * since**2, abs=1e-8)
    assert model.get("v") == pytest.approx(speed - 9.81 * since, abs=1e-8)


def test_the_step_size_has_no_effect_on_located_events(compile_both):
    model, heights = compile_both(BALL), []
    for h in (0.01, 0.05):
        model.initialize()
        for k in range(round(1.5 / h)):
            model.step(k * h, h)
        heights.append(model.get("h"))
    assert heights[0] == pytest.approx(heights[1], abs=1e-7)


def test_a_hysteresis_remembers_its_value_before_the_event(compile_both):
    model = compile_both("""model Hysteresis
  input Real u;
  output Boolean y(start = false);
equation
  y = not pre(y) and u > 1 or pre(y) and u >= -1;
end Hysteresis;""")
    model.initialize()
    expected = False
    for _, inputs in model.run():
        expected = (not expected and inputs["u"] > 1) or (expected and inputs["u"] >= -1)
        assert model.get("y") == expected


def test_a_chain_of_events_is_iterated_to_its_end(compile_both):
    model = compile_both("""model Chain
  input Real u;
  output Integer first(start = 0, fixed = true);
  output Integer second(start = 0, fixed = true);
  output Integer third(start = 0, fixed = true);
equation
  when u > 1 then
    first = pre(first) + 1;
  end when;
  when change(first) then
    second = pre(second) + first;
  end when;
  when second <> pre(second) then
    third = pre(third) + 1;
  end when;
end Chain;""")
    model.initialize()
    rises, before = 0, False
    for _, inputs in model.run():
        rises += inputs["u"] > 1 and not before
        before = inputs["u"] > 1
        assert (model.get("first"), model.get("second"), model.get("third")) == (
            rises,
            rises * (rises + 1) // 2,
            rises,
        )
    assert rises > 10


def test_an_oscillator_between_two_thresholds_has_the_exact_period(compile_both):
    model = compile_both("""model Relay
  output Real x(start = 0, fixed = true);
  output Boolean up(start = true, fixed = true);
  output Integer turns(start = 0, fixed = true);
  output Real turned(start = 0, fixed = true);
equation
  der(x) = if up then 1 else -1;
  up = pre(up) and x < 0.1 or not pre(up) and x < -0.1;
  when change(up) then
    turns = pre(turns) + 1;
    turned = time;
  end when;
end Relay;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("turns") == 5
    assert model.get("turned") == pytest.approx(0.9, abs=1e-8)


def test_a_delay_returns_past_values_of_inputs_and_states(compile_both):
    model = compile_both("""model Delay
  input Real u;
  output Real y;
  output Real z;
  output Real x(start = 0, fixed = true);
equation
  der(x) = cos(time);
  y = delay(u, 0.025);
  z = delay(x, 0.1);
end Delay;""")
    model.initialize()
    inputs = [0.0]
    for k, values in model.run(100):
        inputs.append(values["u"])
        if k > 3:
            assert model.get("y") == inputs[-3]
        time = (k + 1) * 0.01
        assert model.get("z") == pytest.approx(math.sin(max(0.0, time - 0.1)), abs=1e-5)


def test_a_sample_is_a_condition_like_any_other(compile_both):
    model = compile_both("""model Sampled
  input Real u;
  output Real y(start = 0, fixed = true);
  output Integer n(start = 0, fixed = true);
  Boolean trigger;
equation
  trigger = sample(0, 0.02);
  when {trigger, initial()} then
    y = u;
  end when;
  when trigger and u > 0 then
    n = pre(n) + 1;
  end when;
end Sampled;""")
    model.initialize()
    count, held = 0, 0.0
    for k, inputs in model.run():
        if k % 2 == 0:
            held = inputs["u"]
            count += held > 0
        assert (model.get("y"), model.get("n")) == (held, count)


def test_an_event_that_repeats_itself_is_a_failure(compile_both):
    model = compile_both("""model Endless
  output Boolean b(start = false);
  input Real u;
equation
  b = if u > 0 then not pre(b) else false;
end Endless;""")
    model.initialize()
    model.set(u=1.0)
    assert (
        model.c.step(0.0, 0.01)
        == "the event iteration does not end: b changes in each evaluation (Endless.mo:2)"
    )
    with pytest.raises(
        ComponentError, match="the event iteration does not end: b changes in each evaluation"
    ):
        model.python.step(0.0, 0.01)


def test_rounded_values_change_at_located_events(compile_both):
    """Integrals of rounded values of a rising and a falling time, against their exact sums; modulo
    and rest have both signs.
    """
    model = compile_both("""model Rounded
  Real x(start = 0, fixed = true);
  output Real y[6](each start = 0, each fixed = true);
equation
  der(x) = 1;
  der(y[1]) = floor(3.1*x);
  der(y[2]) = ceil(-2.3*x);
  der(y[3]) = integer(1 - 4.7*x);
  der(y[4]) = div(0.9 - 2.2*x, 0.3);
  der(y[5]) = mod(1 - 1.7*x, 0.45);
  der(y[6]) = rem(1 - 1.7*x, 0.45);
end Rounded;""")
    model.initialize()
    for k in range(10):
        model.step(k * 0.1, 0.1)
    middles = (np.arange(1_000_000) + 0.5) / 1e6
    quotient = (1 - 1.7 * middles) / 0.45
    expected = [
        np.floor(3.1 * middles),
        np.ceil(-2.3 * middles),
        np.floor(1 - 4.7 * middles),
        np.trunc((0.9 - 2.2 * middles) / 0.3),
        0.45 * (quotient - np.floor(quotient)),
        0.45 * (quotient - np.trunc(quotient)),
    ]
    assert list(model.get("y")) == pytest.approx([values.mean() for values in expected], abs=2e-6)


def test_chattering_is_a_failure_that_names_the_relation(compile_both, monkeypatch):
    monkeypatch.setattr(hybrid_interpreter, "MAX_EVENTS", 20)
    model = compile_both("""model Relay
  Real x(start = 0, fixed = true);
  output Real y;
  input Real u;
equation
  der(x) = if x > u then -1 else 1;
  y = x;
end Relay;""")
    model.set(u=0.1)
    model.initialize()
    expected = "too many events in one step (chattering): x > u changes again and again"
    assert model.c.step(0.0, 0.2) == f"{expected} (Relay.mo:6)"
    with pytest.raises(ComponentError, match=re.escape(expected)):
        model.python.step(0.0, 0.2)


def test_temporary_values_of_equations_and_relations_do_not_collide(compile_both):
    model = compile_both("""model Temporaries
  parameter Real k = 2;
  parameter Real a[3] = {1, 3, 4};
  Real x[2](start = {1, 2}, each fixed = true);
  output Real y;
equation
  der(x) = -k*x;
  y = (a[2:3] - k*a[1:2])*x + (if k*x[1]*x[2] > 0.5 then 1 else 0);
end Temporaries;""")
    model.initialize()
    for n in range(100):
        model.step(n * 0.01)
    assert model.get("y") == pytest.approx((1 - 2 * 2) * math.exp(-2), abs=1e-8)
