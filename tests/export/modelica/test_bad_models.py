"""Bad models end in one line each, with file, line and reason; no error of the front end or of this
compiler has a traceback.
"""

from __future__ import annotations

import re

import pytest
from modelica_interpreter import Interpreter, load_interpreter

from cosim.core.errors import ComponentError, InputError
from cosim.export.fmu.variable_table import check_block
from cosim.export.modelica import load_block


def in_model(declarations: str, equations: str = "y = u;") -> str:
    """Return the text of a model with one input and one output."""
    return (
        f"model M\n  input Real u;\n  output Real y;\n  {declarations}\nequation\n  {equations}\n"
        "end M;\n"
    )


#: name -> text of the file, beginning of the message
BAD = {
    "missing semicolon": (in_model("Real a"), "M.mo:4: unexpected `a`"),
    "missing end": ("model M\n  Real x;\nequation\n  x = 1;\n", "M.mo:5: unexpected end of input"),
    "wrong end name": (
        "model M\n  Real x;\nequation\n  x = 1;\nend N;\n",
        "M.mo:5: parse error: End name 'N' does not match class name 'M'",
    ),
    "unbalanced parenthesis": (in_model("", "y = (u + 1;"), "M.mo:6: unexpected `;`"),
    "missing operand": (in_model("", "y = u + ;"), "M.mo:6: unexpected `;`"),
    "assignment in equation": (in_model("", "y := u;"), "M.mo:6: unexpected `y`"),
    "equation in algorithm": (in_model("", "algorithm\n  y = u;"), "M.mo:7: unexpected `=`"),
    "keyword as name": (
        in_model("Real model;"),
        "M.mo:4: `model` is a reserved keyword in Modelica (MLS §2.3.3) and cannot be used as",
    ),
    "keyword as member": (
        in_model("", "y = u.model;"),
        (
            "M.mo:6: `model` is a reserved keyword in Modelica (MLS §2.3.3) and cannot be used as "
            "an id"
        ),
    ),
    "missing semicolon before a class": (
        in_model("partial model B\n  end B;\n  extends B\n  model A\n  end A;"),
        "M.mo:7: unexpected `model`",
    ),
    "unterminated string": (in_model('parameter String s = "abc;'), 'M.mo:4: unexpected `"`'),
    "unterminated comment": (in_model("/* comment"), "M.mo:4: unexpected `/`"),
    "bad number": (in_model("", "y = 1.2.3;"), "M.mo:6: unexpected `.3`"),
    "missing then": (in_model("", "y = if u > 0 1 else 2;"), "M.mo:6: unexpected `1`"),
    "missing else": (in_model("", "y = if u > 0 then 1;"), "M.mo:6: unexpected `;`"),
    "unknown character": (in_model("", "y = u ? 1;"), "M.mo:6: unexpected `?`"),
    "empty file": ("", "M.mo:1: the file contains no model with the name M"),
    "only a comment": ("// nothing\n", "M.mo:1: the file contains no model with the name M"),
    "not Modelica": ("int main(void) { return 0; }\n", "M.mo:1: unexpected `int`"),
    "garbage bytes": ("model M\n  \x01\x02\nend M;\n", "M.mo:1: unexpected `M`"),
    "unknown variable": (
        in_model("", "y = u + speeed;"),
        "M.mo:6: unresolved component reference: 'speeed'",
    ),
    "unknown type": (in_model("Reel a;"), "M.mo:4: unresolved type reference: 'Reel'"),
    "unknown function": (in_model("", "y = sine(u);"), "M.mo:6: unresolved function call: 'sine'"),
    "unknown component member": (
        in_model("record R\n    Real a;\n  end R;\n  R r;", "r.a = u;\n  y = r.b;"),
        "M.mo:10: unresolved component reference: 'r.b'",
    ),
    "unknown base class": (
        in_model("extends Base;"),
        "M.mo:4: unresolved extends base class: 'Base'",
    ),
    "unknown modifier": (
        in_model("Real a(starrt = 1);", "a = u;\n  y = a;"),
        "M.mo:4: unknown modifier `starrt` for builtin component `a` of type",
    ),
    "unknown modified component": (
        in_model("model A\n    parameter Real k = 1;\n  end A;\n  A a(g = 2);"),
        "M.mo:7: unknown modifier `g` for component `a` of type `A`",
    ),
    "declared twice": (
        in_model("Real a;\n  Integer a;", "a = u;\n  y = a;"),
        "M.mo:5: parse error: Duplicate declaration of 'a' at line 5 (first",
    ),
    "unknown enumeration literal": (
        in_model("type E = enumeration(a, b);\n  parameter E e = E.c;"),
        "M.mo:5: unresolved component reference: 'E.c'",
    ),
    "unknown package": (
        in_model("import Missing.Package;"),
        "M.mo:4: unresolved import: 'Missing.Package'",
    ),
    "recursive class": (
        in_model("M inner_model;"),
        "M.mo:1: cyclic class instantiation detected: M () -> M (inner_model)",
    ),
    "other model name": (
        "model N\n  Real x;\nequation\n  x = 1;\nend N;\n",
        "M.mo:1: the file contains no model with the name M",
    ),
    "partial model": (
        "partial model M\n  input Real u;\n  output Real y;\n  \nequation\n  y = u;\nend M;\n",
        "M.mo:1: the model is partial",
    ),
    "a function as a model": (
        "function M\n  input Real u;\n  output Real y;\nalgorithm\n  y := u;\nend M;\n",
        "M.mo:1: the file contains no model with the name M",
    ),
    "a package as a model": (
        "package M\n  constant Real a = 1;\nend M;\n",
        "M.mo:1: the file contains no model with the name M",
    ),
    "Boolean plus Real": (
        in_model("", "y = u + true;"),
        "M.mo:6: operator `+` expects Real or Integer operand(s), found",
    ),
    "Real as a condition": (
        in_model("", "y = if u then 1 else 2;"),
        "M.mo:6: operator `if` expects Boolean operand(s), found `Real` (MLS",
    ),
    "String to Real": (
        in_model("", 'y = "text";'),
        "M.mo:6: type mismatch: expected `Real`, found `String`",
    ),
    "Real to Integer": (
        in_model("Integer n;", "n = u;\n  y = n;"),
        "M.mo:6: discrete-valued definition is not a discrete-time expressi",
    ),
    "Boolean to Real parameter": (
        in_model("parameter Real k = true;"),
        "M.mo:4: the type of the binding does not fit the declaration",
    ),
    "comparison of Strings": (
        in_model('parameter String s = "a";', "y = if s > u then 1 else 2;"),
        "M.mo:6: expression type mismatch: expected String, found Real",
    ),
    "and of Reals": (
        in_model("", "y = if u and u then 1 else 2;"),
        "M.mo:6: operator `and` expects Boolean operand(s), found `Real`",
    ),
    "not of a Real": (
        in_model("", "y = if not u then 1 else 2;"),
        "M.mo:6: operator `not` expects Boolean operand(s), found `Real`",
    ),
    "too many arguments": (
        in_model("", "y = sin(u, u);"),
        "M.mo:6: sin() expects 1 argument(s), found 2",
    ),
    "too few arguments": (
        in_model("", "y = atan2(u);"),
        "M.mo:6: atan2() expects 2 argument(s), found 1",
    ),
    "function with wrong argument type": (
        in_model(
            (
                "function f\n    input Boolean b;\n    output Real r;\n  algorithm\n    r := if b "
                "then 1 else 2;\n  end f;"
            ),
            "y = f(u);",
        ),
        "M.mo:11: type mismatch: expected `Boolean`, found `Real`",
    ),
    "function with missing argument": (
        in_model(
            (
                "function f\n    input Real a;\n    input Real b;\n    output Real r;\n  "
                "algorithm\n    r := a + b;\n  end f;"
            ),
            "y = f(u);",
        ),
        "M.mo:12: invalid call of function `f`: input `b` has no argument an",
    ),
    "array to scalar": (
        in_model("Real v[3];", "v = {1, 2, 3};\n  y = v;"),
        "M.mo:7: array dimension mismatch: expected `scalar`, found `[3]`",
    ),
    "sizes of a sum": (
        in_model("Real v[3];", "v = {1, 2} + {1, 2, 3};\n  y = u;"),
        "M.mo:6: expression shape mismatch: the sizes of the operands diffe",
    ),
    "sizes of an equation": (
        in_model("Real v[3];", "v = {1, 2};\n  y = u;"),
        "M.mo:6: array dimension mismatch: expected `[3]`, found `[2]`",
    ),
    "sizes of a product": (
        in_model("Real a[2, 3];\n  Real b[2, 2];", "a = ones(2, 3);\n  b = a * a;\n  y = u;"),
        "M.mo:7: expression shape mismatch: the sizes of the operands diffe",
    ),
    "subscript too large": (
        in_model("Real v[3];", "v = {1, 2, 3};\n  y = v[4];"),
        "M.mo:7: subscript 4 for `v` is out of bounds for dimension of size",
    ),
    "subscript zero": (
        in_model("Real v[3];", "v = {1, 2, 3};\n  y = v[0];"),
        "M.mo:7: subscript 0 for `v` is out of bounds for dimension of size",
    ),
    "loop beyond the size": (
        in_model("Real v[3];", "for i in 1:4 loop\n    v[i] = i*u;\n  end for;\n  y = v[1];"),
        "M.mo:6: subscript 4 for `v` is out of bounds for dimension of size 3",
    ),
    "loop beyond the size of a component": (
        in_model(
            "parameter Integer n = 2;\n  connector C\n    Real w[2];\n  end C;\n  C c[n];",
            "y = c[1].w[1];\n  for i in 1:n, j in 1:3 loop\n    c[i].w[j] = u;\n  end for;",
        ),
        "M.mo:6: subscript 3 for `c.w` is out of bounds for dimension of size 2",
    ),
    "loop beyond the size of a column": (
        in_model(
            "Real v[3, 2];",
            (
                "y = v[1, 1];\n  for i in 1:3 loop\n    for j in 1:3 loop\n      v[i, j] = u;\n    "
                "end for;\n  end for;"
            ),
        ),
        "M.mo:7: subscript 3 for `v` is out of bounds for dimension of size 2",
    ),
    "loop of an algorithm beyond the size": (
        in_model(
            "Real v[3];", "y = v[1];\nalgorithm\n  for i in 1:4 loop\n    v[i] := i*u;\n  end for;"
        ),
        "M.mo:8: the range of a loop in an algorithm differs from the",
    ),
    "Real subscript": (
        in_model("Real v[3];", "v = {1, 2, 3};\n  y = v[u];"),
        "M.mo:7: invalid array subscript",
    ),
    "shape in the last statement of an algorithm": (
        in_model("Real z;", "y = z;\nalgorithm\n  z := u;\n  z := z + {1, 2};"),
        "M.mo:9: expression shape mismatch",
    ),
    "shape in a function that a function calls": (
        in_model(
            "function f\n    input Real a;\n    output Real r;\n  algorithm\n    r := g(a);\n  "
            "end f;\n"
            "  function g\n    input Real a;\n    output Real r;\n  protected\n    Real c[2];\n  "
            "algorithm\n"
            "    c := {a, 2};\n    r := c*{1, 2, 3};\n  end g;",
            "y = f(u);",
        ),
        "M.mo:17: expression shape mismatch",
    ),
    "loop in the second algorithm": (
        in_model(
            "discrete Real a(start = 0);\n  discrete Real z[3](each start = 0);",
            "y = z[1] + a;\nalgorithm\n  when sample(0, 0.1) then\n    a := pre(a) + u;\n  end "
            "when;\nalgorithm\n"
            "  when sample(0, 0.1) then\n    for i in 1:3 loop\n      z[i] := z[i] + u;\n    end "
            "for;\n  end when;",
        ),
        "M.mo:15: unsupported model algorithm",
    ),
    "too many subscripts": (
        in_model("Real v[3];", "v = {1, 2, 3};\n  y = v[1, 2];"),
        "M.mo:7: `v` has 1 dimension(s) but is subscripted with 2",
    ),
    "subscript of a scalar": (
        in_model("", "y = u[1];"),
        "M.mo:6: `u` has 0 dimension(s) but is subscripted with 1",
    ),
    "size depends on an input": (
        in_model("Real v[integer(u)];"),
        "M.mo:4: unresolved component dimension for v: integer(u)",
    ),
    "negative size": (
        in_model("parameter Integer n = -1;\n  Real v[n];"),
        "M.mo:5: invalid array dimensions for 'v': dimension expression",
    ),
    "huge array": (
        in_model("Real v[2000, 2000];", "v = ones(2000, 2000);\n  y = u;"),
        "M.mo:4: v: the model has more than 1000000 values",
    ),
    "ragged matrix": (
        in_model("parameter Real a[2, 2] = [1, 2; 3];"),
        "M.mo:6: expression shape mismatch: the sizes of the operands diffe",
    ),
    "unit without text": (
        in_model("Real a(unit = 3);", "a = u;\n  y = a;"),
        "M.mo:4: modifier `unit` for builtin component `a` of type `Real`",
    ),
    "too few equations": (
        in_model("Real a;"),
        (
            "M.mo:4: unbalanced model: 1 equations, 2 unknowns (balance = -1): no equation "
            "determines a"
        ),
    ),
    "too many equations": (
        in_model("", "y = u;\n  y = 2*u;"),
        (
            "M.mo:7: unbalanced model: 2 equations, 1 unknowns (balance = 1): this equation is one "
            "too many, the others determine y"
        ),
    ),
    "singular: variable in no equation": (
        in_model("Real a;\n  Real b;", "a = u;\n  a = y;\n  y = 1;"),
        "M.mo:9: the equations do not determine b, and this equation",
    ),
    "input is defined": (
        in_model("", "u = 1;\n  y = 2;"),
        "M.mo:6: unbalanced model: 2 equations, 1 unknowns (balance = 1)",
    ),
    "parameter is defined": (
        in_model("parameter Real k;", "k = 2*u;\n  y = u;"),
        "M.mo:6: unbalanced model: 2 equations, 1 unknowns (balance = 1)",
    ),
    "constant is defined": (
        in_model("constant Real k = 1;", "k = u;\n  y = u;"),
        "M.mo:6: unbalanced model: 2 equations, 1 unknowns (balance = 1)",
    ),
    "constraint between states": (
        in_model(
            "Real a(start=1);\n  Real b;", "der(a) = u;\n  der(b) = u;\n  a + b = 1;\n  y = a;"
        ),
        (
            "M.mo:9: unbalanced model: 4 equations, 3 unknowns (balance = 1): this equation is one "
            "too many"
        ),
    ),
    "dependent parameters in a circle": (
        in_model("parameter Real a = b;\n  parameter Real b = a;"),
        "M.mo:4: cyclic dependency in parameter binding for 'a' (MLS \u00a77.2.3)",
    ),
    "parameter of a variable": (
        in_model("parameter Real k = u;"),
        "M.mo:4: the parameter k depends on u, which is not a parameter",
    ),
    "assigned in two algorithms": (
        in_model("", "algorithm\n  y := u;\nalgorithm\n  y := 2*u;"),
        "M.mo:7: unbalanced model: 2 equations, 1 unknowns (balance = 1)",
    ),
    "assigned in two whens": (
        in_model(
            "discrete Real d;",
            (
                "when u > 0 then\n    d = 1;\n  end when;\n  when u < 0 then\n    d = 2;\n  end "
                "when;\n  y = d;"
            ),
        ),
        "M.mo:6: duplicate discrete Real when owner definition for identity",
    ),
    "a Boolean loop": (
        in_model("Boolean a;\n  Boolean b;", "a = not b;\n  b = a;\n  y = if a then 1 else 0;"),
        "M.mo:7: invalid Appendix B discrete solved form: `a` participates ",
    ),
    "an Integer loop": (
        in_model("Integer a;\n  Integer b;", "a = b + 1;\n  b = 2*a;\n  y = a;"),
        "M.mo:7: invalid Appendix B discrete solved form: `a` participates ",
    ),
    "sizes in a condition inside a branch": (
        in_model(
            "Boolean b;",
            "y = u;\nalgorithm\n  if u > 0 then\n    b := u > 1;\n"
            "    b := fill(u, 2)*fill(u, 3) > 0;\n  else\n    b := false;\n  end if;",
        ),
        "M.mo:10: expression shape mismatch: the sizes of the operands differ",
    ),
    "different variables in branches": (
        in_model(
            "Real a;\n  Real b;",
            "if u > 0 then\n    a = 1;\n  else\n    b = 1;\n  end if;\n  y = a;",
        ),
        (
            "M.mo:4: unbalanced model: 2 equations, 3 unknowns (balance = -1): no equation "
            "determines a"
        ),
    ),
    "if-equation without else": (
        in_model("", "if u > 0 then\n    y = 1;\n  end if;"),
        "M.mo:6: unsupported equation form: if-equation branches have misma",
    ),
    "der of an expression": (
        in_model("Real x;", "der(2*x) = u;\n  y = x;"),
        "M.mo:6: der(...) must have exactly one resolved variable-reference",
    ),
    "der of an Integer": (
        in_model("Integer n;", "n = 1;\n  y = der(n);"),
        "M.mo:7: der() argument must have type `Real`, found `Integer`",
    ),
    "der of an input": (
        in_model("", "y = der(u);"),
        "M.mo:6: der() needs a variable with a derivative: inputs, ",
    ),
    "pre of a continuous variable": (
        in_model("Real x;", "der(x) = u;\n  y = pre(x);"),
        "M.mo:7: pre(`x`) names a continuous coordinate where the read is n",
    ),
    "sample with a variable period": (
        in_model("discrete Real d;", "when sample(0, u) then\n    d = u;\n  end when;\n  y = d;"),
        "M.mo:6: sample interval is not parameter-evaluable: unknown",
    ),
    "sample with period zero": (
        in_model("discrete Real d;", "when sample(0, 0) then\n    d = u;\n  end when;\n  y = d;"),
        "M.mo:6: clock interval must be strictly positive (MLS \u00a716.3",
    ),
    "reinit of a variable that is no state": (
        in_model("Real a;", "a = u;\n  when u > 0 then\n    reinit(a, 0);\n  end when;\n  y = a;"),
        "M.mo:8: reinit() can only be applied to state variables: a is not a",
    ),
    "reinit outside of when": (
        in_model("Real x;", "der(x) = u;\n  reinit(x, 0);\n  y = x;"),
        "M.mo:7: reinit() can only be used inside when-equations (MLS \u00a78.3.6)",
    ),
    "nested when": (
        in_model(
            "discrete Real d;",
            (
                "when u > 0 then\n    when u > 1 then\n      d = 1;\n    end when;\n  end when;\n  "
                "y = d;"
            ),
        ),
        "M.mo:6: when-equations cannot be nested (MLS §8.3.5)",
    ),
    "when with a Real": (
        in_model("discrete Real d;", "when u then\n    d = 1;\n  end when;\n  y = d;"),
        "M.mo:6: when-equation condition must be Boolean, found `Real` (MLS",
    ),
    "delay with a variable duration": (
        in_model("", "y = delay(u, u);"),
        "M.mo:6: delay() time argument must be a parameter expression when",
    ),
    "connect of unlike connectors": (
        in_model(
            "connector C\n    Real e;\n    flow Real f;\n  end C;\n  connector D\n    Real g;\n   "
            " flow Real h;"
            "\n  end D;\n  C c;\n  D d;",
            "connect(c, d);\n  y = u;",
        ),
        "M.mo:6: this equation is superfluous: the others determine all its",
    ),
    "connect of unknown": (
        in_model("", "connect(y, z);"),
        "M.mo:6: connect argument 'y' must be a connector, but has builtin ",
    ),
    "endless function": (
        in_model(
            (
                "function f\n    input Real a;\n    output Real r;\n  algorithm\n    r := f(a);\n  "
                "end f;"
            ),
            "y = f(u);",
        ),
        "M.mo:8: the recursive function M.f is not supported",
    ),
    "missing library": (
        "model M\n  input Real u;\n  output Real y;\n  \nequation\n  y = u;"
        '\n  annotation(uses(Missing(version="1.0")));\nend M;\n',
        "M.mo:7: uses the library Missing 1.0, which is not found; add its",
    ),
    "missing standard library": (
        in_model("Modelica.Blocks.Math.Gain g(k=2);", "g.u = u;\n  y = g.y;"),
        "M.mo:4: uses the library Modelica, which is not found; add its",
    ),
    "external language": (
        in_model(
            (
                'function f\n    input Real a;\n    output Real r;\n  external "FORTRAN 77" r = '
                "f(a);\n  end f;"
            ),
            "y = f(u);",
        ),
        "M.mo:4: found the language FORTRAN 77 of an external function,",
    ),
    "external include is missing": (
        in_model(
            "pure function f\n    input Real a;\n    output Real r;"
            '\n  external "C" r = f(a) annotation(Include="#include \\"missing.h\\"");\n  end f;',
            "y = f(u);",
        ),
        'M.mo:4: f: the file "missing.h" of its Include annotation is not',
    ),
    "external package is unknown": (
        in_model(
            "pure function f\n    input Real a;\n    output Real r;"
            '\n  external "C" r = f(a) annotation(Include="#include \\"f.h\\"", '
            'IncludeDirectory="modelica://Missing/Resources");\n  end f;',
            "y = f(u);",
        ),
        'M.mo:4: f: unknown package in "modelica://Missing/Resources"',
    ),
    "external String array": (
        in_model(
            "pure function f\n    input Boolean a[:];\n    output Real r;"
            '\n  external "C" r = f(a) annotation(Include="");\n  end f;',
            "y = f({true, false});",
        ),
        "M.mo:10: external function link facts must name a nonempty library",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_model_is_refused_with_file_line_and_reason(tmp_path, monkeypatch, case):
    text, expected = BAD[case]
    monkeypatch.delenv("MODELICAPATH", raising=False)
    path = tmp_path / "M.mo"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        check_block(load_block(path))
    lines = str(caught.value).splitlines()
    assert len(lines) == len(caught.value.problems)
    assert all(re.match(rf"{re.escape(str(tmp_path))}/M.mo:\d+: \S", line) for line in lines), lines
    assert lines[0].removeprefix(f"{tmp_path}/").startswith(expected)


#: name -> text of the file, part of the message
FAILING = {
    "events without end": (
        in_model(
            "Boolean a(start=false);\n  Boolean b(start=false);",
            "a = not pre(b);\n  b = pre(a);\n  y = if a then 1 else 0;",
        ),
        "the event iteration does not end",
    ),
    "the same equation twice": (
        in_model("Real a;\n  Real b;", "a + b = u;\n  2*a + 2*b = 2*u;\n  y = a;"),
        "a system of equations has no solution",
    ),
    "variables that depend on each other only": (
        in_model("Real a;\n  Real b;\n  Real c;", "a = b + u;\n  b = c;\n  c = a;\n  y = a;"),
        "a system of equations has no solution",
    ),
    "an equation without a solution": (
        in_model("Real a(start=1);", "a*a + 1 = 0*u;\n  y = a;"),
        "a system of equations has no solution",
    ),
    "a violated assertion": (
        in_model("", 'y = u;\n  assert(u > 1, "u is too small");'),
        "u is too small",
    ),
}


@pytest.mark.parametrize("case", FAILING)
def test_a_model_that_cannot_be_simulated_fails_with_a_reason(tmp_path, case):
    text, expected = FAILING[case]
    path = tmp_path / "M.mo"
    path.write_text(text)
    with pytest.raises(ComponentError, match=expected):
        _simulate(load_interpreter(path))


def _simulate(model: Interpreter) -> None:
    model.initialize()
    model.step(0.0, 0.01)
