"""Equations in any form: algebraic loops, implicit equations, initial equations and derivatives of
dependent variables.
"""

from __future__ import annotations

import math

import pytest

from cosim.core.errors import ComponentError, InputError
from cosim.export.modelica import load_block


def test_a_linear_algebraic_loop_is_solved(compile_both):
    model = compile_both("""model Loop
  input Real u;
  parameter Real k = 2;
  output Real y;
  Real e;
equation
  e = u - y;
  y = k*e;
end Loop;""")
    model.initialize()
    for _, inputs in model.run(50):
        assert model.get("y") == pytest.approx(2 / 3 * inputs["u"], rel=1e-12)


def test_equations_between_joined_arrays_are_split_into_their_elements(compile_both):
    model = compile_both("""model Joined
  input Real u[3];
  output Real first[2], last;
equation
  [u] = [first; last];
end Joined;""")
    model.initialize()
    for _, inputs in model.run(20):
        assert [*model.get("first"), model.get("last")] == list(inputs["u"])


@pytest.mark.parametrize(
    ("equation", "start", "solution"),
    [
        ("exp(y) + y = 1e4*u", 5.0, 9.209419005748),  # a full first step leads to exp(71)
        ("atan(y) = 0.1*u", 20.0, math.tan(0.1)),  # full steps diverge
        ("sqrt(y) = 0.2*u", 4.0, 0.04),  # full steps leave the domain
    ],
)
def test_steps_that_increase_the_residual_are_shortened(compile_both, equation, start, solution):
    model = compile_both(f"""model Damped
  parameter Real u = 1;
  output Real y(start = {start});
equation
  {equation};
end Damped;""")
    model.initialize()
    assert model.get("y") == pytest.approx(solution, rel=1e-11)


def test_a_nonlinear_equation_is_solved_by_newtons_method(compile_both):
    model = compile_both("""model Kepler
  input Real m(min = 0, max = 6);
  output Real e;
equation
  m = e - 0.3*sin(e);
end Kepler;""")
    model.initialize()
    for _, inputs in model.run(50):
        e = model.get("e")
        assert e - 0.3 * math.sin(e) == pytest.approx(inputs["m"], abs=1e-12)


def test_a_system_without_a_solution_is_a_failure_with_its_line(compile_both):
    model = compile_both("""model None
  input Real u;
  output Real y;
equation
  y^2 + y*u + 1 = 0;
end None;""")
    assert model.c.initialize() == "a system of equations has no solution (None.mo:5)"
    with pytest.raises(
        ComponentError, match=r"a system of equations has no solution \(None.mo:5\)"
    ):
        model.python.initialize()


def test_an_implicit_derivative_and_a_loop_of_derivatives_are_solved(compile_both):
    model = compile_both("""model Implicit
  output Real x(start = 1, fixed = true);
  output Real z(start = 0, fixed = true);
equation
  2*der(x) + der(z) = -2*x;
  der(x) - der(z) = -x;
end Implicit;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("x") == pytest.approx(math.exp(-1), abs=1e-8)
    assert model.get("z") == pytest.approx(0, abs=1e-8)


def test_a_steady_state_start_solves_for_the_states(compile_both):
    model = compile_both("""model Steady
  input Real u;
  parameter Real T = 0.5;
  output Real x;
  output Real y(start = 1);
initial equation
  der(x) = 0;
  der(y) = 0;
equation
  T*der(x) = u - x;
  T*der(y) = x - y^3;
end Steady;""")
    model.set(u=8.0)
    model.initialize()
    assert (model.get("x"), model.get("y")) == (pytest.approx(8.0), pytest.approx(2.0))


def test_the_derivative_of_a_variable_that_equations_determine(compile_both):
    model = compile_both("""model Dependent
  output Real y;
  output Real z;
  Real s;
  Real x(start = 1, fixed = true);
  Real w;
equation
  s = sin(3*time);
  y = der(s);
  der(x) = -x;
  w = 2*x + time^2;
  z = der(w);
end Dependent;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("y") == pytest.approx(3 * math.cos(3), abs=1e-9)
    assert model.get("z") == pytest.approx(-2 * math.exp(-1) + 2, abs=1e-8)


def test_a_relation_in_an_algebraic_loop_is_consistent_after_the_event(compile_both):
    model = compile_both("""model Limited
  input Real u;
  output Real y;
  output Real x(start = 0, fixed = true);
equation
  der(x) = y - x;
  y = if u - 0.5*y > 1 then 1 else u - 0.5*y;
end Limited;""")
    model.initialize()
    for _, inputs in model.run(100):
        expected = min(1.0, inputs["u"] / 1.5)
        assert model.get("y") == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("equations", "message"),
    [
        (
            "x = u;\n  x = 2*u;\n  when u > 1 then\n  end when;",
            "the equations do not determine y, and this equation contradicts others",
        ),
        ("x = u;\n  sin(x) = u;\n  y = x;\n  z = der(u);", "superfluous|unbalanced|input"),
    ],
)
def test_singular_systems_are_refused_with_a_line(write_model, equations, message):
    path = write_model(f"""model M
  input Real u;
  output Real x;
  output Real y;
equation
  {equations}
end M;""")
    with pytest.raises(InputError, match=rf"M.mo.*({message}|unbalanced|unresolved)"):
        load_block(path)


def test_a_loop_without_a_unique_solution_is_a_failure(compile_both):
    model = compile_both("""model Singular
  input Real u;
  output Real x;
  output Real y;
equation
  x + y = u;
  2*x + 2*y = u;
end Singular;""")
    model.set(u=1.0)
    assert model.c.initialize() == "a system of equations has no solution (Singular.mo:6)"


def test_the_derivative_of_the_maximum_of_an_array_is_that_of_the_largest_element(compile_both):
    model = compile_both("""model Largest
  output Real y;
  output Real rate;
  Real x[3](start = {1, 2, 0}, each fixed = true);
equation
  der(x) = {1, -1, 0.1};
  y = max(2*x);
  rate = der(y);
end Largest;""")
    model.initialize()
    for k in range(100):
        model.step(k * 0.01)
        time = (k + 1) * 0.01
        assert model.get("y") == pytest.approx(2 * max(1 + time, 2 - time), abs=1e-9)
        if abs(time - 0.5) > 1e-6:
            assert model.get("rate") == (2 if time > 0.5 else -2)


def test_homotopy_leads_from_the_solution_of_the_simplified_equation_to_the_actual_one(
    compile_both,
):
    """Newton's method alone finds the root -2 of x^2 = 4 from the start value -3."""
    model = compile_both("""model Root
  input Real u;
  output Real x(start = -3);
equation
  0 = homotopy(x*x - 4 - u, x - 3);
end Root;""")
    model.initialize()
    assert model.get("x") == pytest.approx(2, rel=1e-12)
    model.set(u=5.0)
    model.step(0.0)
    assert model.get("x") == pytest.approx(3, rel=1e-12)


def test_a_steady_state_start_follows_homotopy(compile_both):
    """The state balances atan(8 (x - 3)) + x/10 = 0; at the start value 0 the arc tangent is nearly
    constant.
    """
    model = compile_both("""model Steady
  Real x(start = 0);
  output Real y;
initial equation
  der(x) = 0;
equation
  der(x) = -homotopy(atan(8*(x - 3)) + 0.1*x, x - 2);
  y = x;
end Steady;""")
    model.initialize()
    x = model.get("y")
    assert math.atan(8 * (x - 3)) + 0.1 * x == pytest.approx(0, abs=1e-10)
    model.step(0.0)
    assert model.get("y") == pytest.approx(x, abs=1e-9)


def test_inertias_joined_by_a_gear_have_one_degree_of_freedom(compile_both):
    """A torque on the first inertia (2 kg.m2) also accelerates the second one (3 kg.m2) behind a
    gear with the ratio 4.
    """
    model = compile_both("""model Gear
  input Real tau;
  output Real w;
  output Real phi(start = 0.5);
  Real behind, speed_behind, torque;
equation
  der(phi) = w;
  der(behind) = speed_behind;
  2*der(w) = tau - torque;
  3*der(speed_behind) = 4*torque;
  phi = 4*behind;
end Gear;""")
    model.initialize()
    model.set(tau=1.0)
    for k in range(100):
        model.step(k * 0.01)
    assert model.get("w") == pytest.approx(1 / (2 + 3 / 16), rel=1e-12)


def test_a_nonlinear_constraint_between_states_is_refused_by_their_names(write_model):
    path = write_model("""model Pendulum
  output Real x(start = 1), y(start = 0);
  Real vx, vy, f;
equation
  der(x) = vx;
  der(y) = vy;
  der(vx) = f*x;
  der(vy) = f*y - 9.81;
  x^2 + y^2 = 1;
end Pendulum;""")
    with pytest.raises(
        InputError,
        match=r"Pendulum.mo:9: this equation relates the states x, y, and it is not linear in x",
    ):
        load_block(path)


def test_the_derivative_of_an_input_is_refused_by_its_name(write_model):
    path = write_model(
        "block M\n  input Real u;\n  output Real y;\n  Real x = 2*u;\nequation\n  y = der(x);\nend "
        "M;"
    )
    with pytest.raises(
        InputError, match=r"M.mo:2: the derivative of the input u is needed; filter the input"
    ):
        load_block(path)


def test_a_division_by_a_constant_of_zero_is_not_simplified_to_zero(compile_both):
    """The solution of y + y/0 = u for y divides zero by zero: the step fails, y is not zero."""
    model = compile_both("""model M
  constant Real k = 0;
  input Real u;
  output Real y;
equation
  y + y/k = u;
end M;""")
    model.set(u=1.0)
    assert model.c.step(0.0, 0.01) == "y is not a finite number"
    with pytest.raises(ComponentError, match="y is not a finite number"):
        model.python.step(0.0, 0.01)
