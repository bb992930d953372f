"""A component with a Modelica source is built when it is needed, and kept until it changes."""

import pytest

import cosim

GAIN = """
block Doubler
  parameter Real k = 2;
  input Real u(start = 0);
  output Real y(start = 0);
equation
  when sample(0, 1) then
    y = k*u;
  end when;
end Doubler;
"""


def test_a_modelica_source_runs_and_is_built_once(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "models").mkdir()
    source = tmp_path / "models" / "Doubler.mo"
    source.write_text(GAIN)
    component = {"modelica": "models/Doubler.mo:Doubler", "parameters": {"u": 3.0}}
    file = folder.scenario({"a": component})
    assert cosim.run(file)["a.y"].tolist() == [0, 6, 6, 6]
    (built,) = (tmp_path / "cache").rglob("*.fmu")
    stamp = built.stat().st_mtime_ns
    assert cosim.run(file, {"a.k": 5.0})["a.y"].tolist() == [0, 15, 15, 15]
    assert built.stat().st_mtime_ns == stamp
    source.write_text(GAIN.replace("k*u", "k*u + 1"))
    assert cosim.run(file)["a.y"].tolist() == [0, 7, 7, 7]


def test_the_files_of_a_run_are_the_modelica_files_that_it_needs_and_not_the_cached_fmu(
    folder, tmp_path
):
    for name in ("Used", "Beside"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "package.mo").write_text(
            f"package {name}\n  constant Real k = 2;\nend {name};\n"
        )
    (tmp_path / "Doubler.mo").write_text(GAIN.replace("k*u", "Used.k*u"))
    result = cosim.run(
        folder.scenario({"a": {"modelica": "Doubler.mo:Doubler", "parameters": {"u": 3.0}}})
    )
    assert result["a.y"].tolist() == [0, 6, 6, 6]
    assert sorted(result.metadata["sha256"]) == ["Doubler.mo", "Used/package.mo", "scenario.json"]


def test_a_model_that_cannot_be_built_is_reported_with_its_line(folder, tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "Doubler.mo").write_text(GAIN.replace("k*u", "k*w"))
    file = folder.scenario({"a": {"modelica": "models/Doubler.mo:Doubler"}})
    with pytest.raises(cosim.InputError, match=r"Doubler\.mo:8.*w"):
        cosim.run(file)
