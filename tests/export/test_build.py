"""`cosim build`: export of sources to fmus/, the manifest, and the check of both."""

from __future__ import annotations

import json
import multiprocessing
import re
import shutil
from hashlib import sha256
from pathlib import Path

import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from cosim.core.errors import InputError
from cosim.export import build_check
from cosim.export.build import build, build_to, cached_fmu, read_manifest
from cosim.export.build_check import check_fmus
from cosim.export.fmu_sources import classify_source, find_sources, snake_case, tool_version

pytestmark = pytest.mark.slow

EQUATIONS = """
from pathlib import Path

from cosim.export.fmu.block import Block, BlockVariable

from .parameters import GAIN

HERE = Path(__file__).parent


def block():
    variables = (
        BlockVariable("gain", "gain", "Float64", "parameter", "tunable", GAIN),
        BlockVariable("x", "x", "Float64", "input", "continuous", 0.0),
        BlockVariable("y", "y", "Float64", "output", "continuous"),
    )
    files = {name: (HERE / name).read_text() for name in ("model.h", "model.c")}
    return Block("raft", "a raft", variables, 0.01, files)
"""
HEADER = "typedef struct { double gain, x, y; } Model;\n"
MODEL = """
#include "model.h"
#include <stdlib.h>
void model_start(Model *m) { m->gain = 1.0; }
void model_parameters(Model *m) { (void)m; }
const char *model_initialize(Model *m, double t) { (void)m; (void)t; return 0; }
const char *model_step(Model *m, double t, double h)
{
    (void)t;
    m->y += m->gain * m->x * h;
    return 0;
}
"""
CLASS = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Doubler(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.x, self.y = 1.0, 2.0
        self.register_variable(Real("x", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.y = 2 * self.x
        return True
"""
MODELICA = """
model SampledPi "sampled PI with clamp"
  parameter Real kp = 2.0;
  parameter Real ki = 0.5;
  input Real e(start = 0);
  output Real u(start = 0, fixed = true);
  discrete Real xi(start = 0, fixed = true);
equation
  when sample(0, 0.01) then
    xi = pre(xi) + 0.01*ki*e;
    u = min(1.0, max(-1.0, kp*e + xi));
  end when;
end SampledPi;
"""


def write(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return root


VEHICLE = "plant_src/vehicles/raft"
FILES = {
    f"{VEHICLE}/equations.py": EQUATIONS,
    f"{VEHICLE}/parameters.py": "GAIN = 1.0\n",
    f"{VEHICLE}/model.h": HEADER,
    f"{VEHICLE}/model.c": MODEL,
    "plant_src/world.py": "no source of an FMU",
    "controllers/python/doubler.py": CLASS,
    "controllers/python/__init__.py": "",
    "controllers/modelica/Library/Gain.mo": "a library block, not exported",
}


@pytest.fixture(scope="module")
def built_once(tmp_path_factory):
    root = write(tmp_path_factory.mktemp("root"), FILES)
    build(None, root)
    return root


@pytest.fixture
def root(built_once, tmp_path):
    """Return a project folder with built FMUs that a test can modify."""
    return Path(shutil.copytree(built_once, tmp_path / "root"))


@pytest.fixture
def forked(monkeypatch):
    """Simulate FMUs in forked processes, which start faster than new ones."""
    context = multiprocessing.get_context("fork")
    monkeypatch.setattr(build_check.multiprocessing, "get_context", lambda _kind: context)


def messages(root):
    return [str(problem) for problem in check_fmus(root)]


def test_every_source_becomes_its_fmus(built_once):
    fmus = {path.relative_to(built_once).as_posix() for path in built_once.rglob("*.fmu")}
    assert fmus == {"fmus/python/doubler.fmu", "fmus/raft.fmu", "fmus/fmi3/raft.fmu"}
    for fmu in fmus:
        assert validate_fmu(str(built_once / fmu)) == []


def test_the_manifest_contains_sources_fmus_and_tools(built_once):
    raft = read_manifest(built_once)["raft"]
    assert list(raft["sources"]) == [f"{VEHICLE}/equations.py", f"{VEHICLE}/parameters.py"]
    assert sorted(raft["fmus"]) == ["fmus/fmi3/raft.fmu", "fmus/raft.fmu"]
    assert set(raft["tools"]) == {"casadi", "compiler"}
    assert all(len(value) == 64 for value in (raft["sources"] | raft["fmus"]).values())


def test_building_again_changes_nothing(root):
    files = [*root.rglob("*.fmu"), root / "fmus/manifest.json"]
    before = [path.read_bytes() for path in files]
    build(None, root)
    assert [path.read_bytes() for path in files] == before


def test_one_source_is_built_alone(root):
    manifest = read_manifest(root)
    (root / "fmus/raft.fmu").unlink()
    write(root, {"controllers/python/doubler.py": CLASS.replace("2 * self.x", "self.x + self.x")})
    reported = []
    (built,) = build([root / "controllers/python/doubler.py"], root, reported.append)
    assert reported == [built]
    assert built.fmus == {2: root / "fmus/python/doubler.fmu"}
    assert not (root / "fmus/raft.fmu").exists()
    assert read_manifest(root)["raft"] == manifest["raft"]
    assert read_manifest(root)["python/doubler"] != manifest["python/doubler"]


def test_building_all_removes_fmus_without_a_source(root):
    (root / "controllers/python/doubler.py").unlink()
    build(None, root)
    assert not (root / "fmus/python/doubler.fmu").exists()
    assert list(read_manifest(root)) == ["raft"]


def test_a_file_that_is_not_a_source_is_refused_with_a_suggestion(root):
    with pytest.raises(
        InputError,
        match=r'doubbler\.py: is not a source .*did you mean "controllers/python/doubler\.py"',
    ):
        build([Path("controllers/python/doubbler.py")], root)


def test_two_sources_of_one_fmu_are_refused(root):
    write(root, {"controllers/modelica/Raft.mo": "model Raft end Raft;"})
    with pytest.raises(InputError, match=r'has the same FMU name "raft\.fmu" as .*; rename one'):
        find_sources(root)


@pytest.mark.parametrize(
    "folder", ["plant_src/vehicles/raft", "plant_src/replica/forces/sail", "plant_src/wind"]
)
def test_equations_are_found_anywhere_in_the_plant_and_named_by_their_folder(tmp_path, folder):
    (source,) = find_sources(
        write(tmp_path, {f"{folder}/equations.py": EQUATIONS, "elsewhere/equations.py": EQUATIONS})
    )
    assert (source.manifest_key, source.kind.name) == (folder.split("/")[-1], "equations")


def test_a_fresh_build_passes_the_check(built_once):
    assert check_fmus(built_once) == []


@pytest.mark.usefixtures("forked")
def test_the_check_finds_a_changed_source(root):
    write(
        root,
        {
            f"{VEHICLE}/parameters.py": "GAIN = 1.0  # a remark\n",
            "controllers/python/doubler.py": CLASS + "\n",
        },
    )
    assert sorted(messages(root)) == [
        (
            'controllers/python/doubler.py: changed since "python/doubler" was built; run `cosim '
            "build`"
        ),
        f'{VEHICLE}/parameters.py: changed since "raft" was built; run `cosim build`',
    ]


def test_the_check_finds_a_missing_and_a_foreign_fmu(root):
    (root / "fmus/fmi3/raft.fmu").unlink()
    shutil.copy(root / "fmus/raft.fmu", root / "fmus/python/doubler.fmu")
    assert sorted(messages(root)) == [
        "fmus/fmi3/raft.fmu: is missing; run `cosim build`",
        "fmus/python/doubler.fmu: is not the file that `cosim build` wrote",
    ]


def test_the_check_finds_an_fmu_without_source_and_a_source_without_fmu(root):
    (root / f"{VEHICLE}/equations.py").unlink()
    (root / "controllers/python/doubler.py").rename(root / "controllers/python/twice.py")
    assert sorted(messages(root)) == [
        "controllers/python/twice.py: has no FMU; run `cosim build`",
        "fmus/fmi3/raft.fmu: has no source",
        "fmus/python/doubler.fmu: has no source",
        "fmus/raft.fmu: has no source",
    ]


@pytest.mark.usefixtures("forked")
def test_the_check_finds_changed_behaviour_despite_equal_hashes(root):
    """model.c is not listed as a source here, so that only a simulation of both FMUs shows the
    difference.
    """
    write(
        root,
        {
            f"{VEHICLE}/model.c": MODEL.replace(
                "m->x * h", "m->x * h * (m->gain == 1.0 ? 1.0 : 1.000001)"
            )
        },
    )
    found = messages(root)
    assert [text.split(": ")[0] for text in found] == ["fmus/raft.fmu", "fmus/fmi3/raft.fmu"]
    assert all('differs from a rebuild: output "y" differs at t = ' in text for text in found)


@pytest.mark.usefixtures("forked")
def test_the_check_tolerates_rounding(root):
    write(root, {f"{VEHICLE}/model.c": MODEL.replace("m->x * h", "m->x * (h * (1 + 1e-13))")})
    assert messages(root) == []


@pytest.mark.usefixtures("forked")
def test_the_check_finds_changed_variables(root):
    equations = EQUATIONS.replace('"continuous", 0.0', '"continuous", 0.5')
    write(root, {f"{VEHICLE}/equations.py": equations})
    manifest = read_manifest(root)
    manifest["raft"]["sources"][f"{VEHICLE}/equations.py"] = sha256(equations.encode()).hexdigest()
    (root / "fmus/manifest.json").write_text(json.dumps(manifest))
    assert (
        messages(root)[0]
        == 'fmus/raft.fmu: differs from a rebuild: variable "x" has start 0.0 and 0.5'
    )


def test_the_check_reports_an_fmu_that_crashes(root):
    write(root, {f"{VEHICLE}/model.c": MODEL.replace("m->y +=", "if (t > 1) abort(); m->y +=")})
    assert any(
        "fmus/raft.fmu: differs from a rebuild: the process that simulates the FMUs crashed" in text
        for text in messages(root)
    )


@pytest.mark.usefixtures("forked")
def test_the_check_reports_a_source_that_can_no_longer_be_built(root):
    write(root, {f"{VEHICLE}/model.c": MODEL.replace("m->gain * m->x", "m->gian")})
    (message,) = messages(root)
    place = f"{VEHICLE}/equations.py: can no longer be built: raft: model.c:"
    assert re.match(rf"{re.escape(place)}\d+:", message)


def test_a_damaged_manifest_is_refused(root):
    (root / "fmus/manifest.json").write_text("{")
    with pytest.raises(InputError, match=r"manifest\.json: is not valid JSON"):
        check_fmus(root)


def test_a_single_file_is_built_to_any_target(tmp_path):
    source = write(tmp_path, {"doubler.py": CLASS}) / "doubler.py"
    fmu = build_to(source, None, tmp_path / "elsewhere/d.fmu")
    assert (
        simulate_fmu(str(fmu), stop_time=0.1, output_interval=0.1, start_values={"x": 4.0})["y"][-1]
        == 8.0
    )


def test_python_classes_support_fmi2_only(tmp_path):
    source = write(tmp_path, {"doubler.py": CLASS}) / "doubler.py"
    with pytest.raises(
        InputError, match=r"doubler\.py: a PythonFMU class cannot be exported as FMI 3\.0"
    ):
        build_to(source, None, tmp_path / "d.fmu", fmi_version=3)


def test_other_files_are_refused():
    with pytest.raises(
        InputError, match=r"controller\.slx: cannot be exported; expected a \.mo or \.py file"
    ):
        classify_source(Path("controller.slx"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def block(:", r'"equations\.py" cannot be imported: SyntaxError'),
        ("def block():\n    return 1 / 0", r"equations\.py: block\(\) failed: ZeroDivisionError"),
        ("def blocks(): ...", r'"equations\.py" defines no "block"; did you mean "blocks"'),
    ],
)
def test_faulty_equations_are_refused(tmp_path, text, message):
    source = write(tmp_path, {"raft/equations.py": text}) / "raft/equations.py"
    with pytest.raises(InputError, match=message):
        build_to(source, None, tmp_path / "raft.fmu")


def test_a_missing_extra_is_named():
    with pytest.raises(
        InputError, match=r'exporting needs "no-such-tool".*pip install "fmi-cosim\[build\]"'
    ):
        tool_version("no-such-tool")


@pytest.mark.parametrize(
    ("model", "name"),
    [
        ("StriderAutopilot", "strider_autopilot"),
        ("ArDroneCascaded", "ar_drone_cascaded"),
        ("PIDLoop", "pid_loop"),
        ("Vtol", "vtol"),
    ],
)
def test_fmu_names_are_in_snake_case(model, name):
    assert snake_case(model) == name


def test_a_cached_fmu_is_built_once(tmp_path, cache):
    source = write(tmp_path, {"models/SampledPi.mo": MODELICA}) / "models/SampledPi.mo"
    fmu = cached_fmu(source, "SampledPi")
    written = fmu.stat().st_mtime_ns
    assert fmu.is_relative_to(cache)
    assert fmu.name == "sampled_pi.fmu"
    assert validate_fmu(str(fmu)) == []
    assert cached_fmu(source, "SampledPi") == fmu
    assert fmu.stat().st_mtime_ns == written
    assert (
        simulate_fmu(str(fmu), stop_time=0.01, output_interval=0.01, start_values={"e": 0.25})["u"][
            -1
        ]
        == 0.25 * 2 + 0.01 * 0.5 * 0.25
    )


@pytest.mark.usefixtures("cache")
def test_a_cached_fmu_is_rebuilt_when_its_source_changes(tmp_path):
    source = write(tmp_path, {"models/SampledPi.mo": MODELICA}) / "models/SampledPi.mo"
    before = cached_fmu(source, "SampledPi")
    source.write_text(MODELICA.replace("kp = 2.0", "kp = 3.0"))
    after = cached_fmu(source, "SampledPi")
    assert after != before
    assert (
        simulate_fmu(
            str(after), stop_time=0.01, output_interval=0.01, start_values={"e": 0.25, "ki": 0.0}
        )["u"][-1]
        == 0.75
    )
