"""Scenarios with isolated FMUs give bit-identical results."""

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
from cosim import cli
from cosim.components.fmi.isolated import IsolatedFmu
from cosim.core.errors import InputError
from cosim.process.sandbox import find_available_sandboxes
from cosim.scenario import PreparedRun, load

FMUS = Path(__file__).parents[4] / "fmus"


def test_demo_1_is_identical_with_isolated_fmus():
    in_process, isolated = (
        cosim.run("demo1_box", stop_time=8, isolation=isolation) for isolation in ("none", "fmu")
    )
    assert len(in_process.time) == 801
    assert {name: in_process[name].tobytes() for name in in_process} == {
        name: isolated[name].tobytes() for name in isolated
    }


def scenario(folder: Path, components: dict[str, object], **more: object) -> Path:
    content = {
        "name": "isolated",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": components,
        **more,
    }
    path = folder / "isolated.json"
    path.write_text(json.dumps(content))
    return path


@pytest.mark.skipif(
    not find_available_sandboxes().confines_fmus, reason="this system cannot confine FMUs"
)
@pytest.mark.parametrize(
    "name", ["python/vtol.fmu", "c/speed_keeper.fmu", "strider.fmu", "fmi3/ar_drone.fmu"]
)
def test_shipped_fmus_give_identical_results_in_a_sandbox(name, tmp_path):
    file = scenario(tmp_path, {"a": {"fmu": str(FMUS / name)}})
    in_process, isolated = (cosim.run(file, sandbox=sandbox) for sandbox in (False, True))
    assert (
        {name: in_process[name].tobytes() for name in in_process}
        == {name: isolated[name].tobytes() for name in isolated}
        != {}
    )


def isolated_names(prepared: PreparedRun) -> list[str]:
    """Names of the isolated components."""
    prepared.free()
    return [
        name
        for name, component in prepared.system.components.items()
        if isinstance(component, IsolatedFmu)
    ]


def test_a_scenario_isolates_one_component(probe, tmp_path):
    file = scenario(
        tmp_path, {"a": {"fmu": str(probe), "isolation": "fmu"}, "b": {"fmu": str(probe)}}
    )
    assert isolated_names(load(file)) == ["a"]


@pytest.mark.parametrize("arguments", [{"isolation": "fmu"}, {"sandbox": True}])
def test_an_argument_isolates_all_components(probe, tmp_path, arguments):
    file = scenario(tmp_path, {"a": {"fmu": str(probe)}, "b": {"fmu": str(probe)}})
    assert isolated_names(load(file, **arguments)) == ["a", "b"]
    assert isolated_names(load(file)) == []


@pytest.mark.parametrize(
    ("options", "lines"),
    [
        ([], ["supervised process: b", "a: its own process"]),
        (["--isolation", "none"], ["process of the command: b", "a: its own process"]),
        (["--sandbox"], ["a: its own process, in a sandbox", "b: its own process, in a sandbox"]),
        (
            ["--sandbox", "strict"],
            ["processes, all in bubblewrap", "b: its own process, in a sandbox"],
        ),
    ],
)
def test_check_lists_the_process_of_each_component(probe, tmp_path, options, lines, capsys):
    file = scenario(
        tmp_path, {"a": {"fmu": str(probe), "isolation": "fmu"}, "b": {"fmu": str(probe)}}
    )
    assert cli.run_command_line(["check", str(file), *options]) == 0
    shown = [line.strip() for line in capsys.readouterr().out.splitlines()]
    assert set(lines) < set(shown)


def test_only_fmus_can_be_isolated(tmp_path):
    (tmp_path / "own.py").write_text("")
    file = scenario(tmp_path, {"a": {"python": "own.py:Own", "isolation": "fmu"}})
    with pytest.raises(InputError, match='"isolation" is for components with "fmu" or "modelica"'):
        load(file)


def test_an_unknown_isolation_is_refused(probe, tmp_path):
    file = scenario(tmp_path, {"a": {"fmu": str(probe), "isolation": "own"}})
    with pytest.raises(InputError, match="isolation"):
        load(file)


@pytest.fixture
def single_instance_fmu(tmp_path):
    """FMU whose binary refuses a second instance in the same process."""
    source = (PROBE_SOURCES / "probe2.c").read_text()
    guard = "    static int instances;\n    if (instances++) return NULL;\n"
    changed = source.replace("    Probe *m = calloc", f"{guard}    Probe *m = calloc", 1)
    assert guard in changed
    (tmp_path / "single_instance.c").write_text(changed)
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library, target = tmp_path / "probe.so", tmp_path / "single_instance.fmu"
    subprocess.run(
        [
            compiler,
            "-shared",
            "-fPIC",
            f"-I{HEADERS}",
            tmp_path / "single_instance.c",
            "-o",
            library,
        ],
        check=True,
    )
    text = (PROBE_SOURCES / "probe2.xml").read_text()
    with ZipFile(target, "w") as archive:
        attributes = 'canBeInstantiatedOnlyOncePerProcess="true" modelIdentifier'
        archive.writestr("modelDescription.xml", text.replace("modelIdentifier", attributes, 1))
        archive.write(library, f"binaries/{fmpy.platform}/probe.so")
    return target


def test_instances_of_a_once_per_process_fmu_are_isolated_automatically(
    single_instance_fmu, tmp_path
):
    components = {name: {"fmu": str(single_instance_fmu)} for name in ("a", "b", "c")}
    wires = [
        {"from": "a.y", "to": "b.u"},
        {"from": "b.y", "to": "c.u"},
        {"from": "c.y", "to": "a.u"},
    ]
    file = scenario(tmp_path, components, connections=wires)
    assert isolated_names(load(file)) == ["b", "c"]
    result = cosim.run(file)
    assert all(np.array_equal(result[f"{name}.y"], np.ones(11)) for name in components)
