"""Unsupported features are refused with file, line and reason; they are never ignored."""

from __future__ import annotations

import pytest

from cosim.core.errors import InputError
from cosim.export.modelica import load_block

CASES = {
    "der of an expression": (
        "Real x;",
        "der(2*x) = u;\n  y = x;",
        r"M.mo:8: der\(...\) must have exactly one resolved variable",
    ),
    "der of an input": (
        "",
        "y = der(u);",
        r"M.mo:8: der\(\) needs a variable with a derivative: inputs",
    ),
    "der of an Integer": ("Integer n;", "n = 1;\n  y = der(n);", "M.mo:9: .*n"),
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
    "slice": (
        "parameter Integer n = 2;\n  Real v[3];",
        "v = {u, u, u};\n  y = sum(v[1:n]);",
        "M.mo:10: the bounds of a range must be",
    ),
    "text": (
        "String name;",
        'name = "x";\n  y = u;',
        "M.mo:6: name: variables of type String are not supported",
    ),
    "unknown name": ("", "y = u + speeed;", "M.mo:8: unresolved component reference: 'speeed'"),
    "too few equations": ("Real a;", "y = u;", "unbalanced model"),
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
    with pytest.raises(
        InputError, match=r"M.mo:\d: this for-equation was not unrolled by the front end"
    ):
        ModelReader(json, sources).read_model("M")


def test_unknown_elements_of_the_front_ends_json_are_refused():
    from cosim.export.modelica.frontend.model_files import ModelicaSources
    from cosim.export.modelica.frontend.reader import ModelReader

    reader = ModelReader({"enum_literal_ordinals": {}}, ModelicaSources([]))
    with pytest.raises(InputError, match="the expression Quantum is not supported"):
        reader.read_expression({"Quantum": {}})
    with pytest.raises(InputError, match="the statement Goto is not supported"):
        reader.read_body([{"Goto": {}}])
