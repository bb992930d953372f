"""The swap: an FMU with exactly the variables of the role flies demo1_box in the place of the
shipped controller.
"""

import json
from itertools import chain
from pathlib import Path

import pytest
from cosim_command import run_cosim

from cosim.components.fmi import FmuFile
from cosim.core import resources

SOURCE = Path(__file__).parents[1] / "support/role_controller.py"
MODELICA = resources.root() / "controllers/modelica"
COMMANDS = {"altitude_command": 2.0, "yaw_command": 0.0}
#: outputs of the shipped controller that the role does not have
EXTRA_OUTPUTS = (
    "Real altitude_reference",
    "Fleet.FlightMode mode",
    "Boolean motors_on",
    "Real horizontal_error",
    "Integer aborts",
)


def fly(fmu, folder, *options):
    """Run demo1_box with an FMU in the folder in place of its controller; the path starts from the
    working directory.
    """
    component = json.dumps({"fmu": fmu.name, "parameters": COMMANDS})
    return run_cosim(
        "run", "demo1_box", "--set", f"/components/uav={component}", *options, cwd=folder
    )


def outputs(fmu):
    variables = FmuFile(fmu).description.variables
    names = [variable.scalar_names for variable in variables if variable.causality == "output"]
    return [*chain.from_iterable(names)]


def assert_flies(done):
    assert done.returncode == 0, done.stdout + done.stderr
    (line,) = (line.partition(": ")[2] for line in done.stderr.splitlines() if "left out" in line)
    assert line == (
        '$.kpis[2].arguments.mode: KPI "descent" is left out: no signal "uav.mode" is recorded; '
        'figure "landing" is left out: no signal "uav.altitude_reference" is recorded'
    )


def test_a_python_fmu_with_the_variables_of_the_role_flies_demo1_box(tmp_path):
    fmu = tmp_path / "role_controller.fmu"
    assert run_cosim("build", str(SOURCE), "--output", str(fmu), cwd=tmp_path).returncode == 0
    assert outputs(fmu) == [f"rotor_speed[{i}]" for i in range(1, 5)]
    assert_flies(fly(fmu, tmp_path))
    assert (tmp_path / "runs/demo1_box/paths.png").is_file()
    assert not (tmp_path / "runs/demo1_box/landing.png").exists()
    for command in ("report", "plot"):
        assert run_cosim(command, "runs/demo1_box", cwd=tmp_path).returncode == 0


def test_a_check_of_a_kpi_that_is_left_out_is_not_met(tmp_path):
    component = json.dumps({"python": f"{SOURCE}:RoleController", "parameters": COMMANDS})
    check = '/checks=[{"kpi": "descent.aborts", "max": 0}]'
    options = (
        "--set",
        f"/components/uav={component}",
        "--set",
        check,
        "--stop-time",
        "1",
        "--no-report",
    )
    done = run_cosim("run", "demo1_box", *options, cwd=tmp_path)
    assert done.returncode == 3, done.stdout + done.stderr
    (line,) = (line for line in done.stdout.splitlines() if line.startswith("descent.aborts"))
    assert line.split() == ["descent.aborts", "-", "max", "0.0", "✗", "failed"]


@pytest.mark.long
def test_a_modelica_fmu_with_the_variables_of_the_role_flies_demo1_box(tmp_path):
    (tmp_path / "Fleet").symlink_to(MODELICA / "Fleet")
    text = (MODELICA / "ArDroneCascaded.mo").read_text().replace("ArDroneCascaded", "RoleOnly")
    for declaration in EXTRA_OUTPUTS:
        assert f"output {declaration}" in text
        text = text.replace(f"output {declaration}", declaration)
    (tmp_path / "RoleOnly.mo").write_text(text)
    fmu = tmp_path / "role_only.fmu"
    done = run_cosim("build", "RoleOnly.mo", "--output", str(fmu), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert outputs(fmu) == [f"rotor_speed[{i}]" for i in range(1, 5)]
    assert_flies(fly(fmu, tmp_path, "--no-report"))
