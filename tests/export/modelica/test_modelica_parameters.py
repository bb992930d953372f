"""Variables of a block: FMI attributes and roles of parameters."""

from __future__ import annotations

import re

import numpy as np
import pytest

import cosim
from cosim.core.errors import InputError
from cosim.export.build import build_to
from cosim.export.modelica import ModelicaOptions, load_block

OWNERS = """package P
  block Gain
    parameter Real k(unit = "1", min = 0) = 1 "gain";
    parameter Real k2 = 2*k "follows";
    final parameter Real limit = k + 1;
    input Real u;
    output Real y;
  protected
    parameter Real hidden = 5;
    constant Real table[2] = {10, 20};
  equation
    y = k*u + k2 + limit + hidden + table[2];
  end Gain;
end P;
model M "a model of owners"
  parameter Real base(unit = "m/s") = 3 "owner of a.k";
  parameter Integer n(min = 1, max = 3) = 2;
  parameter Real A[2, 2] = {{1, 2}, {3, 10/4}};
  final parameter Real twice = 2*base;
  input Real u;
  output Real y;
  P.Gain a(k = base);
  P.Gain b(k = 7);
  P.Gain c;
  P.Gain d(final k = 4);
  P.Gain many[2](k = {base, 6});
equation
  a.u = u;
  b.u = u;
  c.u = u;
  d.u = u;
  many[1].u = u;
  many[2].u = u;
  y = a.y + b.y + c.y + d.y + twice + n + A[1, 2] + many[1].y + many[2].y;
  when sample(0, 0.01) then
  end when;
end M;"""


def test_only_independent_unprotected_parameters_can_be_set(write_model):
    shown = {v.name: v.causality for v in load_block(write_model(OWNERS)).variables}
    parameters = {name for name, causality in shown.items() if causality == "parameter"}
    assert parameters == {"base", "n", "A", "b.k", "c.k", "many[2].k"}
    calculated = {name for name, causality in shown.items() if causality == "calculatedParameter"}
    prefixes = ("a", "b", "c", "d", "many[1]", "many[2]")
    assert calculated == {"twice", *(f"{p}.{n}" for p in prefixes for n in ("k2", "limit"))}
    assert not [name for name in shown if "hidden" in name or "table" in name]


def test_dependent_parameters_are_updated_when_a_parameter_is_set(compile_both):
    model = compile_both(OWNERS)
    model.set(base=10.0, b__k=0.5)
    model.compare(0)
    assert [model.get(n) for n in ("twice", "a.k2", "a.limit", "b.k2", "many[1].k2", "c.k2")] == [
        20.0,
        20.0,
        11.0,
        1.0,
        20.0,
        2.0,
    ]
    model.set(u=2.0, A=np.array([[0.0, 100.0], [0.0, 0.0]]))
    model.initialize()
    gains = [10.0, 0.5, 1.0, 4.0, 10.0, 6.0]
    assert model.get("y") == sum(k * 2 + 2 * k + k + 1 + 25 for k in gains) + 20 + 2 + 100


def test_parameters_take_effect_between_steps(compile_both):
    model = compile_both(OWNERS)
    model.initialize()
    model.step(0.0)
    before = model.get("y")
    model.set(base=4.0)
    model.step(0.01)
    assert model.get("y") == before + 2 * (3 * 1.0) + 2.0


def test_variables_have_description_unit_limits_and_start(write_model):
    block = load_block(write_model(OWNERS))
    variables = {v.name: v for v in block.variables}
    assert (block.identifier, block.description, block.step_size) == (
        "M",
        "a model of owners",
        0.01,
    )
    base, gain, matrix, n = variables["base"], variables["c.k"], variables["A"], variables["n"]
    assert (base.type, base.unit, base.description, base.start) == (
        "Float64",
        "m/s",
        "owner of a.k",
        3.0,
    )
    assert (gain.minimum, gain.maximum, gain.member) == (0.0, None, "c_k")
    assert (matrix.shape, matrix.start) == ((2, 2), (1.0, 2.0, 3.0, 2.5))
    assert (n.type, n.minimum, n.maximum, n.start, n.variability) == (
        "Int32",
        1.0,
        3.0,
        2,
        "tunable",
    )
    assert (variables["u"].variability, variables["y"].variability) == ("continuous", "discrete")


def test_start_values_of_states_may_depend_on_parameters(compile_both):
    model = compile_both("""model M
  parameter Real x0 = 2;
  input Real u;
  output Real x(start = 3*x0, fixed = true);
  output Real q[2](start = {x0, 1}, each fixed = true);
equation
  when sample(0, 0.01) then
    x = pre(x) + u;
    q = pre(q) + {1, 1};
  end when;
end M;""")
    model.set(x0=5.0)
    model.initialize()
    assert (model.get("x"), list(model.get("q"))) == (15.0, [5.0, 1.0])
    model.set(u=1.0)
    model.step(0.0)
    assert (model.get("x"), list(model.get("q"))) == (16.0, [6.0, 2.0])


def test_a_large_parameter_array_is_initialized(compile_both):
    model = compile_both("""model M
  constant Integer capacity = 32;
  parameter Integer count(min = 1) = 3;
  parameter Real wx[capacity] = cat(1, {1, 2, 10/3}, fill(0, capacity - 3));
  parameter Boolean on[6] = fill(true, 6);
  input Integer k(min = 1, max = 32, start = 1);
  output Real y;
equation
  when sample(0, 0.01) then
    y = if on[min(k, 6)] then wx[k] + count else -1;
  end when;
end M;""")
    assert model.c.variables["wx"].start == (1.0, 2.0, 10 / 3, *[0.0] * 29)
    model.initialize()
    model.compare(0)
    wx = np.linspace(-1, 1, 32)
    model.set(wx=wx, count=5, on=[True, False, True, True, False, True])
    for k, (place, expected) in enumerate([(1, wx[0] + 5), (2, -1), (32, wx[31] + 5)]):
        model.set(k=place)
        model.step(0.01 * k)
        assert model.get("y") == expected


def test_constants_can_determine_the_sizes_of_arrays_slices_and_loops(compile_both):
    model = compile_both("""model M
  constant Integer half = 2;
  constant Integer full = 2*half;
  constant Real table[full] = {1, 2, 3, 4};
  input Real u;
  output Real y[full];
  output Real s;
equation
  for i in 1:full loop
    y[i] = u*table[i];
  end for;
  s = sum(y[1:half]) + sum(fill(u, full));
  when sample(0, 0.01) then
  end when;
end M;""")
    assert [v.name for v in model.c.block.variables] == ["u", "y", "s"]
    model.initialize()
    for _, inputs in model.run(20):
        assert model.get("s") == inputs["u"] + 2 * inputs["u"] + (
            inputs["u"] + inputs["u"] + inputs["u"] + inputs["u"]
        )


def test_struct_members_are_unique_and_not_reserved_in_c(compile_both):
    model = compile_both("""model M
  block B
    input Real int;
    output Real c;
  equation
    c = 2*int;
  end B;
  parameter Real double = 2;
  input Real b_c;
  input Boolean failure;
  output Real m;
  output Real clock;
  B b;
equation
  b.int = b_c;
  m = double*b.c;
  clock = if failure then 1 else time;
  when sample(0, 0.01) then
  end when;
end M;""")
    members = [v.member for v in model.c.block.variables]
    assert len(set(members)) == len(members)
    model.set(b_c=1.5, failure=True)
    model.initialize()
    assert (model.get("m"), model.get("clock")) == (6.0, 1.0)


def test_the_same_source_gives_the_same_c(write_model):
    path = write_model(OWNERS)
    assert load_block(path).files == load_block(path).files
    assert str(path.parent) not in "".join(load_block(path).files.values())


STRUCTURE = """block Structure
  block Part
    parameter Boolean twice = false;
    parameter Real gains[2] = {1, 1};
    input Real u;
    output Real y;
  equation
    y = if twice then 2*gains[1]*u else gains[2]*u;
  end Part;
  parameter Integer n = 2;
  input Real u;
  output Real y[n];
  Part part[n](each u = u);
  Part single(u = u);
equation
  y[1] = single.y;
  for i in 2:n loop
    y[i] = i*part[i].y;
  end for;
end Structure;"""


def test_parameters_can_be_set_when_building(write_model, tmp_path):
    """Also structural ones, those of components and arrays; the model keeps its name and its other
    values.
    """
    values = {"n": 3, "single.twice": True, "single.gains": [2.5, 1]}
    fmu = build_to(write_model(STRUCTURE), None, tmp_path / "structure.fmu", values=values)
    result = cosim.simulate(fmu, stop_time=0.02, start_values={"u": 2.0})
    assert [result[f"y[{k}]"][-1] for k in (1, 2, 3)] == [10.0, 4.0, 6.0]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"m": 3}, 'the model Structure has no parameter "m"; valid: '),
        (
            {"single.twise": 1},
            'the model Structure has no parameter "single.twise"; did you mean "single.twice"?',
        ),
        ({"n; end": 3}, "n; end: expected the name of a parameter"),
        ({"n": {"a": 1}}, "n: found {'a': 1}, expected a number, true, false, a text or a list"),
    ],
)
def test_values_of_something_else_are_refused(write_model, values, message):
    with pytest.raises(InputError, match=re.escape(message)):
        load_block(write_model(STRUCTURE), options=ModelicaOptions(values=values))


def test_values_reach_a_member_of_a_package(tmp_path):
    (tmp_path / "Lib").mkdir()
    (tmp_path / "Lib" / "package.mo").write_text("package Lib end Lib;")
    member = tmp_path / "Lib" / "Wide.mo"
    member.write_text(
        "within Lib; block Wide parameter Integer n = 1; output Real y[n] = fill(1.0, n); end Wide;"
    )
    sizes = [
        v.shape
        for v in load_block(member, options=ModelicaOptions(values={"n": 4})).variables
        if v.name == "y"
    ]
    assert sizes == [(4,)]


def test_only_models_have_values_when_building(tmp_path):
    (tmp_path / "a.py").write_text("")
    with pytest.raises(InputError, match="only parameters of Modelica models can be set"):
        build_to(tmp_path / "a.py", None, tmp_path / "a.fmu", values={"n": 3})


def test_an_unknown_unit_of_a_parameter_is_left_out_with_a_warning_that_names_the_line(
    write_model, caplog
):
    path = write_model("""model M
  parameter Real gain(unit = "dB") = 3;
  parameter Real current(unit = "mA") = 4;
  input Real u;
  output Real y(unit = "kHz");
equation
  y = gain*u + current;
end M;""")
    units = {variable.name: variable.unit for variable in load_block(path).variables}
    assert (units["gain"], units["current"], units["y"]) == ("", "mA", "kHz")
    assert [record.getMessage() for record in caplog.records] == [
        f'{path}:2: gain: the FMU states no unit: unknown unit "dB"'
    ]


def test_an_unknown_unit_of_an_input_or_output_is_refused_with_its_line(write_model):
    path = write_model("""model M
  input Real u(unit = "Volt");
  output Real y;
equation
  y = u;
end M;""")
    with pytest.raises(InputError, match=r'M\.mo:2: u: unknown unit "Volt"'):
        load_block(path)
