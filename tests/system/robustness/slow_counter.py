"""A component that takes its time, and a figure and a KPI that do."""

import time
from contextlib import suppress
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Real, String


def signal_and_sleep(where):
    """Say that this place is reached, and stay for long."""
    Path(f"reached-{where}").touch()
    time.sleep(60)


def tens(count):
    """Not easy for a CSV file.

    >>> tens(25)
    '"2" tens, é'
    """
    return f'"{count // 10:.0f}" tens, é'


class SlowCounter(Fmi2Slave):
    """Each step lasts `pause` s; `count` counts the steps, `tens` says in words how many tens,
    `clock` is the wall clock (s).

    Step `fail_at` fails.
    `slow` names the place where it stays: load, initialization, step, stubborn (a step that no
    interrupt ends), or nowhere.
    """

    def __init__(self, pause=0.002, slow="", fail_at=None, **arguments):
        super().__init__(**arguments)
        self.pause, self.slow, self.fail_at, self.count, self.clock = pause, slow, fail_at, 0.0, 0.0
        self.tens = tens(0)
        for name in ("count", "clock"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.register_variable(String("tens", causality=Fmi2Causality.output))
        if slow == "load":
            signal_and_sleep("load")

    def exit_initialization_mode(self):
        if self.slow == "initialization":
            signal_and_sleep("initialization")
        self.clock = time.monotonic()
        Path("starting").write_text(repr(self.clock))
        Path("starting").rename("started")

    def do_step(self, current_time, step_size):  # noqa: ARG002  signature of Fmi2Slave
        time.sleep(self.pause)
        self.count, self.clock = self.count + 1, time.monotonic()
        self.tens = tens(self.count)
        if self.count == 20:
            self.block_in_step()
        return self.count != self.fail_at

    def block_in_step(self):
        if self.slow == "step":
            signal_and_sleep("step")
        while self.slow == "stubborn":
            with suppress(KeyboardInterrupt):
                signal_and_sleep("stubborn")


def row_count(result):
    return {"number": len(result.time)}


def slow_kpi(_result):
    signal_and_sleep("kpi")
    return {"value": 1}


def block_result(_result):
    Path("out/result.csv").unlink(missing_ok=True)
    Path("out/result.csv").mkdir()
    return {"value": 1}


def slow_figure(_result):
    signal_and_sleep("figure")


def plot_count(result):
    from matplotlib.figure import Figure

    figure = Figure()
    figure.add_subplot().plot(result.time, result["ticker.count"])
    return figure
