"""What a sweep costs beside its runs: time per run, and the share of two workers that is used."""

import json
import os
from statistics import median
from time import perf_counter

import pytest

import cosim
from cosim.components.fmi import FmuFile
from cosim.engine.run_loop import simulating
from cosim.results import Result
from cosim.results.kpi import evaluate_kpis
from cosim.scenario import prepare
from cosim.scenario.nested_systems import find_scenario, load_scenario
from cosim.studies.execution.job import Job, StudyContext
from cosim.studies.execution.local import LocalRunner

pytestmark = pytest.mark.benchmark

RUNS = 30
SLEEPER = """
from time import process_time, sleep
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

class Sleeper(Fmi2Slave):
    def __init__(self, **more):
        super().__init__(**more)
        self.busy, self.y, self.number = 0.0, 0.0, 0.0
        self.register_variable(Real("busy", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("number", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        end = process_time() + 0.012
        if self.busy:
            while process_time() < end:
                self.y += 1.0
        else:
            sleep(0.012)
        return True
"""


def job(number):
    return Job(str(number), {"/stop_time": 35.0, "uav.vtol.landing_time": 5.0 + 0.01 * number})


def prepared_files(scenario):
    root = load_scenario(scenario).root
    paths = {node.folder / node.spec.components[name].fmu for node, name in root.leaves() if node.spec.components[name].fmu}
    files = {path.resolve(): FmuFile(path) for path in paths}
    for file in files.values():
        file.acquire()
    return files


def bare(job, scenario, files):
    """A run in this process, of FMUs that are unpacked."""
    assembly = prepare(scenario, job.settings, loaded_fmus={path: file.lent() for path, file in files.items()})
    with simulating(assembly.system, assembly.settings) as run:
        evaluate_kpis(Result(run.recording), assembly.kpis())


def forked(job, engine):
    """A run of a sweep."""
    (record,) = engine.results([job])
    assert not record.failure


def milliseconds(work, *arguments):
    began = perf_counter()
    work(*arguments)
    return (perf_counter() - began) * 1e3


def test_overhead_of_a_run():
    """Runs in turns; the smallest times are those that met the least of what else the machine does."""
    scenario = find_scenario("demo1_box")
    files = prepared_files(scenario)
    times = {"bare, FMUs unpacked": [], "cosim.run": [], "a run of a sweep": []}
    with LocalRunner(StudyContext(scenario, scenario.parent, fmus=tuple(map(str, files))), 1) as engine:
        for number in range(RUNS):
            times["bare, FMUs unpacked"].append(milliseconds(bare, job(number), scenario, files))
            times["cosim.run"].append(milliseconds(cosim.run, scenario, job(number).settings))
            times["a run of a sweep"].append(milliseconds(forked, job(number), engine))
    print(f"\n  Demo 1, 35 s with landing, {RUNS} runs, load average {os.getloadavg()[0]:.1f}: wall ms, least and median")
    for name, values in times.items():
        print(f"  {name:24}{min(values):8.1f}{median(values):8.1f}")
    least = {name: min(values) for name, values in times.items()}
    assert least["a run of a sweep"] - least["cosim.run"] < 50


def wall(order, workers, busy, count=8):
    """Wall time (s) of runs of 1.2 s each."""
    with LocalRunner(order, workers) as engine:
        list(engine.run_jobs([Job("first", {"sleeper.number": -1.0, "/stop_time": 0.01})] * workers))
        began = perf_counter()
        made = [Job(str(number), {"sleeper.number": number, "sleeper.busy": busy}) for number in range(count)]
        assert not any(record.failure for record in engine.run_jobs(made))
        return perf_counter() - began


@pytest.mark.parametrize("busy", [0.0, 1.0], ids=["waiting", "computing"])
def test_efficiency_of_two_workers(tmp_path, busy):
    """Runs that wait show what the engine loses, runs that compute also what the machine does: two threads of one core, others
    on it."""
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    content = {"name": "s", "stop_time": 1.0, "step_size": 0.01, "components": {"sleeper": {"python": "sleeper.py:Sleeper"}}}
    (tmp_path / "s.json").write_text(json.dumps(content))
    order = StudyContext(tmp_path / "s.json", tmp_path)
    found = sorted(wall(order, 1, busy) / (2 * wall(order, 2, busy)) for _ in range(3))
    print(
        f"\n  efficiency of two workers, {'computing' if busy else 'waiting'}: {found[1]:.3f} ({found[0]:.3f} ... {found[2]:.3f})"
    )
    assert busy or found[-1] > 0.9
