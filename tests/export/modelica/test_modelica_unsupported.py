"""Unsupported features are refused with file, line and reason; they are never ignored."""

from __future__ import annotations

import pytest

from cosim.core.errors import InputError
from cosim.export.modelica import load_block

CASES = {
    "implicit der": ("Real x;", "2*der(x) = u;\n  y = x;", r"M.mo:8: this equation defines no variable: .* or der\(\) of one"),
    "two der": (
        "Real x;\n  Real z;",
        "der(x) + der(z) = u;\n  der(z) = x;\n  y = x;",
        "M.mo:9: this equation defines no variable",
    ),
    "der in a loop": (
        "Real x;\n  Real a;",
        "der(x) = a;\n  a = u - der(x);\n  y = x;",
        r"M.mo:9: algebraic loop: der\(x\) \(M.mo:9\) -> a \(M.mo:10\) -> der\(x\)",
    ),
    "der of an expression": ("Real x;", "der(2*x) = u;\n  y = x;", r"M.mo: .*der\(...\) must have exactly one resolved variable"),
    "der of an input": ("", "y = der(u);", r"M.mo:8: der\(...\) must name a coordinate classified as a continuous state"),
    "der of an Integer": ("Integer n;", "n = 1;\n  y = der(n);", "M.mo:9: .*n"),
    "index reduction": ("Real x;", "x = sin(time);\n  y = der(x);", "M.mo:8: this equation defines no variable"),
    "parameter of a variable": (
        "parameter Real p = u;",
        "y = p;",
        "M.mo:6: the parameter p depends on u, which is not a parameter",
    ),
    "a state in an algorithm": (
        "Real x;",
        "der(x) = 1;\nalgorithm\n  x := u;\n  y := x;\nequation",
        "assignment target `x` is not a whole writable coordinate",
    ),
    "steady start": (
        "Real x;",
        "der(x) = u - x;\n  y = x;\ninitial equation\n  der(x) = 0;\nequation",
        "M.mo:11: one side of an initial equation must be a continuous state, or a variable",
    ),
    "loop": (
        "Real a;\n  Real b;",
        "a = b + u;\n  b = 2*a;\n  y = a;",
        r"M.mo:9: algebraic loop: a \(M.mo:9\) -> b \(M.mo:10\) -> a",
    ),
    "loop of one": (
        "Real a;",
        "a = sin(a) + u;\n  y = a;",
        r"M.mo:8: algebraic loop: a \(M.mo:8\) -> a .*; break it with pre\(\)",
    ),
    "implicit": (
        "Real a;",
        "a + u = 2*a;\n  y = a;",
        "M.mo:8: this equation defines no variable: one side must be a variable",
    ),
    "structural if": (
        "parameter Integer n = 2;",
        "if n == 1 then\n    y = u;\n  elseif n == 2 then\n    y = 2*u;\n  else\n    y = 3;\n  end if;",
        "M.mo:8: the parameter n cannot be settable: it selects equations .*declare it final or constant",
    ),
    "structural size": (
        "parameter Integer n = 2;\n  parameter Integer m = n + 1;\n  Real v[m];",
        "for i in 1:m loop\n    v[i] = u;\n  end for;\n  y = v[1];",
        "M.mo:8: the parameter n cannot be settable: it determines the size of an array",
    ),
    "slice": (
        "parameter Integer n = 2;\n  Real v[3];",
        "v = {u, u, u};\n  y = sum(v[1:n]);",
        "M.mo:10: the bounds of a range must be",
    ),
    "pre outside when": (
        "Boolean a;\n  Boolean b;",
        "a = u > 0;\n  b = pre(a);\n  y = if b then 1 else 0;",
        r"pre\(a\) outside a when",
    ),
    "warning": (
        "",
        'y = u;\n  assert(u > 0, "low", AssertionLevel.warning);',
        "M.mo:9: assert.. with a level other than AssertionLevel.error",
    ),
    "text": ('parameter String name = "x";', "y = u;", "M.mo:6: name: variables of type String are not supported"),
    "message": ('parameter String name = "x";', "y = u;\n  assert(u > 0, name);", "M.mo:9: the message of an assert.. must be a"),
    "text of a number": (
        "",
        'y = u;\n  assert(u > 0, "u is " + String(u));',
        "M.mo:9: the expression StringConversion is not supported",
    ),
    "no elements": ("Real v[0];", "y = u;", "M.mo:6: v: arrays without elements are not supported"),
    "delay": ("", "y = delay(u, 0.1);", r"M.mo:8: delay\(\) is not supported"),
    "unknown name": ("", "y = u + speeed;", "M.mo:8: unresolved component reference: 'speeed'"),
    "too few equations": ("Real a;", "y = u;", "unbalanced model"),
    "sample as a value": (
        "Boolean b;",
        "b = sample(0, 0.1);\n  y = if b then 1 else 0;",
        r"M.mo:8: sample\(\) is not supported here",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_an_unsupported_feature_is_refused_with_file_and_line(write_model, case):
    declarations, equations, message = CASES[case]
    path = write_model(f"""model M
  input Real u;
  output Real y;
  Real unused;

  {declarations}
equation
  {equations}
  unused = 0;
  when sample(0, 0.01) then
  end when;
end M;""")
    with pytest.raises(InputError, match=message):
        load_block(path)


@pytest.mark.parametrize(
    ("when", "message"),
    [
        ("sample(0, u)", "sample interval is not parameter-evaluable"),
        ("sample(0, 0.1) and u > 1", r"sample\(\) cannot be combined with other conditions"),
        ("edge(b)", "in a when-condition are not supported"),
    ],
)
def test_an_unsupported_when_condition_is_refused(write_model, when, message):
    path = write_model(f"""model M
  input Real u;
  output Real y;
  Boolean b;
equation
  b = u > 0;
  when {when} then
    y = u;
  end when;
end M;""")
    with pytest.raises(InputError, match=message):
        load_block(path)


def test_a_recursive_function_is_refused(write_model):
    path = write_model("""model M
  function f
    input Real x;
    output Real y;
  algorithm
    y := if x > 1 then f(x - 1) else x;
  end f;
  input Real u;
  output Real y;
equation
  y = f(u);
end M;""")
    with pytest.raises(InputError, match="recursive function"):
        load_block(path)


def test_a_for_equation_that_does_not_fit_its_placeholders_is_refused(write_model):
    from cosim.export.modelica.frontend.reader import ModelReader
    from cosim.export.modelica.frontend.rumoca_frontend import flatten_model

    path = write_model("""model M
  output Real x[4];
equation
  for i in 1:3 loop
    der(x[i]) = i;
  end for;
  der(x[4]) = 0;
end M;""")
    json, sources = flatten_model(path, None)
    json["structured_equations"][0]["first_equation_index"] = 1
    with pytest.raises(InputError, match=r"M.mo:\d: this for-equation was not unrolled by the front end"):
        ModelReader(json, sources).read_model("M")


def test_unknown_elements_of_the_front_ends_json_are_refused():
    from cosim.export.modelica.frontend.reader import ModelReader
    from cosim.export.modelica.frontend.rumoca_frontend import ModelicaSources

    reader = ModelReader({"enum_literal_ordinals": {}}, ModelicaSources([]))
    with pytest.raises(InputError, match="the expression Quantum is not supported"):
        reader.read_expression({"Quantum": {}})
    with pytest.raises(InputError, match="the statement Goto is not supported"):
        reader.read_body([{"Goto": {}}])
