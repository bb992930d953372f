"""A package adds a kind of component source, as in docs/python.md."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import cosim
from cosim.scenario import component_schema, component_sources, load_scenario
from cosim.studies.execution.bundle import collect_bundle

PAGE = (Path(cosim.__file__).parents[1] / "docs/python.md").read_text("utf-8")


def block(title):
    """Return a block of the page by its title."""
    (text,) = re.findall(rf'^```\w+ title="{title}"\n(.*?)^```$', PAGE, re.MULTILINE | re.DOTALL)
    return text


def install(site, name, code, sources):
    """Write a package of one module into the folder `site` as pip does."""
    about = site / f"{name}-1.0.dist-info"
    about.mkdir(parents=True)
    (site / f"{name}.py").write_text(code)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    entries = ["[cosim.sources]", *(f"{key} = {value}" for key, value in sources.items())]
    (about / "entry_points.txt").write_text("\n".join(entries))


@pytest.fixture
def installed(tmp_path):
    """Folder with the package of the page as pip installs it."""
    project = tomllib.loads(block("recordings/pyproject.toml"))["project"]
    site, sources = tmp_path / "site", project["entry-points"]["cosim.sources"]
    install(site, project["name"], block("recordings/recordings.py"), sources)
    return site


def forget_kinds():
    component_sources._kinds_of_packages.cache_clear()
    component_schema.component_model.cache_clear()


@pytest.fixture
def recordings(installed, monkeypatch):
    """The package is installed in this process."""
    monkeypatch.syspath_prepend(installed)
    forget_kinds()
    yield
    forget_kinds()
    sys.modules.pop("recordings", None)


@pytest.fixture
def replay(folder):
    """The scenario of the page, in a folder of its own."""
    (folder.path / "runs").mkdir()
    (folder.path / "runs/wind.csv").write_text("time,speed\n0,3\n1,5\n")
    return folder.write(block("replay.json"), "runs/replay.json")


def change(file, **keys):
    content = json.loads(file.read_text())
    content["components"]["wind"] |= keys
    file.write_text(json.dumps(content))
    return file


@pytest.mark.usefixtures("recordings")
def test_a_scenario_uses_the_kind(replay):
    result = cosim.run(replay)
    assert result["wind.speed"].tolist() == [4.0, 4.0, 6.0, 6.0, 6.0]
    about = result.metadata
    assert about["system"]["components"][0]["origin"] == "wind.csv"
    assert {"wind.csv", "replay.json"} == about["sha256"].keys()


@pytest.mark.usefixtures("recordings", "replay")
def test_extending_files_settings_and_bundles_find_its_files(folder):
    outer = folder.write({"extends": "runs/replay", "name": "outer"}, "outer.json")
    assert cosim.run(outer, {"/components/wind/offset": 2.0})["wind.speed"][0] == 5.0
    assert set(collect_bundle(outer).files) == {"outer.json", "runs/replay.json", "runs/wind.csv"}
    assert folder.path / "runs/wind.csv" in load_scenario(outer).files()
    system = {"components": {"wind": {"recording": "runs/wind.csv"}}}
    assert "a.wind.speed" in cosim.run(folder.scenario({"a": {"system": system}}))
    other = folder.write(
        {"extends": "outer", "name": "n", "components": {"wind": folder.block("Gain")}},
        "other.json",
    )
    assert "wind.y" in cosim.run(other)


@pytest.mark.usefixtures("recordings")
@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"offset": "1"}, "$.components.wind.offset: expected a valid number"),
        ({"ofset": 1}, '$.components.wind.ofset: unknown key; did you mean "offset"?'),
        ({"recording": "w.csv"}, '$.components.wind: cannot read "w.csv"'),
        ({"fmu": "a.fmu"}, "expected exactly one of fmu, python, modelica, system, recording"),
        ({"solver": {"method": "euler"}}, '"solver" is for components with "fmu"'),
        ({"period": "x"}, "$.components.wind.period: expected seconds"),
    ],
)
def test_problems_name_its_keys(replay, folder, keys, text):
    (line,) = folder.problems_of(change(replay, **keys))
    assert text in line


@pytest.mark.usefixtures("recordings")
def test_a_key_of_the_kind_belongs_to_it(folder):
    (line,) = folder.problems({"a": folder.block("Gain", offset=1.0)})
    assert '"offset" is for components with "recording"' in line


@pytest.mark.usefixtures("recordings")
def test_defaults_of_the_kind_are_no_keys_of_others(folder):
    (line,) = folder.problems({"a": folder.block("Gain", period="x")})
    assert "$.components.a.period: expected seconds" in line


CONSTANT = """
from cosim.core.component import Component, Variable
from cosim.scenario.component_sources import ComponentSource, key

class Constant(Component):
    has_state = False
    binds_everything = True
    variables = [Variable("y", causality="output")]

    def get(self, name):
        return self.value

    def bind(self, inputs, outputs):
        (self.outputs,) = outputs.arrays.values()

    def get_outputs(self):
        self.outputs[:] = self.value

class Source(ComponentSource):
    KEY = "constant"
    constant: float = key("value of the output y", 1.5)

    def create(self, creation):
        component = Constant()
        component.value = self.constant
        return component
"""


def test_the_key_may_hold_a_number(folder, tmp_path, monkeypatch):
    install(tmp_path / "site", "constants", CONSTANT, {"constant": "constants:Source"})
    monkeypatch.syspath_prepend(tmp_path / "site")
    forget_kinds()
    try:
        assert cosim.run(folder.scenario({"c": {"constant": 2.5}}))["c.y"].tolist()[0] == 2.5
        (line,) = folder.problems({"c": {"constant": "x"}})
        assert "$.components.c.constant: expected a valid number" in line
        (line,) = folder.problems({"c": {"constnt": 2.5}})
        assert 'did you mean "constant"?' in line
    finally:
        forget_kinds()
        sys.modules.pop("constants", None)


def test_without_the_package_the_key_is_unknown(replay, folder):
    (line, *_) = folder.problems_of(replay)
    assert "$.components.wind.recording: unknown key" in line


@pytest.mark.usefixtures("recordings")
@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("Missing", "cannot be imported"),
        ("Recording", "expected a subclass of ComponentSource"),
        ("FmuSource", 'expected KEY = "recording"'),
    ],
)
def test_a_wrong_entry_point_names_its_package(replay, installed, kind, text):
    module = installed / "recordings.py"
    module.write_text(
        f"from cosim.scenario.component_sources import FmuSource\n{module.read_text()}"
    )
    file = installed / "recordings-1.0.dist-info/entry_points.txt"
    file.write_text(f"[cosim.sources]\nrecording = recordings:{kind}\n")
    with pytest.raises(cosim.InputError) as refusal:
        cosim.run(replay)
    assert 'the kind of sources "recording" of the package recordings' in str(refusal.value)
    assert text in str(refusal.value)


@pytest.mark.usefixtures("recordings")
@pytest.mark.parametrize(
    "module", ["import missing_library", "raise SystemExit(3)", "Broken = int", "1 +"]
)
def test_a_broken_package_keeps_no_other_scenario_from_running(
    replay, installed, folder, module, caplog
):
    (installed / "damaged.py").write_text(module)
    (installed / "damaged-2.0.dist-info").mkdir()
    (installed / "damaged-2.0.dist-info/METADATA").write_text("Name: damaged\nVersion: 2.0\n")
    entry = "[cosim.sources]\ndamaged = damaged:Broken\n"
    (installed / "damaged-2.0.dist-info/entry_points.txt").write_text(entry)
    assert cosim.run(replay)["wind.speed"].tolist() == [4.0, 4.0, 6.0, 6.0, 6.0]
    (warning,) = caplog.messages
    assert 'the kind of sources "damaged" of the package damaged' in warning
    (line, *_) = folder.problems_of(change(replay, ofset=1))
    assert '$.components.wind.ofset: unknown key; did you mean "offset"?' in line
    with pytest.raises(cosim.InputError) as refusal:
        cosim.run(folder.scenario({"a": {"damaged": "x"}}))
    assert str(refusal.value).startswith('the kind of sources "damaged" of the package damaged')


def test_commands_know_the_kind(replay, installed):
    def command(*words):
        return subprocess.run(
            [sys.executable, "-m", "cosim", *words],
            env={**os.environ, "PYTHONPATH": str(installed)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout

    assert "wind  wind.csv, 0 inputs, 1 output" in command("check", str(replay))
    component = json.loads(command("schema"))["$defs"]["ComponentSpec"]
    assert component["properties"]["recording"]["description"].startswith("path of a CSV file")
