"""Valid Modelica models that rumoca's own code generator silently miscompiles; cosim must translate
or refuse them.
"""

from __future__ import annotations

import pytest

from cosim.core.errors import InputError
from cosim.export.modelica import load_block

TICKS = 500


def test_a_discrete_equation_uses_the_condition_of_the_same_tick(compile_both):
    model = compile_both("""model M
  input Real x;
  output Boolean b(start = false, fixed = true);
  output Integer k(start = 0, fixed = true);
equation
  when sample(0, 0.01) then
    k = if b then pre(k) + 1 else pre(k);
    b = x > 1;
  end when;
end M;""")
    model.initialize()
    count = 0
    for _, inputs in model.run(TICKS):
        count += inputs["x"] > 1
        assert model.get("k") == count


def test_a_parameter_in_the_condition_of_an_if_expression_is_not_folded(compile_both):
    model = compile_both("""model M
  parameter Boolean hold = false;
  parameter Real level = 1;
  input Real x;
  output Real y(start = 0, fixed = true);
  output Real z(start = 0, fixed = true);
equation
  when sample(0, 0.01) then
    y = if hold then pre(y) + x else x;
  end when;
algorithm
  when sample(0, 0.01) then
    if level > 2 then
      z := pre(z) + x;
    else
      z := 2*x;
    end if;
  end when;
end M;""")
    model.set(hold=True, level=3.0)
    model.initialize()
    total = 0.0
    for _, inputs in model.run(TICKS):
        total += inputs["x"]
        assert (model.get("y"), model.get("z")) == (total, total)


FOLDED = """model M
  parameter Boolean hold = false;
  input Real x;
  output Real y(start = 0, fixed = true);
equation
  when sample(0, 0.01) then
    {}
  end when;
end M;"""


@pytest.mark.parametrize(
    "equations",
    [
        "if hold then y = pre(y) + x; else y = x; end if;",
        "if hold and x > 0 then y = 1; else y = x; end if;",
        "if x > 0 then if not hold then y = x; else y = pre(y); end if; else y = 0; end if;",
        'y = x; if hold then assert(x < 1, "large"); end if;',
    ],
)
def test_a_parameter_that_selects_the_branch_of_an_if_equation_is_a_constant_of_the_fmu(
    write_model, equations
):
    variables = {
        variable.name: variable
        for variable in load_block(write_model(FOLDED.format(equations))).variables
    }
    assert (variables["hold"].causality, variables["hold"].variability) == ("local", "constant")


@pytest.mark.parametrize(
    "equations",
    [
        "if hold or x > 0 then y = pre(y) + x; else y = x; end if;",
        (
            "if x > (if x > 2 then 1 else 0) then y = if hold then 1 else 2; else y = x; end if; "
            "// if hold then"
        ),
    ],
)
def test_other_if_equations_on_parameters_are_accepted(write_model, equations):
    assert load_block(write_model(FOLDED.format(equations))).identifier == "M"


NESTED = """model M
  parameter Boolean p = true;
  parameter Boolean q = true;
  parameter Boolean r = true;
  input Real u;
  output Real y;
equation
  {}
end M;"""
LOOP = 'for i in 1:2 loop if {} then assert(u < i, "large"); end if; end for;'
IN_WHEN = "when sample(0, 0.01) then {} y = u; end when;"


@pytest.mark.parametrize(
    ("equations", "constant"),
    [
        (IN_WHEN.format(LOOP.format("p")), {"p"}),
        (IN_WHEN.format("if u > 1 and q then " + LOOP.format("p") + " end if;"), {"p"}),
        (IN_WHEN.format("if u > 1 and q then " + LOOP.format("u > 2 and p") + " end if;"), set()),
        (
            'for i in 1:2 loop when sample(0, 0.01) then if p then assert(u < i, "large"); '
            "end if; end when; end for; " + IN_WHEN.format(""),
            {"p"},
        ),
        (
            "if r then "
            + IN_WHEN.format('if u > 2 and p then assert(u < 3, ""); end if;')
            + " end if;",
            {"r"},
        ),
    ],
    ids=["loop", "loop in a branch", "nothing folded in a loop", "clause in a loop", "outside"],
)
def test_only_the_parameter_of_a_folded_condition_is_a_constant_also_in_nested_equations(
    write_model, equations, constant
):
    variables = load_block(write_model(NESTED.format(equations))).variables
    assert {v.name for v in variables if v.variability == "constant"} == constant


def test_an_if_equation_on_a_constant_may_be_folded(compile_both):
    text = FOLDED.replace("parameter Boolean hold = false", "constant Boolean hold = true")
    model = compile_both(text.format("if hold then y = 2*x; else y = x; end if;"))
    model.set(x=3.0)
    model.initialize()
    model.step(0.0)
    assert model.get("y") == 6.0


def test_the_last_of_two_assignments_determines_the_value(compile_both):
    model = compile_both("""model M
  input Real x;
  output Integer k(start = 0, fixed = true);
  output Boolean b(start = false, fixed = true);
algorithm
  when sample(0, 0.01) then
    k := 1;
    b := false;
    if x > 0 then
      k := 2;
      b := true;
    end if;
    k := k + 10;
  end when;
end M;""")
    model.initialize()
    for _, inputs in model.run(TICKS):
        assert (model.get("k"), model.get("b")) == (12 if inputs["x"] > 0 else 11, inputs["x"] > 0)


def test_declared_limits_are_described_and_do_not_saturate(compile_both):
    model = compile_both("""model M
  parameter Real gain(min = 0, max = 1) = 0.5;
  input Real x(min = -1, max = 1);
  output Real y(min = -2, max = 2);
equation
  when sample(0, 0.01) then
    y = gain*x;
  end when;
end M;""")
    model.set(gain=10.0, x=7.0)
    model.initialize()
    model.step(0.0)
    assert model.get("y") == 70.0
    described = model.c.variables["y"]
    assert (described.minimum, described.maximum) == (-2.0, 2.0)


def test_functions_of_the_same_short_name_are_refused_because_the_front_end_confuses_them(
    write_model,
):
    path = write_model("""package A
  function f
    input Real x;
    output Real y;
  algorithm
    y := x + 1;
  end f;
  block B
    input Real u;
    output Real y;
  equation
    y = f(u);
  end B;
end A;
package C
  function f
    input Real x;
    output Real y;
  algorithm
    y := x + 2;
  end f;
  block B
    input Real u;
    output Real y;
  equation
    y = f(u);
  end B;
end C;
model M
  input Real u;
  output Real y;
  A.B a;
  C.B c;
equation
  a.u = u;
  c.u = u;
  y = a.y + c.y;
end M;""")
    with pytest.raises(InputError, match='several functions named "f"; give them different names'):
        load_block(path)
