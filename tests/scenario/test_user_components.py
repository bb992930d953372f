"""Component classes of users are checked when they are loaded, so that mistakes are reported before
the run.
"""

import json
import subprocess
import sys

import pytest

import cosim
from cosim.core.errors import ComponentError

OWN = """
from cosim.core.component import Component, StepResult, Variable
from cosim.core.units import parse_unit


class Own(Component):
    binds_everything = True
    has_state = False

    def __init__(self, instance_name):
        self.variables = [
            Variable("u", causality="input", start=1.0, unit=parse_unit("N")),
            Variable("y", causality="output", variability="continuous"),
        ]
        self.u = 1.0

    def set(self, name, value):
        self.u = value

    def get(self, name):
        return self.u

    def bind(self, inputs, outputs):
        (self.inputs,), (self.outputs,) = inputs.arrays.values(), outputs.arrays.values()

    def set_inputs(self):
        self.u = self.inputs.item(0)

    def do_step(self, time, step_size):
        return None

    def get_outputs(self):
        self.outputs[0] = 2 * self.u
"""


@pytest.fixture
def own(folder):
    """Writes the component with one edit; returns the scenario's components."""

    def write(before="", after=""):
        assert before in OWN
        (folder.path / "own.py").write_text(OWN.replace(before, after))
        return {"a": {"python": "own.py:Own", "parameters": {"u": 3.0}}}

    return write


def test_a_valid_component_runs_without_the_optional_methods(folder, own):
    assert cosim.run(folder.scenario(own()))["a.y"].tolist() == [6.0] * 4


def test_pythonfmu_is_not_imported_for_a_scenario_without_its_classes(folder, own):
    program = (
        "import sys, cosim; cosim.load(sys.argv[1]).close(); print('pythonfmu' in sys.modules)"
    )
    command = [sys.executable, "-c", program, folder.scenario(own())]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "False\n"


@pytest.mark.parametrize(
    ("before", "after", "line"),
    [
        ("def do_step", "def dostep", 'it does not define "do_step", but "dostep"'),
        ("def get_outputs", "def outputs_of", 'it does not define "get_outputs"'),
        ("has_state = False", "has_state = True", 'it does not define "get_state"'),
        (
            "do_step(self, time, step_size)",
            "do_step(self, time)",
            '"do_step" does not take the arguments (time, step_size)',
        ),
        (
            'parse_unit("N")',
            '"N"',
            (
                "variable \"u\": unit is 'N', expected a cosim.core.units.Unit, such as "
                "parse_unit('N')"
            ),
        ),
        (
            '"output", v',
            '"outptu", v',
            'variable "y": causality is "outptu"; did you mean "output"?',
        ),
        (
            '"continuous"',
            '"continous"',
            'variable "y": variability is "continous"; did you mean "continuous"?',
        ),
        ('Variable("y", ', 'Variable("u", ', 'variable "u" is declared 2 times'),
        (
            'Variable("y", ',
            'Variable("y", shape=3, ',
            'variable "y": shape is 3, expected a tuple of sizes',
        ),
        (
            'Variable("y", causality="output", variability="continuous")',
            '"y"',
            "\"variables\" contains 'y', expected a cosim",
        ),
        (
            "has_state = False",
            "",
            "it has no has_state; expected a component or an Fmi2Slave class",
        ),
        (
            'Variable("y", ',
            'Variable("y", "Flaot64", ',
            'variable "y": type is "Flaot64", expected one of FMI 3.0; did you mean "Float64"?',
        ),
    ],
)
def test_a_mistake_in_the_class_is_reported(folder, own, before, after, line):
    found = folder.problems(own(before, after))
    assert line in found[0]
    assert found[0].startswith("scenario.json:1:")
    assert "$.components.a: own.py:Own" in found[0]


def test_all_mistakes_in_the_class_are_reported_together(folder, own):
    own("def do_step", "def dostep")
    file = folder.path / "own.py"
    file.write_text(file.read_text().replace('"output", v', '"outptu", v'))
    assert len(folder.problems({"a": {"python": "own.py:Own"}})) == 2


def test_do_step_must_return_none_or_a_step_result(folder, own):
    with pytest.raises(
        ComponentError,
        match="a: do_step failed at t = 0 s: returned True, expected None or a StepResult",
    ):
        cosim.run(folder.scenario(own("return None", "return True")))


@pytest.mark.parametrize("place", ["module", "constructor"])
def test_a_class_that_hangs_while_it_is_loaded_ends_at_its_deadline(tmp_path, place):
    sleep = "import time\ntime.sleep(60)\n"
    constructor = (
        "class Slow:\n    def __init__(self, instance_name):\n        import time\n        "
        "time.sleep(60)\n"
    )
    (tmp_path / "slow.py").write_text(sleep if place == "module" else constructor)
    components = {"slow": {"python": "slow.py:Slow"}}
    content = {
        "name": "slow",
        "stop_time": 1,
        "step_size": 0.1,
        "components": components,
        "deadlines": {"load": 0.2},
    }
    (tmp_path / "slow.json").write_text(json.dumps(content))
    command = [sys.executable, "-m", "cosim", "run", "slow.json", "--no-report"]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=30
    )
    line = {"module": 2, "constructor": 4}[place]
    assert (
        done.stderr
        == f"slow: loading the class failed: did not return within 0.2 s (slow.py:{line})\n"
    )
    assert done.returncode == 1
