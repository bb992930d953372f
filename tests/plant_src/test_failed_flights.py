"""Flights that fail: they end soon after the crash, with exit code 3 and one line of cause."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from cosim_command import run_cosim

import cosim
from cosim.core.resources import root

FIRST_CONTROLLER = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Controller(Fmi2Slave):
    '''Takes off without attitude control, and switches the motors off after 2 s.'''

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.time = 0.0
        for number in range(1, 5):
            name, trim = f"rotor_speed[{number}]", 8.0 * (number == 2)
            speed = lambda trim=trim: 400.0 + trim if self.time < 2 else 0.0
            self.register_variable(Real(name, causality=Fmi2Causality.output, getter=speed))
        for name in ("vehicle.position.z", "target.position.z"):
            setter = lambda value: None
            self.register_variable(
                Real(
                    name,
                    causality=Fmi2Causality.input,
                    start=0.0,
                    getter=lambda: 0.0,
                    setter=setter,
                )
            )
        self.register_variable(Real("mode", causality=Fmi2Causality.output, getter=lambda: 0.0))

    def do_step(self, time, step_size):
        self.time = time + step_size
        return True
"""


@pytest.fixture
def settings(tmp_path: Path) -> dict[str, object]:
    (tmp_path / "first.py").write_text(FIRST_CONTROLLER)
    return {"/components/uav": {"python": f"{tmp_path}/first.py:Controller"}, "/figures": []}


def test_a_first_controller_that_falls_into_the_sea_ends_with_its_cause(
    tmp_path: Path, settings: dict[str, object]
) -> None:
    options = [f"--set={name}={json.dumps(value)}" for name, value in settings.items()]
    done = run_cosim("run", "demo1_box", *options, "--output-dir", "out", cwd=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "WARNING plant: t = 1.27 s: uav ditched: 0.02 m below the water\n" in done.stderr
    line = "crashed at t = 1.27 s, ended at t = 1.77 s: crash (plant.uav.ditched)"
    assert f"\n{line}\n" in done.stdout
    run = json.loads((tmp_path / "out/run.json").read_text())
    assert run["terminated_by"] == {
        "condition": "crash",
        "outcome": "crash",
        "cause": "plant.uav.ditched",
        "since": 1.27,
        "time": 1.77,
    }
    assert f"✗ {line}" in (tmp_path / "out/report.html").read_text()


def test_without_the_condition_the_quadcopter_floats_and_kpis_tell_it(
    settings: dict[str, object],
) -> None:
    kpi = {
        "name": "uav",
        "python": f"{root()}/plant_src/kpis.py:failures",
        "arguments": {"vehicle": "plant.uav"},
    }
    result = cosim.run("demo1_box", {**settings, "/stop_when": [], "/kpis": [kpi], "/checks": []})
    assert result.time[-1] == 40.0
    assert result["plant.uav.position.z"][-1] == pytest.approx(
        0.0866 * (0.5 - 0.443892 / (1025 * 7.5e-4)), abs=1e-3
    )  # afloat
    assert result.kpis == {"uav.crashed": False, "uav.ditched": True, "uav.time": 1.27}
