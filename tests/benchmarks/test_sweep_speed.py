"""Overhead of a sweep: additional time per run, and the utilisation of two workers."""

import json
import os
from statistics import median
from time import perf_counter

import pytest

import cosim
from cosim.components.fmi import FmuFile
from cosim.engine.plan_run import simulating
from cosim.results import Result
from cosim.results.kpi import evaluate_kpis
from cosim.scenario import find_scenario, load, load_scenario
from cosim.scenario.component_sources import FmuSource
from cosim.studies.execution.job import Job, StudyContext
from cosim.studies.execution.worker_pool import LocalRunner

pytestmark = pytest.mark.benchmark

RUNS = 30
SLEEPER = """
from time import process_time, sleep
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

class Sleeper(Fmi2Slave):
    def __init__(self, **more):
        super().__init__(**more)
        self.busy, self.y, self.number = 0.0, 0.0, 0.0
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("busy", **tunable))
        self.register_variable(Real("number", **tunable))
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


def key_of(number):
    """Key of a run: hexadecimal digits."""
    return f"{number + 1:04x}"


def job(number):
    return Job(key_of(number), {"/stop_time": 35.0, "uav.vtol.landing_time": 5.0 + 0.01 * number})


def prepared_files(scenario):
    root = load_scenario(scenario).root
    files = {}
    for node, name in root.leaves():
        source = node.spec.components[name]
        if isinstance(source, FmuSource):
            path = (node.folder / source.fmu).resolve()
            files[path] = FmuFile(path)
    for file in files.values():
        file.acquire()
    return files


def run_in_process(job, scenario, files):
    """Run in this process, with FMUs that are already extracted."""
    prepared = load(
        scenario, job.settings, loaded_fmus={path: file.share() for path, file in files.items()}
    )
    with simulating(prepared.plan) as run:
        evaluate_kpis(Result(run.recording), prepared.kpis())


def run_in_sweep(job, runner):
    """Run as a run of a sweep."""
    (record,) = runner.run_jobs([job])
    assert not record.failure


def milliseconds(function, *arguments):
    start = perf_counter()
    function(*arguments)
    return (perf_counter() - start) * 1e3


def test_overhead_of_a_run():
    """The ways to run alternate; the smallest times are the least affected by other load."""
    scenario = find_scenario("demo1_box")
    files = prepared_files(scenario)
    times = {"in process, FMUs extracted": [], "cosim.run": [], "a run of a sweep": []}
    with LocalRunner(
        StudyContext(scenario, scenario.parent, fmus=tuple(map(str, files))), 1
    ) as runner:
        for number in range(RUNS):
            times["in process, FMUs extracted"].append(
                milliseconds(run_in_process, job(number), scenario, files)
            )
            times["cosim.run"].append(milliseconds(cosim.run, scenario, job(number).settings))
            times["a run of a sweep"].append(milliseconds(run_in_sweep, job(number), runner))
    print(
        f"\n  Demo 1, 35 s with landing, {RUNS} runs, load average {os.getloadavg()[0]:.1f}: wall "
        "ms, least and median"
    )
    for name, values in times.items():
        print(f"  {name:28}{min(values):8.1f}{median(values):8.1f}")
    least = {name: min(values) for name, values in times.items()}
    assert least["a run of a sweep"] - least["cosim.run"] < 50


def wall_time(context, workers, busy, count=8):
    """Return the wall time (s) of `count` runs of 1.2 s each."""
    with LocalRunner(context, workers) as runner:
        list(
            runner.run_jobs(
                [Job(key_of(-1), {"sleeper.number": -1.0, "/stop_time": 0.01})] * workers
            )
        )
        start = perf_counter()
        jobs = [
            Job(key_of(number), {"sleeper.number": number, "sleeper.busy": busy})
            for number in range(count)
        ]
        assert not any(record.failure for record in runner.run_jobs(jobs))
        return perf_counter() - start


@pytest.mark.parametrize("busy", [0.0, 1.0], ids=["waiting", "computing"])
def test_efficiency_of_two_workers(tmp_path, busy):
    """Waiting runs show the overhead of the runner; computing runs also show the influence of the
    machine.
    """
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    content = {
        "name": "s",
        "stop_time": 1.0,
        "step_size": 0.01,
        "components": {"sleeper": {"python": "sleeper.py:Sleeper"}},
    }
    (tmp_path / "s.json").write_text(json.dumps(content))
    context = StudyContext(tmp_path / "s.json", tmp_path)
    found = sorted(
        wall_time(context, 1, busy) / (2 * wall_time(context, 2, busy)) for _ in range(3)
    )
    print(
        f"\n  efficiency of two workers, {'computing' if busy else 'waiting'}: {found[1]:.3f} "
        f"({found[0]:.3f} ... {found[2]:.3f})"
    )
    assert busy or found[-1] > 0.9
