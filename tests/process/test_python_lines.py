"""An exception, a hang or a crash in a Python controller, in process or exported, is told with its
line.
"""

import json
import re

import pytest
from cosim_command import run_cosim

from cosim.export.build import build_to

SOURCE = """
import ctypes
import time

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real, String
import numpy as np


class Faulty(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.fault, self.y = "", 0.0
        kind = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(String("fault", **kind))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if current_time > 1:
            getattr(self, self.fault)()
        return True

    def loop(self):
        while True:
            pass  # loop

    def wait(self):
        time.sleep(100)  # wait

    def crash(self):
        ctypes.string_at(0)  # crash

    def inverse(self):
        np.linalg.inv(np.zeros((2, 2)))  # inverse

    def leave(self):
        raise SystemExit(3)  # leave
"""
REASONS = {
    "loop": "did not return within 0.3 s",
    "wait": "did not return within 0.3 s",
    "crash": "the process was ended by signal 11 (SIGSEGV, segmentation fault)",
    "inverse": "LinAlgError: Singular matrix",
    "leave": "SystemExit: 3",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faulty")
    (folder / "faulty.py").write_text(SOURCE)
    build_to(folder / "faulty.py", None, folder / "faulty.fmu")
    return folder


@pytest.mark.parametrize(
    "source", [{"python": "faulty.py:Faulty"}, {"fmu": "faulty.fmu"}], ids=["class", "fmu"]
)
@pytest.mark.parametrize("fault", REASONS)
def test_the_line_is_told(folder, tmp_path, source, fault):
    components = {"a": {**source, "parameters": {"fault": fault}}}
    content = {
        "name": "s",
        "stop_time": 5,
        "step_size": 1,
        "deadlines": {"step": 0.3},
        "components": components,
    }
    file = folder / f"{tmp_path.name}.json"
    file.write_text(json.dumps(content))
    done = run_cosim("run", file, "--no-report", cwd=tmp_path)
    assert done.returncode == 1
    line = next(
        number for number, text in enumerate(SOURCE.splitlines(), 1) if text.endswith(f"# {fault}")
    )
    message = done.stderr.splitlines()[-1]
    assert re.match(r"a: (fmi2D|d)o_?[sS]tep failed at t = 2 s: ", message)
    lines = {line - 1, line} if fault == "loop" else {line}
    assert message.endswith(tuple(f"{REASONS[fault]} (faulty.py:{number})" for number in lines)), (
        message
    )
