"""Command line in real processes: exit codes and printed text."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cosim_command import run_cosim
from probe_fmus import build_probe_fmu

from cosim.core import resources

ROOT = Path(__file__).parents[2]
BLOCKS = ROOT / "tests/scenario/pythonfmu_blocks.py"


def cosim(*arguments, cwd=None, **more):
    return run_cosim(*arguments, cwd=cwd, **more)


def scenario(folder, block="Gain", **more):
    content = {
        "name": "small",
        "stop_time": 3,
        "step_size": 1,
        "components": {"a": {"python": f"{BLOCKS}:{block}"}},
        **more,
    }
    path = folder / "small.json"
    path.write_text(json.dumps(content))
    return path


OWN_CONTROLLER = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Own(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.yaw = 0.0
        self.register_variable(Real("yaw", causality=Fmi2Causality.input))

    def do_step(self, current_time, step_size):
        return True
"""


def test_help_names_every_command():
    done = cosim("--help")
    assert done.returncode == 0
    for command in ("run", "check", "simulate", "info", "build", "schema"):
        assert f"  {command} " in done.stdout
        assert cosim(command, "--help").returncode == 0


def test_a_traceback_is_printed_only_with_debug():
    plain, debugged = cosim("run", "nowhere"), cosim("--debug", "run", "nowhere")
    assert plain.returncode == debugged.returncode == 2
    assert "Traceback" not in plain.stderr
    assert "Traceback" in debugged.stderr
    assert debugged.stderr.splitlines()[-1] == plain.stderr.strip()


def test_run_writes_results_that_can_be_read_back(tmp_path):
    done = cosim("run", scenario(tmp_path), "--set", "a.u=1.5", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "3 s simulated" in done.stdout
    lines = (tmp_path / "runs/small/result.csv").read_text().splitlines()
    assert lines == ['"time","a.y"', "0.0,0.0", "1.0,3.0", "2.0,3.0", "3.0,3.0"]
    run = json.loads((tmp_path / "runs/small/run.json").read_text())
    assert run["scenario"]["name"] == "small"
    assert run["failure"] is None
    assert run["timing"]["loop_seconds"] > 0
    assert run["versions"]["numpy"]
    assert json.loads((tmp_path / "runs/small/kpis.json").read_text()) == {}


def test_options_change_the_output_folder_and_the_times(tmp_path):
    done = cosim(
        "run",
        scenario(tmp_path),
        "--output-dir",
        "there",
        "--stop-time",
        "1",
        "--step-size",
        "1/4",
        cwd=tmp_path,
    )
    assert done.returncode == 0
    assert len((tmp_path / "there/result.csv").read_text().splitlines()) == 6


KPIS = """
def last(result, signal):
    return {"value": float(result[signal][-1])}
"""


def test_checks_decide_the_exit_code(tmp_path):
    (tmp_path / "kpis.py").write_text(KPIS)
    more = {"kpis": [{"name": "end", "python": "kpis.py:last", "arguments": {"signal": "a.y"}}]}
    file = scenario(tmp_path, **more, checks=[{"kpi": "end.value", "max": 1}])
    good = cosim("run", file, cwd=tmp_path)
    assert good.returncode == 0
    bad = cosim("run", file, "--set", "a.u=5", cwd=tmp_path)
    assert bad.returncode == 3
    assert "end.value" in bad.stdout
    assert "max 1.0" in bad.stdout
    assert json.loads((tmp_path / "runs/small/kpis.json").read_text()) == {"end.value": 10.0}


@pytest.mark.parametrize("isolation", ["run", "none"])
def test_a_closed_pipe_does_not_end_the_run(tmp_path, isolation):
    """The reader closes the pipe as `| head` does: all results are written, and the exit code is
    that of a failed check.
    """
    (tmp_path / "kpis.py").write_text(KPIS)
    kpi = {"name": "end", "python": "kpis.py:last", "arguments": {"signal": "a.y"}}
    file = scenario(tmp_path, kpis=[kpi], checks=[{"kpi": "end.value", "min": 1}])
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "cosim", "run", file, "--isolation", isolation]
    done = subprocess.run(
        command, cwd=tmp_path, stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (3, "")
    assert (tmp_path / "runs/small/report.html").exists()


def test_a_failing_component_gives_exit_code_1_and_keeps_the_rows(tmp_path):
    done = cosim("run", scenario(tmp_path, "FailingBlock"), cwd=tmp_path)
    assert done.returncode == 1
    assert "INFO a: about to fail" in done.stderr
    assert "a: do_step failed at t = 2 s: ValueError: tilt beyond limit" in done.stderr
    assert "Traceback" not in done.stderr
    assert len((tmp_path / "runs/small/result.csv").read_text().splitlines()) == 4
    assert (
        "tilt beyond limit" in json.loads((tmp_path / "runs/small/run.json").read_text())["failure"]
    )


def test_a_failing_kpi_keeps_the_result_and_the_other_kpis(tmp_path):
    (tmp_path / "kpis.py").write_text(KPIS)
    kpi = {"name": "end", "python": "kpis.py:last", "arguments": {"signal": "a.z"}}
    done = cosim("run", scenario(tmp_path, kpis=[kpi]), cwd=tmp_path)
    assert done.returncode == 2
    assert '$.kpis[0]: KPI "end": no signal "a.z" was recorded; did you mean "a.y"?' in done.stderr
    assert len((tmp_path / "runs/small/result.csv").read_text().splitlines()) == 5


FREED = """
from pathlib import Path

from cosim.core import resources
from cosim.core.component import Component
from cosim.core.errors import ComponentError


class Once(Component):
    binds_everything = has_state = False
    variables = ()

    def __init__(self, instance_name): ...
    def enter_initialization_mode(self, start_time, stop_time): ...
    def exit_initialization_mode(self): ...
    def bind(self, inputs, outputs): ...
    def set_inputs(self): ...
    def get_outputs(self): ...
    def set(self, name, value): ...
    def get(self, name): ...
    def get_state(self): ...
    def set_state(self, state): ...
    def free_state(self, state): ...
    def terminate(self): ...

    def do_step(self, time, step_size):
        raise ComponentError("a", "do_step", "no more", time)

    def free(self):
        with Path("freed").open("a") as file:
            file.write("x")
"""


@pytest.mark.parametrize("output", ["out", "once.py/out"], ids=["failing", "unwritable"])
def test_components_are_freed_exactly_once(tmp_path, output):
    (tmp_path / "once.py").write_text(FREED)
    file = scenario(tmp_path, components={"a": {"python": "once.py:Once"}}, record={"signals": []})
    done = cosim("run", file, "--output-dir", output, cwd=tmp_path)
    assert done.returncode == (1 if output == "out" else 2), done.stderr
    assert (tmp_path / "freed").read_text() == "x"


def test_a_refused_scenario_gives_exit_code_2_and_one_line_per_problem(tmp_path):
    done = cosim("run", scenario(tmp_path, colour="red", stop_time=-1), cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 2
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["run"],
        ["fly"],
        ["run", "x.json", "--sett", "a=1"],
        ["run", "x.json", "--set", "a"],
        ["run", "x.json", "--set", "a=NaN"],
    ],
)
def test_wrong_usage_gives_exit_code_2(arguments, tmp_path):
    done = cosim(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_an_unknown_command_is_refused_with_the_nearest_one(tmp_path):
    assert "No such command 'rnu'; did you mean \"run\"?" in cosim("rnu", cwd=tmp_path).stderr


def test_a_signal_with_a_unit_into_an_input_without_is_marked(tmp_path):
    (tmp_path / "own.py").write_text(OWN_CONTROLLER)
    components = {"own": {"python": "own.py:Own"}, "ship": {"fmu": str(ROOT / "fmus/strider.fmu")}}
    file = scenario(
        tmp_path,
        components=components,
        connections=[{"from": "ship.attitude.yaw", "to": "own.yaw"}],
    )
    assert (
        "ship.attitude.yaw -> own.yaw  (rad, the input has no unit)" in cosim("check", file).stdout
    )
    (tmp_path / "own.py").write_text(OWN_CONTROLLER.replace("self.yaw = 0.0", "pass"))
    done = cosim("run", file, cwd=tmp_path)
    assert 'the variable "yaw" is registered, but has no value: ' in done.stderr


def test_a_check_of_an_unknown_kpi_value_is_reported_with_its_position(tmp_path):
    """The values of this KPI are unknown before the run."""
    (tmp_path / "kpis.py").write_text(
        "def last(result):\n    values = {'value': 1.0}\n    return values\n"
    )
    file = scenario(
        tmp_path,
        kpis=[{"name": "end", "python": "kpis.py:last"}],
        checks=[{"kpi": "end.valu", "max": 1}],
    )
    done = cosim("run", file, cwd=tmp_path)
    assert done.returncode == 2
    assert '$.checks[0]: check of "end.valu": no such KPI; did you mean "end.value"?' in done.stderr


def test_a_figure_of_unrecorded_signals_is_refused_only_with_a_report(tmp_path):
    """A run without figures may record fewer signals, as those of sweeps do."""
    figure = {
        "name": "f",
        "python": str(ROOT / "plant_src/figures.py:paths"),
        "arguments": {"vehicle": "a.y", "deck": "b"},
    }
    file = scenario(tmp_path, figures=[figure])
    for command in ("check", "run"):
        done = cosim(command, file, cwd=tmp_path)
        assert done.returncode == 2
        assert [line.split("$.figures[0].arguments.")[1] for line in done.stderr.splitlines()] == [
            (
                'vehicle: no signal below "a.y" is recorded; valid: a (inputs are recorded if '
                '"record" names them)'
            ),
            'deck: no signal below "b" is recorded: the scenario has no component "b"; valid: a',
        ]
    assert cosim("run", file, "--no-report", cwd=tmp_path).returncode == 0


def test_check_and_run_warn_about_a_forgotten_connection(tmp_path):
    pilot = {"python": f"{BLOCKS}:Controller", "parameters": {"offset": 0.0}}
    components = {"plant": {"python": f"{BLOCKS}:Plant"}, "pilot": pilot}
    file = scenario(
        tmp_path, components=components, connections=[{"from": "plant.ship", "to": "pilot.vehicle"}]
    )
    checked, ran = cosim("check", file), cosim("run", file, cwd=tmp_path)
    for done in (checked, ran):
        assert done.returncode == 0
        (warning,) = done.stderr.splitlines()
        assert warning.startswith(f"WARNING {file}:1:")
        assert (
            "plant.ship.motor[2]: is a connection from pilot.motor to plant.ship.motor missing?"
            in warning
        )
    assert "1 warning." in checked.stdout
    assert "No warnings" not in checked.stdout
    assert warning in json.loads((tmp_path / "runs/small/run.json").read_text())["warnings"]


def test_check_prints_the_expanded_system(tmp_path):
    components = {"a": {"python": f"{BLOCKS}:Gain"}, "b": {"python": f"{BLOCKS}:Gain", "period": 3}}
    wires = [{"from": "a.y", "to": "b.u", "delay": 2}]
    done = cosim("check", scenario(tmp_path, components=components, connections=wires))
    assert done.returncode == 0, done.stderr
    assert "a.y -> b.u  (delay 2)" in done.stdout
    assert "1. a" in done.stdout
    assert "every 3 s" in done.stdout
    assert "inputs of a that nothing feeds; they keep their start values\n  0: u\n" in done.stdout


def test_simulate_runs_one_fmu(probe, tmp_path):
    done = cosim(
        "simulate",
        probe,
        "--output-file",
        tmp_path / "y.csv",
        "--start-value",
        "y_start=2",
        "--stop-time",
        "0.02",
    )
    assert done.returncode == 0, done.stderr
    header, *rows = (tmp_path / "y.csv").read_text().splitlines()
    y = header.split(",").index('"y"')
    assert [float(row.split(",")[y]) for row in rows] == [
        2.0,
        2.0 * 0.98,
        pytest.approx(2.0 * 0.98**2),
    ]


def test_simulate_reads_inputs_from_a_file(probe, tmp_path):
    (tmp_path / "u.csv").write_text("time,u\n0,5\n1,5\n")
    done = cosim("simulate", probe, "--input-file", tmp_path / "u.csv", "--stop-time", "0.01")
    assert done.returncode == 0, done.stderr
    assert "y = 1.08 m" in done.stdout


def test_simulate_refuses_unknown_names(probe, tmp_path):
    (tmp_path / "u.csv").write_text("time,uu\n0,5\n")
    done = cosim("simulate", probe, "--input-file", tmp_path / "u.csv")
    assert (done.returncode, 'the FMU has no input "uu"; did you mean "u"?' in done.stderr) == (
        2,
        True,
    )
    done = cosim("simulate", probe, "--start-value", "y_strt=1")
    assert (done.returncode, 'did you mean "y_start"?' in done.stderr) == (2, True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"time,u\n0," + b"1" * (1 << 21),
            "u.csv:2: cannot read the row: field larger than field limit (1048576)",
        ),
        (b"time,\xe9\n0,1\n", "u.csv: it is not UTF-8 text"),
        (b"", "u.csv: the file is empty, expected a header"),
        (None, "u.csv: No such file or directory"),
    ],
)
def test_simulate_refuses_an_unreadable_input_file(probe, tmp_path, content, message):
    if content is not None:
        (tmp_path / "u.csv").write_bytes(content)
    done = cosim("simulate", probe, "--input-file", tmp_path / "u.csv")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert message in done.stderr


def test_a_failing_fmu_gives_exit_code_1_and_keeps_its_rows(probe, tmp_path):
    done = cosim(
        "simulate", probe, "--start-value", "fail_time=0.025", "--output-file", tmp_path / "y.csv"
    )
    assert done.returncode == 1
    assert "status 3 (error): told to fail" in done.stderr
    assert len((tmp_path / "y.csv").read_text().splitlines()) == 4


def test_info_prints_which_capabilities_are_used(tmp_path):
    flags = 'maxOutputDerivativeOrder="2" canRunAsynchronuously="true"'
    lines = cosim(
        "info", build_probe_fmu(2, tmp_path, name="mass", flags=flags)
    ).stdout.splitlines()
    capabilities = next(line for line in lines if line.startswith("capabilities"))
    assert "inputs can be linear within a step, derivatives of outputs" in capabilities
    assert next(line for line in lines if line.startswith("not used")).split() == [
        "not",
        "used",
        "canRunAsynchronuously",
    ]


def test_info_names_the_source_of_an_fmu():
    """The FMU of a Modelica model has a name in lower case."""
    names = {
        "fmus/ar_drone_lqr.fmu": ("ar_drone_lqr", "ArDroneLqr.mo"),
        "fmus/python/mixer.fmu": ("Mixer", "mixer.py"),
    }
    for fmu, (model, source) in names.items():
        lines = cosim("info", resources.root() / fmu).stdout.splitlines()
        assert [line.split() for line in lines[:2]] == [["model", model], ["source", source]]
    assert "source " not in cosim("info", resources.root() / "fmus/strider.fmu").stdout


def test_info_names_the_program_that_an_fmu_needs():
    lines = cosim("info", resources.root() / "fmus/python/mixer.fmu").stdout.splitlines()
    assert "needs         Python on the host, with the packages that its class imports" in lines


def test_info_describes_python_classes_and_modelica_models(tmp_path):
    described = cosim("info", f"{BLOCKS}:Gain")
    assert described.stdout.splitlines()[0] == f"class         {BLOCKS}:Gain", described.stderr
    assert "inputs (1)" in described.stdout
    (tmp_path / "Twice.mo").write_text(
        "model Twice\n  input Real u;\n  output Real y;\nequation\n  y = 2*u;\nend Twice;"
    )
    model = cosim("info", tmp_path / "Twice.mo:Twice").stdout
    assert "model         twice" in model
    assert "inputs (1)" in model
    assert (
        cosim("info", BLOCKS).stderr
        == f"{BLOCKS}: expected the name of a class, as in {BLOCKS}:Class\n"
    )
    assert 'did you mean "Gain"?' in cosim("info", f"{BLOCKS}:Gian").stderr


def test_info_describes_a_vehicle_file(tmp_path):
    done = cosim("info", "cosim:plant_src/vehicles/data/blueboat.json")
    assert done.stderr == ""
    for line in (
        "family        surface_vessel",
        "mass          18 kg",
        "propellers    2: port, starboard",
    ):
        assert f"{line}\n" in done.stdout
    assert "hulls         2 of 1.04 x 0.12 x 0.29 m (length, beam, depth)\n" in done.stdout
    assert "draught       0.09745 m\n" in done.stdout
    assert "boxes         1.19 x 0.912 x 0.42 m" in done.stdout
    assert "\n  propeller_speed   Float64[2]   rad/s" in done.stdout
    (tmp_path / "boat.json").write_text('{"family": "surface_vessl"}')
    refused = cosim("info", tmp_path / "boat.json").stderr
    assert (
        "boat.json:1:2: $.family: found 'surface_vessl'; did you mean \"surface_vessel\"" in refused
    )
    assert (
        "is a scenario or a study, expected a vehicle file"
        in cosim("info", "cosim:scenarios/demo1_box.json").stderr
    )


def test_an_unknown_variable_of_a_component_with_many_is_refused_with_some_valid_names():
    done = cosim("run", "free_flight", "--set", "usv.kp=3")
    assert done.stderr.startswith(
        'setting "usv.kp": component "usv" has no variable "kp"; valid: speed_command, '
        "acceptance_radius"
    )
    assert " more\n" in done.stderr


def test_info_prints_properties_and_variables(probe):
    done = cosim("info", probe)
    assert done.returncode == 0
    assert "Co-Simulation" in done.stdout
    assert "y_start" in done.stdout
    assert cosim("info", "missing.fmu").returncode == 2
    named = cosim("info", "multirotor_controller").stdout
    assert named == cosim("info", "cosim:fmus/multirotor_controller.fmu").stdout
    assert "model         multirotor_controller" in named
    assert 'did you mean "multirotor_controller"?' in cosim("info", "multirotor_controler").stderr


def test_the_schema_describes_scenarios():
    printed = json.loads(cosim("schema").stdout)
    assert printed["else"] == {"$ref": "#/$defs/Scenario"}
    schema = printed["$defs"]["Scenario"]
    assert schema["additionalProperties"] is False
    assert {"name", "stop_time", "step_size", "components"} <= set(schema["required"])


SLOW = """
import time
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Slow(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        time.sleep(0.05)
        if current_time > 2:
            Path("started").touch()
        return True
"""


def test_an_interrupt_gives_exit_code_130_and_keeps_the_rows(tmp_path):
    (tmp_path / "slow.py").write_text(SLOW)
    file = scenario(tmp_path, components={"a": {"python": "slow.py:Slow"}}, stop_time=1000)
    process = subprocess.Popen(
        [sys.executable, "-m", "cosim", "run", file],
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    until = time.monotonic() + 30
    while not (tmp_path / "started").exists() and time.monotonic() < until:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "interrupted" in errors
    assert len((tmp_path / "runs/small/result.csv").read_text().splitlines()) > 2


def test_a_deeply_nested_setting_is_refused(tmp_path):
    done = cosim("run", scenario(tmp_path), "--set", f"a.k={'[' * 20_000}", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "a.k: nested too deeply\n"
