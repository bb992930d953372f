"""Native executors built from other sources, as they stay behind in an editable installation."""

from __future__ import annotations

import subprocess
import sysconfig
from fractions import Fraction
from importlib.machinery import ExtensionFileLoader, ModuleSpec
from importlib.util import module_from_spec
from pathlib import Path

import pytest
from fakes import counter
from systems import make_system

from cosim.cli import CommandLine, cli, run_guarded
from cosim.core.errors import InputError
from cosim.engine import executor_class, native_available, native_executor
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.export.fmu.compiler import find_compiler

ENGINE = Path(native_executor.__file__).parent
#: interface number of a build, and what differs in its source; the oldest builds have 0
OTHER_SOURCES = {
    0: ('{"INTERFACE", INTERFACE},', ""),
    native_executor.INTERFACE + 1: ("{ INTERFACE = ", "{ INTERFACE = 1 + "),
    -1: ("{ INTERFACE = ", "{ INTERFACE = -1 - 0 * "),
}

pytestmark = pytest.mark.skipif(not native_available(), reason="the native executor was not built")


@pytest.fixture(scope="module", params=OTHER_SOURCES)
def stale(request, tmp_path_factory):
    """Interface number and module of a native executor that was built from other sources."""
    folder = tmp_path_factory.mktemp("stale")
    source, library = folder / "_native.c", folder / "_native.so"
    text, (old, new) = (ENGINE / "_native.c").read_text(), OTHER_SOURCES[request.param]
    assert text.count(old) == 1
    source.write_text(text.replace(old, new))
    headers = sysconfig.get_path("include")
    subprocess.run(
        [*find_compiler(), "-shared", "-fPIC", "-O0", f"-I{headers}", source, "-o", library],
        check=True,
    )
    module = module_from_spec(
        ModuleSpec("_native", ExtensionFileLoader("_native", str(library)), origin=str(library))
    )
    return request.param, module


@pytest.fixture
def message(stale, monkeypatch):
    """The line that says what to do, while the stale module stands for the native executor."""
    found, module = stale
    monkeypatch.setattr(native_executor, "_native", module)
    return (
        f"the native executor {module.__file__} has interface {found}, expected "
        f"{native_executor.INTERFACE}: "
        "build it again with `python setup.py build_ext --inplace` in the checkout\n"
    )


def test_a_run_says_to_build_it_again(message, probes, capfd):
    code = run_guarded(
        lambda: cli.main(
            ["simulate", str(probes[2]), "--isolation", "none"], standalone_mode=False
        ),
        CommandLine(),
    )
    assert (code, *capfd.readouterr()) == (2, "", message)


def test_doctor_reports_it_as_broken(message, capfd):
    code = run_guarded(lambda: cli.main(["doctor"], standalone_mode=False), CommandLine())
    out, err = capfd.readouterr()
    assert (code, err) == (1, "")
    assert f"  executor             BROKEN: {message}" in out


@pytest.mark.usefixtures("message")
def test_the_python_executor_still_runs():
    settings = Settings(Fraction(0), Fraction(1), Fraction(1, 10), executor="python")
    assert executor_class("python").__name__ == "PythonExecutor"
    assert simulate(make_system({"a": counter()}), settings).macro_steps == 10
    with pytest.raises(InputError, match="has interface"):
        executor_class("native")
