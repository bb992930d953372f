"""Iterated systems in a child process: a crash in get_state or set_state is reported with its
component.
"""

import json

import pytest
from cosim_command import run_cosim

PARTS = '''
import os
import signal

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Half(Fmi2Slave):
    """y = 1 + u / 2"""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.u = self.y = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.y = 1 + self.u / 2
        return True


class Broken(Half):
    def _get_fmu_state(self):
        self.fail_in("get_state")
        return super()._get_fmu_state()

    def _set_fmu_state(self, state):
        self.fail_in("set_state")
        super()._set_fmu_state(state)

    def fail_in(self, function):
        if os.environ.get("FAIL_IN") == function:
            os.kill(os.getpid(), signal.SIGSEGV)
'''


@pytest.fixture
def cosim_run(tmp_path):
    (tmp_path / "parts.py").write_text(PARTS)
    document = {
        "name": "loop",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": {
            "intact": {"python": "parts.py:Half"},
            "broken": {"python": "parts.py:Broken"},
        },
        "connections": [
            {"from": "intact.y", "to": "broken.u"},
            {"from": "broken.y", "to": "intact.u"},
        ],
        "algorithm": {"stages": [["broken"], ["intact"]], "iteration": {"tolerance": 1e-9}},
    }
    (tmp_path / "loop.json").write_text(json.dumps(document))

    def run(**environment):
        return run_cosim(
            "run", "loop.json", "--output-dir", "out", "--no-report", cwd=tmp_path, env=environment
        )

    return run


def test_the_outputs_converge_to_the_fixed_point(cosim_run, tmp_path):
    done = cosim_run()
    assert done.returncode == 0, done.stderr
    last = (tmp_path / "out/result.csv").read_text().splitlines()[-1].split(",")
    assert [float(value) for value in last] == pytest.approx([0.1, 2.0, 2.0], abs=1e-8)


@pytest.mark.parametrize("function", ["get_state", "set_state"])
def test_a_crash_in_a_state_function_names_the_component(cosim_run, function):
    done = cosim_run(FAIL_IN=function)
    assert done.returncode == 1
    assert (
        f"broken: {function} failed at t = 0 s: the process was ended by signal 11 (SIGSEGV"
        in done.stderr
    )
