"""A refused command (exit code 2) leaves the file system as it was."""

from __future__ import annotations

import json
import socket
from pathlib import Path

import pytest
from cosim_command import run_cosim

from cosim.core import resources

FMU = resources.root() / "fmus" / "acceleration_controller.fmu"


def component(parameters: object = None) -> dict[str, object]:
    return {"fmu": str(FMU), "parameters": parameters or {}}


def scenario(**changes: object) -> dict[str, object]:
    times = {"stop_time": 0.1, "step_size": 0.01}
    return {"name": "plain", **times, "components": {"pilot": component()}, **changes}


def kpi(function: str, **arguments: object) -> dict[str, object]:
    return {"name": "k", "python": f"cosim:cosim/kpis.py:{function}", "arguments": arguments}


def study(**changes: object) -> dict[str, object]:
    return {"name": "study", "scenario": "plain.json", **changes}


def factor(name: str) -> dict[str, object]:
    return {"name": "f", "set": name, "values": [1.0, 2.0]}


def parameter(name: str) -> dict[str, object]:
    return {"name": "p", "set": name, "min": 0.0, "max": 1.0}


FILES = {
    "plain.json": scenario(),
    "figure.json": scenario(
        figures=[{"name": "picture", "python": "cosim:plant_src/figures.py:path"}]
    ),
    "unknown_variable.json": scenario(components={"pilot": component({"no": 1.0})}),
    "unknown_kpi.json": scenario(kpis=[kpi("no")]),
    "unknown_signal.json": scenario(kpis=[kpi("final", signal="pilot.no")]),
    "unknown_check.json": scenario(
        kpis=[kpi("final", signal="pilot.no")], checks=[{"kpi": "no", "min": 0.0}]
    ),
    "unknown_figure.json": scenario(figures=[{"name": "f", "python": "no.py:f"}]),
    "no_fmu.json": scenario(components={"pilot": {"fmu": "no.fmu"}}),
    "unknown_base.json": {"extends": "demo1_bax", "name": "unknown_base"},
    "sweep.json": study(factors=[factor("pilot.no")]),
    "sweep_criteria.json": study(
        factors=[factor("/stop_time")], success=[{"kpi": "no", "min": 0.0}]
    ),
    "sweep_syntax.json": study(factors=[]),
    "tune.json": study(
        minimize="no", parameters=[parameter("pilot.no")], method={"kind": "nelder_mead"}
    ),
    "worst.json": study(parameters=[parameter("pilot.no")], method={"kind": "powell"}),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("refused")
    for name, content in FILES.items():
        (folder / name).write_text(json.dumps(content))
    (folder / "existing").mkdir()
    (folder / "existing" / "result.csv").write_text("of an earlier run")
    trials = folder / "existing" / "usv_heading" / "heading_controller" / "scenarios"
    trials.mkdir(parents=True)
    (trials / "plain.json").write_text("of an earlier benchmark")
    (folder / "file").write_text("no folder")
    (folder / "blocked" / "run.json").mkdir(parents=True)
    (folder / "blocked" / "result.csv").write_text("of an earlier run")
    (folder / "init").mkdir()
    (folder / "init" / "README.md").write_text("of another project")
    (folder / "broken.py").write_text("class A: pass\n")
    with socket.socket(socket.AF_UNIX) as connection:
        connection.bind(str(folder / "socket"))
    return folder


def snapshot(folder: Path) -> dict[str, object]:
    """Return size, kind and time of the last change of everything in a folder."""
    entries: dict[str, object] = {}
    for path in sorted(folder.rglob("*")):
        about = path.lstat()
        entries[path.relative_to(folder).as_posix()] = (about.st_mode, about.st_size)
        if not path.is_dir():
            entries[path.relative_to(folder).as_posix()] = about.st_mtime_ns, about.st_ino
    return entries


REFUSED = """
run unknown_variable.json
run unknown_variable.json --output-dir existing
run unknown_variable.json --output-dir new/deep
run unknown_kpi.json
run unknown_signal.json
run unknown_signal.json --output-dir existing
run unknown_check.json
run unknown_figure.json
run unknown_figure.json --output-dir existing
run plain.json --output-dir blocked
run figure.json --output-dir blocked
run no_fmu.json
run no.json
run plain.json --set pilot.no=1
run plain.json --stop-time x
run plain.json --output-dir file
run plain.json --output-dir file/new
run plain.json --output-dir socket
simulate FMU --output-file new/result.csv --start-value no=1
simulate FMU --output-file existing/result.csv --start-value no=1
simulate FMU --output-file new/result.csv --stop-time x
simulate FMU --output-file existing
simulate FMU --output-file socket
simulate FMU --output-file file/result.csv
simulate no.fmu --output-file new/result.csv
sweep sweep.json
sweep sweep.json --output-dir existing
sweep sweep.json --output-dir new/deep
sweep sweep_criteria.json
sweep sweep_syntax.json
sweep sweep.json --output-dir socket
tune tune.json
tune tune.json --output-dir existing
tune worst.json --worst
tune tune.json --worst
regress unknown_check.json
regress unknown_check.json --output-dir existing
regress plain.json
regress no.json
regress plain.json --junit socket
regress plain.json --junit existing
regress plain.json --output-dir socket
bench-controller broken.py:A --role uav_altitude --scenarios plain.json
bench-controller FMU --role uav_altitude --scenarios plain.json
bench-controller FMU --role uav_position --scenarios plain.json
bench-controller FMU --role uav_position --set no=1 --scenarios plain.json
bench-controller HEADING --role usv_heading --scenarios plain.json --output-dir existing
bench-controller FMU --role no
linearize plain.json --inputs pilot.no --outputs pilot.x --output new/model.json
linearize plain.json INPUTS --output new/model.json --output model.txt
linearize plain.json INPUTS --output new/model.txt
linearize no.json --inputs a.b --outputs a.c --figures new
margins plain.json --component no --figures new
margins no.json --component pilot
trim plain.json --free pilot.no --steady pilot.x --output new/trimmed.json
trim no.json --free a.b --steady a.c --output new/trimmed.json
build no.py --output new/a.fmu
build broken.py --output new/a.fmu
build broken.py --output new/a.zip
new controller 1x --language python --role vessel_autopilot --directory new
new scenario copy --from unknown_base.json --directory new
new scenario copy --from no --directory new
new scenario plain --from demo1_box
new vehicle 1x --from otter --directory new
new vehicle copy --from no --directory new
init file
init init
plot existing --output-dir new
report existing --output-file new/report.html
replay existing --output-file new/replay.html
compare existing/result.csv no.csv --plot new/a.png
recover existing
""".strip().splitlines()


@pytest.mark.parametrize("words", REFUSED)
def test_a_refused_command_leaves_nothing_behind(folder: Path, words: str) -> None:
    before = snapshot(folder)
    inputs = "--inputs pilot.vehicle.position.x --outputs pilot.acceleration_command.x"
    done = run_cosim(*words.replace("FMU", str(FMU)).replace("INPUTS", inputs).split(), cwd=folder)
    assert done.returncode == 2, done.stdout + done.stderr
    assert snapshot(folder) == before, done.stderr
