"""Two components of which one crashes while it is terminated, freed or unloaded: a warning names
it, not the other one.
"""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT, function_name, scenario

NAMES = ("first", "second")


@pytest.mark.parametrize("isolation", ["run", "fmu"])
@pytest.mark.parametrize("guilty", NAMES)
@pytest.mark.parametrize(
    "order", ["FreeInstance 1 segv", "FreeInstance 1 exit_0", "Terminate 1 abort", "unload 1 segv"]
)
def test_the_component_that_crashes_is_named(fmus, runner, tmp_path, order, guilty, isolation):
    components = {
        name: {"fmu": str(fmus(2, order if name == guilty else "", name))} for name in NAMES
    }
    file = scenario(tmp_path, fmus(2), components=components)
    done = runner.cosim(
        tmp_path, "run", file, "--output-dir", "out", "--no-report", "--isolation", isolation
    )
    what = order.split()[0]
    activity = "unloading the binary" if what == "unload" else function_name(2, what)
    (line,) = done.err.splitlines()
    assert line.startswith(f"WARNING {guilty}: {activity} failed: ")
    assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1)


PYTHON_COMPONENT = """
import os, signal
from cosim import Component, Variable

class Echo(Component):
    binds_everything = has_state = False
    variables = [Variable("y", causality="output")]

    def __init__(self, instance_name, fatal=""):
        self._fatal = fatal

    def _call(self, name):
        if name == self._fatal:
            os.kill(os.getpid(), signal.SIGABRT)

    def terminate(self):
        self._call("terminate")

    def free(self):
        self._call("free")

    def get(self, name):
        return 0.0

    def _nothing(self, *arguments):
        pass

    set = bind = instantiate = enter_initialization_mode = exit_initialization_mode = _nothing
    set_inputs = do_step = get_outputs = prepare_step_calls = _nothing
"""


@pytest.mark.parametrize("guilty", NAMES)
@pytest.mark.parametrize("function", ["terminate", "free"])
def test_the_python_component_that_crashes_is_named(fmus, runner, tmp_path, function, guilty):
    (tmp_path / "echo.py").write_text(PYTHON_COMPONENT)
    faults = {name: {"arguments": {"fatal": function}} if name == guilty else {} for name in NAMES}
    components = {name: {"python": "echo.py:Echo", **fault} for name, fault in faults.items()}
    file = scenario(tmp_path, fmus(2), components=components)
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report")
    (line,) = done.err.splitlines()
    assert line.startswith(f"WARNING {guilty}: {function} failed: ")
    assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1)
