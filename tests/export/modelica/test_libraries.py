"""Modelica libraries: search, versions, cached flat models."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from fmpy import simulate_fmu
from modelica_interpreter import load_interpreter

import cosim
from cosim.cli import cli
from cosim.core.errors import InputError
from cosim.export.modelica import ModelicaOptions
from cosim.export.modelica.frontend import rumoca_frontend
from cosim.export.modelica.frontend.libraries import find_libraries, libraries_in

MODEL = """
model Doubled
  output Real y;
  input Real u(start = 0);
  Blocks.Gain gain;
equation
  gain.u = u;
  y = gain.y;
  {annotation}
end Doubled;
"""
GAIN = """
within Blocks;
model Gain
  input Real u;
  output Real y;
equation
  y = Constants.factor*u;
end Gain;
"""
BLOCKS = """
package Blocks "a library; annotation(version=\\"9\\") in a text is none"
  annotation(version="2.1.0", uses(Constants(version="1.0")),
    conversion(noneFromVersion="2.0.0", from(version="1.0")));
end Blocks;
"""
CONSTANTS = 'package Constants constant Real factor = 2; annotation(version="1.0"); end Constants;'


def write(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("MODELICAPATH", raising=False)


@pytest.fixture
def library(tmp_path) -> Path:
    return write(
        tmp_path / "library",
        {
            "Blocks/package.mo": BLOCKS,
            "Blocks/Gain.mo": GAIN,
            "Constants 1.0/package.mo": CONSTANTS,
        },
    )


@pytest.fixture
def model(tmp_path):
    def create(annotation: str = "") -> Path:
        return (
            write(tmp_path / "model", {"Doubled.mo": MODEL.format(annotation=annotation)})
            / "Doubled.mo"
        )

    return create


def gain_of(path: Path, *folders: Path) -> float:
    interpreter = load_interpreter(path, None, ModelicaOptions(folders))
    interpreter.set("u", 3.0)
    interpreter.initialize()
    return float(interpreter.get("y")) / 3


def found(path: Path, *folders: Path) -> list[str]:
    return [str(library) for library in find_libraries([path], list(folders), ())]


def problems_of(path: Path, *folders: Path) -> list[str]:
    with pytest.raises(InputError) as caught:
        find_libraries([path], list(folders), ())
    return [str(problem) for problem in caught.value.problems]


def test_libraries_that_a_model_refers_to_are_found_with_those_that_they_use(model, library):
    assert found(model(), library) == ["Blocks 2.1.0", "Constants 1.0"]


def test_the_environment_variable_lists_folders(model, library, monkeypatch):
    monkeypatch.setenv("MODELICAPATH", f"{library.parent}:{library}")
    assert gain_of(model()) == 2


def test_given_folders_are_searched_first(model, library, tmp_path, monkeypatch):
    monkeypatch.setenv("MODELICAPATH", str(library))
    other = write(
        tmp_path / "other", {"Constants.mo": CONSTANTS.replace("factor = 2", "factor = 5")}
    )
    assert gain_of(model(), other) == 5


def test_a_folder_may_be_a_library_itself(model, library):
    assert found(model(), library / "Blocks", library / "Constants 1.0") == [
        "Blocks 2.1.0",
        "Constants 1.0",
    ]


def test_a_record_in_a_file_of_its_own_is_found_by_its_name(library, tmp_path):
    write(library, {"Phasor.mo": "record Phasor\n  Real re;\n  Real im;\nend Phasor;\n"})
    text = (
        "model Rotation\n  input Real u;\n  output Real y;\n  Phasor p = Phasor(u, 0);\nequation\n "
        " y = 2*p.re;\nend Rotation;\n"
    )
    assert gain_of(write(tmp_path / "model", {"Rotation.mo": text}) / "Rotation.mo", library) == 2


def test_the_required_version_is_selected(model, library):
    write(
        library,
        {
            "Blocks 3.0.0/package.mo": BLOCKS.replace("2.1.0", "3.0.0"),
            "Blocks 10.0.0/package.mo": "package Blocks end Blocks;",
        },
    )
    assert [str(each) for each in libraries_in([library])][:3] == [
        "Blocks 2.1.0",
        "Blocks 10.0.0",
        "Blocks 3.0.0",
    ]
    assert found(model('annotation(uses(Blocks(version="3.0.0")));'), library)[0] == "Blocks 3.0.0"
    assert (
        found(model('annotation(uses(Blocks(version = "2.0.0")));'), library)[0] == "Blocks 2.1.0"
    )


def test_a_version_that_does_not_fit_is_refused(model, library):
    path = model('annotation(uses(Blocks(version="1.0")));')
    assert problems_of(path, library) == [
        f'{path}:5: uses the library Blocks 1.0, found Blocks 2.1.0 in "{library / "Blocks"}"'
    ]


def test_a_missing_library_is_named(model, library):
    path = model('annotation(uses(Block(version="1.0")));')
    text = (
        "which is not found; add its folder to MODELICAPATH or pass --library; did you mean "
        '"Blocks"?'
    )
    assert problems_of(path, library) == [f"{path}:9: uses the library Block 1.0, {text}"]


def test_the_standard_library_is_missed_without_an_annotation(tmp_path):
    path = write(tmp_path, {"M.mo": "model M Modelica.Blocks.Math.Gain g; end M;"}) / "M.mo"
    assert "uses the library Modelica, which is not found" in problems_of(path)[0]


def test_a_missing_folder_is_named(model, tmp_path):
    assert problems_of(model(), tmp_path / "none") == [
        f"{tmp_path / 'none'}: no such folder of Modelica libraries"
    ]


def test_a_package_beside_the_model_hides_a_library(model, library):
    path = model()
    write(
        path.parent,
        {
            "Blocks/package.mo": "package Blocks end Blocks;",
            "Blocks/Gain.mo": GAIN.replace("Constants.factor*u", "7*u"),
        },
    )
    write(path.parent, {"Constants/package.mo": CONSTANTS})
    assert gain_of(path, library) == 7


def test_a_model_is_flattened_again_only_after_a_change(model, library, monkeypatch):
    path, calls = model(), []
    run = rumoca_frontend.run_rumoca
    monkeypatch.setattr(
        rumoca_frontend, "run_rumoca", lambda *arguments: calls.append(1) or run(*arguments)
    )
    assert [gain_of(path, library), gain_of(path, library), len(calls)] == [2, 2, 1]
    write(library, {"Constants 1.0/package.mo": CONSTANTS.replace("factor = 2", "factor = 4")})
    assert [gain_of(path, library), gain_of(path, library), len(calls)] == [4, 4, 2]
    for file in (path.parents[1] / "cache").rglob("*.json.gz"):
        file.write_bytes(file.read_bytes()[:40])
    assert [gain_of(path, library), len(calls)] == [4, 3]


def test_an_error_in_a_library_is_reported(model, library):
    write(library, {"Blocks/Gain.mo": GAIN.replace("y = Constants.factor*u", "y = missing*u")})
    with pytest.raises(InputError, match="'missing'"):
        gain_of(model(), library)


def test_an_fmu_with_a_library_is_built(model, library, tmp_path):
    target = tmp_path / "doubled.fmu"
    done = CliRunner().invoke(
        cli, ["build", str(model()), "--library", str(library), "--output", str(target)]
    )
    assert done.exit_code == 0, done.output
    assert simulate_fmu(str(target), stop_time=0.1, start_values={"u": 4.0})["y"][-1] == 8


@pytest.mark.usefixtures("library")
def test_a_scenario_names_libraries(model, tmp_path):
    component = {
        "modelica": f"{model()}:Doubled",
        "libraries": ["library"],
        "parameters": {"u": 1.5},
    }
    scenario = {
        "name": "s",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": {"a": component},
        "record": {"signals": ["a.*"]},
    }
    path = write(tmp_path, {"s.json": json.dumps(scenario)}) / "s.json"
    assert cosim.run(path)["a.y"][-1] == 3


def test_the_doctor_lists_libraries(library, monkeypatch):
    monkeypatch.setenv("MODELICAPATH", str(library))
    output = CliRunner().invoke(cli, ["doctor"]).output
    assert f"{library}: Blocks 2.1.0, Constants 1.0" in output


LIBRARY = {
    "Search/package.mo": 'package Search annotation(version="1.0"); end Search;',
    "Search/Vectors.mo": """within Search;
package Vectors "return is a word in a text"
  function first
    input Real x;
    output Real y;
  algorithm
    y := 0;
    for k in 1:3 loop
      if x > k then
        y := k;
        return;
      end if;
    end for;
    y := 7;
  end first;
  function both
    input Real x;
    output Real y;
  algorithm
    while y < x loop
      y := y + 1;
      if y > 3 then
        break;
      end if;
    end while;
  end both;
end Vectors;
""",
    "Search/Block.mo": (
        "within Search;\nblock Block\n  input Real u;\n  output Real y = Vectors.first(u);\nend "
        "Block;"
    ),
}


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (
            "extends Search.Block;",
            "Search/Vectors.mo:11: return inside a loop or a branch is not supported",
        ),
        (
            "input Real u; output Real y = Search.Vectors.both(u);",
            "Search/Vectors.mo:16: break inside a loop is not supported",
        ),
    ],
)
def test_an_error_in_a_library_names_its_place(tmp_path, text, place):
    write(tmp_path, LIBRARY)
    model = write(tmp_path, {"m/M.mo": f"block M\n  {text}\nend M;\n"}) / "m" / "M.mo"
    with pytest.raises(InputError) as caught:
        load_interpreter(model, options=ModelicaOptions(library_path=[tmp_path]))
    assert str(caught.value).startswith(f"{tmp_path}/{place}")
