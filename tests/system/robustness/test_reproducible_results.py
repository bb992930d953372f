"""The same scenario gives the same bytes in every environment, and the numbers of others."""

from __future__ import annotations

import math
import os
import shutil
from hashlib import sha256
from pathlib import Path

import fmpy
import numpy as np
import pytest
from command_folder import CommandFolder

import cosim
from cosim.core import resources

FMUS = resources.root() / "fmus"
#: environments, folder, further options
SURROUNDINGS = {
    "as it is": ({}, ".", ()),
    "hash seed": ({"PYTHONHASHSEED": "12345"}, ".", ()),
    "another hash seed": ({"PYTHONHASHSEED": "7"}, ".", ()),
    "working directory": ({}, "elsewhere", ()),
    "locale and time zone": (
        {"LC_ALL": "C.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Asia/Tokyo"},
        ".",
        (),
    ),
    "plain locale": ({"LC_ALL": "C", "PYTHONUTF8": "0"}, ".", ()),
    "in one process": ({}, ".", ("--isolation", "none")),
    "many threads": ({"OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "2"}, ".", ()),
}


def digest(
    workplace: CommandFolder,
    scenario: str,
    environment: dict[str, str],
    folder: str,
    options: tuple[str, ...],
) -> str:
    place = workplace.folder / folder
    place.mkdir(exist_ok=True)
    words = ("run", scenario, "--stop-time", "6", "--output-dir", "out", "--no-report", *options)
    process = workplace.start(*words, environment=environment, cwd=place)
    _, errors = process.communicate(timeout=100)
    assert process.returncode in (0, 3), errors  # the landing is not reached
    return sha256((place / "out/result.csv").read_bytes()).hexdigest()


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """The digest of a run in this process, which has done other things before."""
    digests = {}
    for name in ("demo1_box", "free_flight"):
        file = tmp_path_factory.mktemp(name) / "result.csv"
        cosim.run(name, stop_time=6).to_csv(file)
        digests[name] = sha256(file.read_bytes()).hexdigest()
    return digests


@pytest.mark.parametrize("name", SURROUNDINGS)
def test_surroundings_do_not_matter(workplace, expected, name):
    assert digest(workplace, "free_flight", *SURROUNDINGS[name]) == expected["free_flight"]


@pytest.mark.parametrize("name", ["hash seed", "in one process"])
def test_surroundings_do_not_matter_to_the_world(workplace, expected, name):
    assert digest(workplace, "demo1_box", *SURROUNDINGS[name]) == expected["demo1_box"]


LARGE_MATRIX = """
import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class LargeMatrix(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.solution = 0.0
        self.register_variable(Real("solution", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        matrix = np.random.default_rng(1).normal(size=(200, 200))
        self.solution = float(np.linalg.solve(matrix, matrix[0] + current_time)[0])
        return True
"""


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="needs two processors")
def test_number_of_processors_does_not_matter(workplace, monkeypatch):
    """NumPy's BLAS solves large systems in other orders on several processors."""
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    (workplace.folder / "large_matrix.py").write_text(LARGE_MATRIX)
    components = {"matrix": {"python": "large_matrix.py:LargeMatrix"}}
    scenario = workplace.scenario(step_size=0.5, components=components)
    processors = os.sched_getaffinity(0)
    found = {digest(workplace, str(scenario), {}, ".", ())}
    os.sched_setaffinity(0, {min(processors)})
    try:
        found.add(digest(workplace, str(scenario), {}, ".", ()))
    finally:
        os.sched_setaffinity(0, processors)
    assert len(found) == 1


@pytest.mark.long
def test_twenty_repeats(workplace, expected):
    for _ in range(20):
        assert digest(workplace, "demo1_box", *SURROUNDINGS["as it is"]) == expected["demo1_box"]


def alone(
    fmu: Path, folder: Path, stop: float, step: float, **start: float
) -> dict[str, np.ndarray]:
    """Outputs of one FMU by name, run without a supervisor."""
    from cosim import cli

    file = folder / "result.csv"
    values = []
    for name, value in start.items():
        values += ["--start-value", f"{name}={value!r}"]
    words = [
        "simulate",
        str(fmu),
        "--stop-time",
        repr(stop),
        "--step-size",
        repr(step),
        "--output-file",
        str(file),
    ]
    assert cli.run_command_line([*words, *values, "--isolation", "none"]) == 0
    result = cosim.Result.from_csv(file)
    return {"time": result.time, **result.recording.columns}


@pytest.mark.parametrize(
    "name", ["vtol", "strider", "ar_drone", "fmi3/vtol", "fmi3/strider", "python/waypoint_guidance"]
)
def test_one_fmu_alone_is_as_in_fmpy(tmp_path, name):
    fmu = FMUS / f"{name}.fmu"
    ours = alone(fmu, tmp_path, 2.0, 0.01)
    names = [output for output in ours if output != "time"]
    theirs = fmpy.simulate_fmu(
        str(fmu), stop_time=2.0, step_size=0.01, output_interval=0.01, output=names
    )
    assert np.allclose(ours["time"], theirs["time"], rtol=0, atol=1e-12)
    for output in names:
        assert np.allclose(ours[output], theirs[output], rtol=1e-12, atol=1e-12, equal_nan=True), (
            output
        )


DAHLQUIST = """
model Dahlquist
  output Real x(start = 1, fixed = true);
  parameter Real k = 1;
equation
  der(x) = -k*x;
end Dahlquist;
"""


def test_dahlquist_is_the_exponential(tmp_path):
    """x' = -k x: the fourth-order Runge-Kutta inside the FMU leaves h^5/120 per step, cosim adds
    nothing to it.
    """
    if not shutil.which(os.environ.get("CC", "cc")):
        pytest.skip("no C compiler")
    (tmp_path / "Dahlquist.mo").write_text(DAHLQUIST)
    scenario = tmp_path / "dahlquist.json"
    scenario.write_text(
        '{"name": "d", "stop_time": 2, "step_size": 0.001, "components": {"d": {"modelica": '
        '"Dahlquist.mo:Dahlquist"}}}'
    )
    result = cosim.run(scenario)
    exact = np.array([math.exp(-t) for t in result.time])
    assert np.abs(result["d.x"] - exact).max() < 1e-12
