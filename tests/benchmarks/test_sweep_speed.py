"""What a sweep costs beside its runs: CPU time per run, and the share of two workers that is used."""

import json
import os
from pathlib import Path
from time import perf_counter, process_time

import pytest
from measure import compare, heading, show

import cosim
from cosim.fmi import FmuFile
from cosim.kpi import evaluate_kpis
from cosim.results import Result
from cosim.scenario import assemble
from cosim.scenario.tree import find, load
from cosim.simulate import simulation
from cosim.sweep.jobs import Job, Order
from cosim.sweep.local import LocalEngine

pytestmark = pytest.mark.benchmark

RUNS, ROUNDS = 8, 3
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


def settings(number):
    return {"/stop_time": 35.0, "uav.vtol.landing_time": 5.0 + 0.01 * number}


def jobs(count=RUNS):
    return [Job(str(number), settings(number)) for number in range(count)]


def prepared_files(scenario):
    root = load(scenario).root
    paths = {node.folder / node.spec.components[name].fmu for node, name in root.leaves() if node.spec.components[name].fmu}
    files = {path.resolve(): FmuFile(path) for path in paths}
    for file in files.values():
        file.acquire()
    return files


def bare(scenario, files):
    """CPU ms of a run in this process, from FMUs that are unpacked."""
    began = process_time()
    for job in jobs():
        assembly = assemble(scenario, job.settings, prepared={path: file.lent() for path, file in files.items()})
        with simulation(assembly.system, assembly.settings) as run:
            evaluate_kpis(Result(run.recording), assembly.kpis())
    return (process_time() - began) / RUNS * 1e3


def as_users_run(scenario):
    """CPU ms of `cosim.run`."""
    began = process_time()
    for job in jobs():
        cosim.run(scenario, job.settings)
    return (process_time() - began) / RUNS * 1e3


def tree_seconds(process):
    """CPU time (s) of a process, of the children it has now and of those it has waited for."""
    text = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    own = sum(map(int, text[11:15])) / os.sysconf("SC_CLK_TCK")
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    return own + sum(tree_seconds(int(child)) for child in children)


def forked(engine):
    """CPU ms of a run of a sweep, with the processes around it."""
    process = engine.shop._template.process
    began, own = tree_seconds(process), process_time()
    assert not any(record.failure for record in engine.results(jobs()))
    return (tree_seconds(process) - began + process_time() - own) / RUNS * 1e3


def test_overhead_of_a_run():
    scenario = find("demo1_box")
    files = prepared_files(scenario)
    heading("Demo 1, 35 s with landing", "CPU ms per run")
    with LocalEngine(Order(scenario, scenario.parent), 1) as engine:
        list(engine.results(jobs(1)))
        contenders = {
            "bare, FMUs unpacked": lambda: bare(scenario, files),
            "cosim.run": lambda: as_users_run(scenario),
            "a run of a sweep": lambda: forked(engine),
        }
        rows = compare(contenders, ROUNDS)
        show("demo1_box", rows)
    costs = {row.name: row.cost for row in rows}
    assert costs["a run of a sweep"] - costs["bare, FMUs unpacked"] < 50


def wall(order, workers, busy, count=8):
    """Wall time (s) of runs of 1.2 s each."""
    with LocalEngine(order, workers) as engine:
        list(engine.results([Job("first", {"sleeper.number": -1.0, "/stop_time": 0.01})] * workers))
        began = perf_counter()
        made = [Job(str(number), {"sleeper.number": number, "sleeper.busy": busy}) for number in range(count)]
        assert not any(record.failure for record in engine.results(made))
        return perf_counter() - began


@pytest.mark.parametrize("busy", [0.0, 1.0], ids=["waiting", "computing"])
def test_efficiency_of_two_workers(tmp_path, busy):
    """Runs that wait show what the engine loses, runs that compute also what the machine does: two threads of one core, others
    on it."""
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    content = {"name": "s", "stop_time": 1.0, "step_size": 0.01, "components": {"sleeper": {"python": "sleeper.py:Sleeper"}}}
    (tmp_path / "s.json").write_text(json.dumps(content))
    order = Order(tmp_path / "s.json", tmp_path)
    found = sorted(wall(order, 1, busy) / (2 * wall(order, 2, busy)) for _ in range(3))
    print(
        f"\n  efficiency of two workers, {'computing' if busy else 'waiting'}: {found[1]:.3f} ({found[0]:.3f} ... {found[2]:.3f})"
    )
    assert busy or found[-1] > 0.9
