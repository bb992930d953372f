"""Fixtures of all tests."""

import gc
import signal
from pathlib import Path

import pytest
from ball_fmus import ball, balls
from chromium import open_browser
from plant_validation import MeasurementCheck, ValidationReport
from probe_fmus import probe, probes
from quick_compiler import compile_without_optimization

from cosim.core.resources import available_processors
from cosim.engine import EXECUTORS
from cosim.engine import native_available as native_available

__all__ = ["ball", "balls", "executor", "probe", "probes"]


def pytest_addoption(parser):
    parser.addoption(
        "--validation",
        metavar="FILE",
        help="run only the tests that validate the plant; write what they measured",
    )


def pytest_configure(config):
    compile_without_optimization()
    if (
        signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    ):  # as in the background of a script; commands would inherit it
        signal.signal(signal.SIGINT, signal.default_int_handler)
    target = config.getoption("--validation")
    if target and not hasattr(config, "workerinput"):
        config.pluginmanager.register(ValidationReport(Path(target)))


def pytest_xdist_auto_num_workers():
    """One worker more than processors: many tests wait for processes, clocks or a browser."""
    return available_processors() + 1


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Keep the garbage collector away from the 400 000 objects of the collected tests."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(config, items):
    if config.getoption("--validation"):
        items[:] = [item for item in items if "measured" in getattr(item, "fixturenames", ())]


@pytest.fixture(scope="session")
def chromium():
    """One browser per process: Playwright's synchronous interface cannot be started twice."""
    with open_browser() as opened:
        yield opened


@pytest.fixture
def measured(request):
    """States a quantity of the plant beside its reference (tests/support/plant_validation.py)."""
    return MeasurementCheck(request.node)


@pytest.fixture(params=sorted(EXECUTORS))
def executor(request, monkeypatch):
    """Whatever a test simulates, it does so with each executor."""
    if request.param == "native" and not native_available():
        pytest.skip("the native executor was not built")
    monkeypatch.setattr(
        "cosim.engine.plan_run.executor_class", lambda _kind: EXECUTORS[request.param]
    )
    return request.param
