"""Scenarios whose FMUs are in processes of their own give the same results, bit for bit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from zipfile import ZipFile

import fmpy
import numpy as np
import pytest
from probe_fmus import HEADERS, PROBE_SOURCES

import cosim
from cosim import api, cli
from cosim.components.fmi.isolated.isolated_fmu import IsolatedFmu
from cosim.core.errors import InputError
from cosim.process.sandbox import find_available_sandboxes, landlock
from cosim.scenario import prepare

FMUS = Path(__file__).parents[4] / "fmus"


def test_demo_1_is_the_same_bit_for_bit():
    here, apart = (cosim.run("demo1_box", stop_time=8, isolation=isolation) for isolation in ("none", "fmu"))
    assert len(here.time) == 801
    assert {name: here[name].tobytes() for name in here} == {name: apart[name].tobytes() for name in apart}


def scenario(folder: Path, components: dict[str, object], **more: object) -> Path:
    content = {"name": "apart", "stop_time": 0.1, "step_size": 0.01, "components": components, **more}
    path = folder / "apart.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.skipif(find_available_sandboxes().landlock < landlock.NETWORK_ABI, reason="this kernel has no sandbox (Linux 6.7)")
@pytest.mark.parametrize("name", ["python/vtol.fmu", "c/speed_keeper.fmu", "strider.fmu", "fmi3/ar_drone.fmu"])
def test_shipped_fmus_in_a_sandbox_are_the_same_bit_for_bit(name, tmp_path):
    file = scenario(tmp_path, {"a": {"fmu": str(FMUS / name)}})
    here, apart = (cosim.run(file, sandbox=sandbox) for sandbox in (False, True))
    assert {name: here[name].tobytes() for name in here} == {name: apart[name].tobytes() for name in apart} != {}


def apart(assembly: api.PreparedRun) -> list[str]:
    """Names of components in processes of their own."""
    assembly.free()
    return [name for name, component in assembly.system.components.items() if isinstance(component, IsolatedFmu)]


def test_one_component_asks_for_it(probe, tmp_path):
    file = scenario(tmp_path, {"a": {"fmu": str(probe), "isolation": "fmu"}, "b": {"fmu": str(probe)}})
    assert apart(prepare(file)) == ["a"]


@pytest.mark.parametrize("how", [{"isolation": "fmu"}, {"sandbox": True}])
def test_all_are_told_from_outside(probe, tmp_path, how):
    file = scenario(tmp_path, {"a": {"fmu": str(probe)}, "b": {"fmu": str(probe)}})
    assert apart(api.load(file, **how)) == ["a", "b"]
    assert apart(api.load(file)) == []


@pytest.mark.parametrize(
    ("words", "where"),
    [
        ([], ["supervised process: b", "a: its own process"]),
        (["--isolation", "none"], ["process of the command: b", "a: its own process"]),
        (["--sandbox"], ["a: its own process, in a sandbox", "b: its own process, in a sandbox"]),
        (["--sandbox", "strict"], ["processes, all in bubblewrap", "b: its own process, in a sandbox"]),
    ],
)
def test_check_says_what_runs_where(probe, tmp_path, words, where, capsys):
    file = scenario(tmp_path, {"a": {"fmu": str(probe), "isolation": "fmu"}, "b": {"fmu": str(probe)}})
    assert cli._run_command_line(["check", str(file), *words]) == 0
    shown = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert set(where) < set(shown)


def test_only_fmus_can_be_apart(tmp_path):
    (tmp_path / "own.py").write_text("")
    file = scenario(tmp_path, {"a": {"python": "own.py:Own", "isolation": "fmu"}})
    with pytest.raises(InputError, match='"isolation" is for components with "fmu" or "modelica"'):
        prepare(file)


def test_another_isolation_is_refused_in_words(probe, tmp_path):
    file = scenario(tmp_path, {"a": {"fmu": str(probe), "isolation": "own"}})
    with pytest.raises(InputError, match="isolation"):
        prepare(file)


@pytest.fixture
def jealous(tmp_path):
    """The foreign FMU as one that allows a single instance per process, and means it."""
    source = (PROBE_SOURCES / "probe2.c").read_text()
    guard = "    static int instances;\n    if (instances++) return NULL;\n"
    changed = source.replace("    Probe *m = calloc", f"{guard}    Probe *m = calloc", 1)
    assert guard in changed
    (tmp_path / "jealous.c").write_text(changed)
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library, target = tmp_path / "probe.so", tmp_path / "jealous.fmu"
    subprocess.run([compiler, "-shared", "-fPIC", f"-I{HEADERS}", tmp_path / "jealous.c", "-o", library], check=True)
    text = (PROBE_SOURCES / "probe2.xml").read_text()
    with ZipFile(target, "w") as archive:
        mark = 'canBeInstantiatedOnlyOncePerProcess="true" modelIdentifier'
        archive.writestr("modelDescription.xml", text.replace("modelIdentifier", mark, 1))
        archive.write(library, f"binaries/{fmpy.platform}/probe.so")
    return target


def test_an_fmu_that_allows_one_instance_per_process_is_used_twice(jealous, tmp_path):
    components = {name: {"fmu": str(jealous)} for name in ("a", "b", "c")}
    wires = [{"from": "a.y", "to": "b.u"}, {"from": "b.y", "to": "c.u"}, {"from": "c.y", "to": "a.u"}]
    file = scenario(tmp_path, components, connections=wires)
    assert apart(prepare(file)) == ["b", "c"]
    result = cosim.run(file)
    assert all(np.array_equal(result[f"{name}.y"], np.ones(11)) for name in components)
