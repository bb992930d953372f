"""Continuous states: order and accuracy of the integration, constant inputs, ticks inside a step,
start values.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cosim.core.errors import ComponentError
from cosim.export.modelica import load_block

PENDULUM = """model Pendulum
  parameter Real w(unit = "rad/s") = 20;
  parameter Real damping = 0.3;
  input Real torque;
  output Real angle(start = 2, fixed = true);
  output Real rate(start = 0, fixed = true);
  output Real energy;
equation
  der(angle) = rate;
  der(rate) = -w^2*sin(angle) - damping*rate + torque;
  energy = rate^2/2 + w^2*(1 - cos(angle));
end Pendulum;"""

SAMPLED_LOOP = """model Loop "sampled speed loop on a continuous mass"
  parameter Real Ts = 0.01;
  output Real speed(start = 0, fixed = true);
  output Real force(start = 0, fixed = true);
  output Real way(start = 0, fixed = true);
equation
  der(speed) = force - 0.5*speed;
  der(way) = speed;
  when sample(0, Ts) then
    force = pre(force) + 0.2*(1 - speed);
  end when;
end Loop;"""

PLANT = """model Plant
  block Lag
    parameter Real T = 0.5;
    parameter Real y0 = 0.1;
    input Real u;
    output Real y(start = y0, fixed = true);
  equation
    der(y) = (u - y)/T;
  end Lag;
  parameter Real w = 3;
  input Real u;
  output Real q[2](start = {0.4, -0.2}, each fixed = true);
  output Real a;
  output Real last;
  output Integer ticks(start = 0, fixed = true);
  output Integer crossings(start = 0, fixed = true);
  Lag lag[2](T = {0.5, 0.25});
  Real s;
  Real level(start = 0, fixed = true);
initial equation
  s = w/2;
equation
  der(q) = {q[2], -w*q[1] + s};
  lag[1].u = u;
  connect(lag[1].y, lag[2].u);
  last = lag[2].y;
  a = if time > 0.3 then der(s) else der(lag[1].y) + level;
  der(s) = -w*s + max(u, 0);
  when sample(0.003, 0.02) then
    ticks = pre(ticks) + 1;
    level = pre(level) + q[1];
  end when;
  when q[1] > 0 then
    crossings = pre(crossings) + 1;
  end when;
end Plant;"""


def pendulum(_t, x, torque, w=20.0, damping=0.3):
    return [x[1], -(w**2) * math.sin(x[0]) - damping * x[1] + torque]


def reference(x, torque, duration):
    return solve_ivp(
        pendulum, (0, duration), x, "DOP853", args=(torque,), rtol=1e-13, atol=1e-13
    ).y[:, -1]


def state(model):
    return np.array([model.get("angle"), model.get("rate")])


def test_exponential_decay_agrees_with_the_exact_solution(compile_both):
    model = compile_both("""model Decay
  output Real x(start = 1, fixed = true);
equation
  der(x) = -x;
end Decay;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
        assert model.get("x") == pytest.approx(math.exp(-(k + 1) * 0.01), abs=1e-11)


def test_the_method_has_order_four(compile_both):
    model = compile_both(PENDULUM)
    errors = []
    for h in (0.0025, 0.00125, 0.000625):
        model.initialize()
        for k in range(round(0.5 / h)):
            assert model.c.step(k * h, h) is None
        errors.append(np.abs(state(model) - reference([2, 0], 0.0, 0.5)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx([4, 4], abs=0.25)


@pytest.mark.parametrize(
    ("step_size", "count"), [(0.002, 1), (0.005, 1), (0.0051, 2), (0.01, 2), (0.033, 7)]
)
def test_steps_are_split_into_equal_parts_of_at_most_five_milliseconds(
    compile_both, step_size, count
):
    model = compile_both(PENDULUM)
    model.initialize()
    model.step(0.0, step_size)
    x, h = np.array([2.0, 0.0]), step_size / count
    for _ in range(count):
        k1 = np.array(pendulum(0, x, 0))
        k2 = np.array(pendulum(0, x + h / 2 * k1, 0))
        k3 = np.array(pendulum(0, x + h / 2 * k2, 0))
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + np.array(pendulum(0, x + h * k3, 0)))
    assert state(model) == pytest.approx(x, rel=1e-14)


def test_inputs_are_constant_during_a_step_and_outputs_belong_to_its_end(compile_both):
    model = compile_both(PENDULUM)
    model.initialize()
    x = np.array([2.0, 0.0])
    for k, inputs in model.run(50, seed=1):
        x = reference(x, inputs["torque"], 0.01)
        assert state(model) == pytest.approx(x, abs=2e-4), k
    angle, rate = state(model)
    assert model.get("energy") == pytest.approx(
        rate**2 / 2 + 400 * (1 - math.cos(angle)), rel=1e-14
    )


def test_time_is_that_of_each_runge_kutta_stage(compile_both):
    model = compile_both("""model M
  output Real x(start = 0, fixed = true);
equation
  der(x) = 4*time^3;
end M;""")
    model.initialize(1.0)
    model.step(1.0, 1.0)
    assert model.get("x") == pytest.approx(
        2**4 - 1, rel=1e-14
    )  # Simpson's rule is exact for cubics


def test_c_and_interpreter_are_bit_identical_for_a_mixed_model(compile_both):
    model = compile_both(PLANT)
    parameters = [v for v in model.c.block.variables if v.causality == "parameter"]
    for seed in range(4):
        if seed:
            model.randomize(seed, [v for v in parameters if "T" not in v.name and v.name != "w"])
        model.initialize()
        for _ in model.run(60, seed, period=0.013):
            pass
    assert (model.get("ticks"), model.get("crossings")) > (30, 0)


def test_states_in_components_and_arrays_agree_with_the_exact_solution(compile_both):
    model = compile_both(PLANT)
    model.initialize()
    model.set(u=1.0)
    for k in range(100):
        model.step(k * 0.01)
    first, second = 0.1 - 1, 0.1 - 1  # (y0 - u) of both lags; T = 1/2 and 1/4
    expected = 1 + 2 * first * math.exp(-2) + (second - 2 * first) * math.exp(-4)
    assert model.get("last") == pytest.approx(expected, abs=1e-9)


def test_der_is_accepted_on_either_side_and_inside_expressions(compile_both):
    model = compile_both("""model Forms
  type Angle = Real(unit = "rad");
  record Motion
    Real position(start = 1);
    Real speed;
  end Motion;
  parameter Real w = 2;
  Motion body;
  Real acceleration;
  Angle phi[2, 2](start = {{0, 1}, {2, 3}});
  Real q[2](start = {1, 0});
  output Real x;
  output Real sum_phi;
  output Real slope;
equation
  body.speed = der(body.position);
  acceleration = der(body.speed);
  acceleration = -w^2*body.position;
  x = body.position;
  der(phi) = -phi*{{1, 0}, {0, 2}};
  sum_phi = sum(phi);
  der(q[1]) = -q[1];
  der(q[2]) = q[1] - q[2];
  slope = 2*sum(der(q));
end Forms;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("x") == pytest.approx(math.cos(2), abs=1e-9)
    assert model.get("sum_phi") == pytest.approx(2 * math.exp(-1) + 4 * math.exp(-2), abs=1e-9)
    assert model.get("slope") == pytest.approx(-2 * math.exp(-1), abs=1e-9)


def test_a_condition_chooses_the_derivative_from_its_event_on(compile_both):
    model = compile_both("""model M
  Boolean fast(start = false, fixed = true);
  output Real x(start = 0, fixed = true);
equation
  der(x) = if fast then 2 else 1;
  when {initial(), x > 0.03} then
    fast = x < 0.03;
  end when;
end M;""")
    model.initialize()
    values = []
    for k in range(4):
        model.step(k * 0.01)
        values.append(model.get("x"))
    assert values == pytest.approx([0.02, 0.035, 0.045, 0.055], abs=1e-9)


def test_for_equations_give_every_state_its_own_equation(compile_both):
    model = compile_both("""model Chain
  constant Integer n = 4;
  output Real chain[n](start = {1, 0, 0, 0});
  output Real grid[5, 3](each start = 1);
  output Real ramp[n];
equation
  der(chain[1]) = -chain[1];
  for i in 2:n loop
    der(chain[i]) = chain[i - 1] - chain[i];
  end for;
  for i in 1:5, j in 1:3 loop
    der(grid[6 - i, j]) = -0.1*i*j*grid[6 - i, j];
  end for;
  for i in n:-1:1 loop
    der(ramp[i]) = i;
  end for;
end Chain;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("chain") == pytest.approx(
        [math.exp(-1) / math.factorial(k) for k in range(4)], abs=1e-9
    )
    assert model.get("ramp") == pytest.approx([1, 2, 3, 4], abs=1e-12)
    rates = -0.1 * np.outer(range(5, 0, -1), range(1, 4))
    assert model.get("grid") == pytest.approx(np.exp(rates), abs=1e-9)


def test_an_initial_equation_sets_a_state_from_a_parameter(compile_both):
    model = compile_both(PLANT)
    model.set(w=5.0)
    model.initialize()
    assert model.python.get("s") == 2.5
    assert model.python.get("der(s)") == -12.5


@pytest.mark.parametrize("ticks_per_step", [1, 2, 5])
def test_ticks_inside_a_step_are_executed_at_their_time(compile_both, ticks_per_step):
    model = compile_both(SAMPLED_LOOP)
    model.initialize()
    decay, speed, force = math.exp(-0.5 * 0.01), 0.0, 0.0
    for k in range(100 // ticks_per_step):
        model.step(k * ticks_per_step * 0.01, ticks_per_step * 0.01)
        for _ in range(ticks_per_step):
            force += 0.2 * (1 - speed)
            speed = decay * speed + (1 - decay) / 0.5 * force
        assert (model.get("speed"), model.get("force")) == pytest.approx((speed, force), abs=1e-11)


def test_two_sample_rates_in_a_model_with_a_state(compile_both):
    model = compile_both("""model M
  output Real x(start = 0, fixed = true);
  output Real fast(start = 0, fixed = true);
  output Real slow(start = 0, fixed = true);
equation
  der(x) = fast + slow;
  when sample(0, 0.01) then
    fast = pre(fast) + 1;
  end when;
  when sample(0.005, 0.02) then
    slow = x;
  end when;
end M;""")
    model.initialize()
    x = fast = slow = 0.0
    for k in range(200):  # steps of 5 ms: fast ticks in every second one, slow in every fourth
        fast += k % 2 == 0
        slow = x if k % 4 == 1 else slow
        x += 0.005 * (fast + slow)
        if k % 4 == 3:
            model.step((k - 3) * 0.005, 0.02)
            assert (model.get("x"), model.get("fast"), model.get("slow")) == pytest.approx(
                (x, fast, slow), rel=1e-12
            )


def test_an_unused_clock_has_no_effect(compile_both):
    model = compile_both("""model M
  output Real x(start = 1, fixed = true);
equation
  der(x) = -x;
  when sample(0, 0.003) then
  end when;
end M;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("x") == pytest.approx(math.exp(-1), abs=1e-10)


def test_shorter_steps_execute_the_same_ticks(compile_both):
    model = compile_both(SAMPLED_LOOP)
    results = []
    for h in (0.0025, 0.01):
        model.initialize()
        for k in range(round(1 / h)):
            model.step(k * h, h)
        results.append([model.get(name) for name in ("speed", "force", "way")])
    assert results[0] == pytest.approx(results[1], abs=1e-11)


def test_outputs_of_a_model_with_states_are_continuous(compile_both):
    variables = compile_both(PLANT).c.variables
    assert [variables[name].variability for name in ("q", "a", "ticks")] == [
        "continuous",
        "continuous",
        "discrete",
    ]
    assert {v.causality for name, v in variables.items() if name.startswith("der(")} <= {"local"}


def test_only_models_with_states_contain_the_integrator(write_model):
    sampled = write_model("""model M
  output Real y;
equation
  y = time;
end M;""")
    assert "runge_kutta.h" not in load_block(sampled).files
    assert "runge_kutta.h" in load_block(write_model(PENDULUM)).files


def test_a_state_that_becomes_infinite_is_a_failure(compile_both):
    model = compile_both("""model M
  input Real u;
  Real x(start = 1, fixed = true);
  output Real y;
equation
  der(x) = x^2*1e3;
  y = min(u, 1);
end M;""")
    model.initialize()
    assert model.c.step(0.0, 0.1) == "x is not a finite number"
    with pytest.raises(ComponentError, match="x is not a finite number"):
        model.python.step(0.0, 0.1)


def test_a_failure_in_a_runge_kutta_stage_is_reported_with_its_reason(compile_both):
    model = compile_both("""model M
  parameter Integer n = 0;
  output Real x(start = 0, fixed = true);
  Integer k;
equation
  k = if time > 0.004 then div(10, n) else 1;
  der(x) = k;
end M;""")
    model.initialize()
    assert model.c.step(0.0, 0.01) == "division by zero in div(), mod() or rem()"
    with pytest.raises(ComponentError, match="division by zero"):
        model.python.step(0.0, 0.01)


def test_parameters_of_the_start_time_are_known_at_the_initialization(compile_both):
    """Also parameters that depend on them; `terminal()` is never true."""
    model = compile_both("""model Mean
  input Real u;
  output Real y;
  output Integer n(start = 0, fixed = true);
protected
  parameter Real t0(fixed = false);
  parameter Real begin = t0 + 0.5;
  Real x(start = 0, fixed = true);
initial equation
  t0 = time;
equation
  der(x) = if time >= begin then u else 0;
  y = x;
  when {u > 2, terminal()} then
    n = pre(n) + 1;
  end when;
end Mean;""")
    model.initialize(3.0)
    model.set(u=1.0)
    for k in range(100):
        model.step(3 + k * 0.01)
    assert model.get("y") == pytest.approx(0.5, abs=1e-8)
    assert model.get("n") == 0
