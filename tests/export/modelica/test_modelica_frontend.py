"""Modelica front end: name lookup, source locations and errors."""

from __future__ import annotations

from pathlib import Path

import pytest
from lxml import etree

from cosim.core.errors import InputError
from cosim.export.fmu.description_xml import model_description_xml
from cosim.export.modelica import load_block
from cosim.export.modelica.frontend import rumoca_frontend

PACKAGE = """package Lib
  constant Real Ts = 0.01;
  connector RealInput = input Real;
end Lib;"""
MEMBER = """within Lib;
block Double
  RealInput u;
  output Real y(start = 0, fixed = true);
equation
  when sample(0, Ts) then
    y = 2*u;
  end when;
end Double;"""
TOP = """model Top
  Lib.RealInput u;
  output Real y;
  Lib.Double double;
equation
  connect(u, double.u);
  y = double.y;
end Top;"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    root = tmp_path / "models"
    (root / "Lib").mkdir(parents=True)
    (root / "Lib" / "package.mo").write_text(PACKAGE)
    (root / "Lib" / "Double.mo").write_text(MEMBER)
    (root / "Top.mo").write_text(TOP)
    return root


def test_a_model_uses_packages_beside_it_and_ships_their_sources(folder, compile_both):
    model = compile_both(folder / "Top.mo")
    assert sorted(model.c.block.resources) == ["Lib/Double.mo", "Lib/package.mo", "Top.mo"]
    model.set(u=1.5)
    model.initialize()
    model.step(0.0)
    assert model.get("y") == 3.0


def test_files_beside_the_model_are_not_read(folder):
    expected = load_block(folder / "Top.mo").files
    (folder / "Broken.mo").write_text("this is no Modelica")
    (folder / "Twin.mo").write_text("model Top\n  output Real z;\nequation\n  z = 1;\nend Top;")
    assert load_block(folder / "Top.mo").files == expected


def test_a_file_with_within_is_loaded_as_a_member_of_its_package(folder):
    block = load_block(folder / "Lib" / "Double.mo")
    assert (block.identifier, sorted(block.resources)) == (
        "Double",
        ["Lib/Double.mo", "Lib/package.mo"],
    )


def test_an_fmu_contains_only_the_files_that_the_model_needs(folder):
    (folder / "Other").mkdir()
    (folder / "Other/package.mo").write_text("package Other end Other;")
    (folder / "Lib/Unused.mo").write_text(
        MEMBER.replace("Double", "Unused").replace("Lib;", "Lib; // Double, Third", 1)
    )
    (folder / "Lib/Third.mo").write_text("within Lib; package Third end Third;")
    (folder / "Lib/Double.mo").write_text(MEMBER.replace("2*u", "Half.half(4*u)"))
    (folder / "Lib/Half").mkdir()
    (folder / "Lib/Half/package.mo").write_text("within Lib; package Half end Half;")
    (folder / "Lib/Half/Third.mo").write_text("within Lib.Half; package Third end Third;")
    half = (
        "within Lib.Half; function half input Real u; output Real y; algorithm y := u/2; end half;"
    )
    (folder / "Lib/Half/half.mo").write_text(half)
    block = load_block(folder / "Top.mo")
    needed = [
        "Lib/Double.mo",
        "Lib/Half/half.mo",
        "Lib/Half/package.mo",
        "Lib/package.mo",
        "Top.mo",
    ]
    assert sorted(block.resources) == needed
    alone = folder / "alone"
    for name, file in block.resources.items():
        (alone / name).parent.mkdir(parents=True, exist_ok=True)
        (alone / name).write_text(file.read_text())
    assert load_block(alone / "Top.mo").files == block.files


def test_a_model_in_a_package_file_uses_the_other_files_of_its_package(folder):
    (folder / "Lib/package.mo").write_text(
        PACKAGE.replace("end Lib", "block Own extends Double; end Own;\nend Lib")
    )
    block = load_block(folder / "Lib/package.mo", "Lib.Own")
    assert sorted(block.resources) == ["Lib/Double.mo", "Lib/package.mo"]
    with pytest.raises(
        InputError, match=r"no model with the name Lib; write .*Lib/package\.mo:Lib\.Own"
    ):
        load_block(folder / "Lib/package.mo")


def test_a_model_of_a_file_is_selected_by_name(write_model):
    path = write_model(
        "model A\n  output Real y;\nequation\n  y = 1;\nend A;\nmodel B\n  output Real z;\n"
        "equation\n  z = 2;\nend B;"
    )
    assert [v.name for v in load_block(path, "A").variables] == ["y"]
    assert [v.name for v in load_block(path).variables] == ["z"]


def test_syntax_errors_come_with_file_and_line(folder):
    (folder / "Lib" / "Double.mo").write_text(MEMBER.replace("RealInput u;", "RealInput u"))
    (folder / "Top.mo").write_text(TOP.replace("output Real y;", "output Real ;"))
    with pytest.raises(InputError) as caught:
        load_block(folder / "Top.mo")
    places = {problem.where for problem in caught.value.problems}
    assert places == {f"{folder / 'Top.mo'}:3", f"{folder / 'Lib' / 'Double.mo'}:3"}


def test_unknown_names_come_with_file_and_line(folder):
    (folder / "Lib" / "Double.mo").write_text(MEMBER.replace("2*u", "2*velocity"))
    with pytest.raises(
        InputError, match=r"Double.mo:7: unresolved component reference: 'velocity'"
    ):
        load_block(folder / "Top.mo")


def test_a_model_is_not_confused_with_a_member_of_the_same_name(folder):
    text = TOP.replace("Top", "Double").replace("  y = double.y;", "  y = sin(y) + double.y;")
    (folder / "Double.mo").write_text(text)
    assert "newton.h" in load_block(folder / "Double.mo").files


def test_a_panic_of_the_front_end_is_an_input_error(write_model):
    path = write_model("""model M
  input Real w[3];
  output Real y;
equation
  when sample(0, 0.01) then
    y = sum(w[i]*i for i in 1:3);
  end when;
end M;""")
    with pytest.raises(InputError, match=r"M.mo:1: the Modelica front end failed on the model M"):
        load_block(path)


def test_a_missing_model_and_a_missing_file(folder):
    with pytest.raises(InputError, match="no such Modelica file"):
        load_block(folder / "Nothing.mo")
    with pytest.raises(InputError, match=r"Top.mo:1: .*Other"):
        load_block(folder / "Top.mo", "Other")


def test_another_version_of_the_front_end_is_refused(folder, monkeypatch):
    monkeypatch.setattr(rumoca_frontend, "RUMOCA_VERSION", "0.9.0")
    with pytest.raises(InputError, match=r"found rumoca 0.10.2, but only 0.9.0 is supported"):
        load_block(folder / "Top.mo")


def test_a_location_in_a_message_of_the_front_end_is_preserved(write_model):
    path = write_model("""package P
  constant Integer n = 3;
end P;
model M
  Real v[P.n];
  output Real y;
equation
  y = 1;
end M;""")
    with pytest.raises(InputError, match=r"M.mo:5: unevaluable array dimensions for 'v'"):
        load_block(path)


def test_attributes_of_types_reach_the_fmu(write_model):
    block = load_block(
        write_model("""block Typed
  type Mass = Real(quantity = "Mass", unit = "kg", min = 0, max = 10);
  type Mode = enumeration(Off, On);
  parameter Mass m = 3 "Load";
  parameter Mode mode = Mode.On;
  output Mass y;
equation
  y = if mode == Mode.On then m else 0;
end Typed;""")
    )
    for version, enumeration in ((2, "SimpleType"), (3, "EnumerationType")):
        root = etree.fromstring(model_description_xml(block, version, "token", ["model.c"]))
        variables = {element.get("name"): element for element in root.find("ModelVariables")}
        attributes = [
            variables[name] if version == 3 else variables[name][0] for name in ("m", "y", "mode")
        ]
        for mass in attributes[:2]:
            assert [mass.get(key) for key in ("quantity", "unit", "min", "max")] == [
                "Mass",
                "kg",
                "0.0",
                "10.0",
            ]
        assert variables["m"].get("description") == "Load"
        (type_name,) = [element.get("name") for element in root.iter(enumeration)]
        assert attributes[2].get("declaredType") == type_name == "Mode"


MACHINE = """within Lib;
block Machine  // with initialState(idle)
  block State
    outer output Real v;
  equation
    v = 0;
  end State;
  inner output Real v;
  State idle, run;
  input Boolean go;
equation
  initialState(idle);
  transition(idle, run, go);
end Machine;"""
RESET = """within Lib;
block Reset
  input Real u;
  output Real y(start = 0, fixed = true);
  discrete Real n(start = 0);
equation
  der(y) = u;
algorithm
  when u > 1 then
    n := pre(n) + 1;
    reinit(y, 0);
  end when;
end Reset;"""
UNSUPPORTED = [
    (
        "Machine",
        MACHINE,
        12,
        (
            "state machines (initialState, transition) are not supported; write the state as a "
            "variable of an "
        ),
    ),
    ("Reset", RESET, 11, "reinit() is not supported in algorithms; write it in a when-equation "),
    (
        "Reset",
        RESET.replace("reinit(y, 0)", 'terminate("end")'),
        11,
        "terminate() is not supported in algorithms of packages; ",
    ),
]


@pytest.mark.parametrize(("name", "text", "line", "message"), UNSUPPORTED)
def test_an_unsupported_operator_is_one_problem_at_its_place(folder, name, text, line, message):
    member = folder / f"Lib/{name}.mo"
    member.write_text(text)
    (folder / "Heir.mo").write_text(f"block Heir\n  extends Lib.{name};\nend Heir;")
    for path in (folder / "Heir.mo", member):
        with pytest.raises(InputError) as caught:
            load_block(path)
        assert [problem.where for problem in caught.value.problems] == [f"{member}:{line}"]
        assert caught.value.problems[0].message.startswith(message)
