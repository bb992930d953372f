"""Two FMUs of which one crashes while it is terminated, freed or unloaded: a warning names it, not the other one."""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT, function_name, scenario

NAMES = ("first", "second")


@pytest.mark.parametrize("isolation", ["run", "fmu"])
@pytest.mark.parametrize("guilty", NAMES)
@pytest.mark.parametrize("order", ["FreeInstance 1 segv", "FreeInstance 1 exit_0", "Terminate 1 abort", "unload 1 segv"])
def test_the_component_that_crashes_is_named(fmus, runner, tmp_path, order, guilty, isolation):
    components = {name: {"fmu": str(fmus(2, order if name == guilty else "", name))} for name in NAMES}
    file = scenario(tmp_path, fmus(2), components=components)
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report", "--isolation", isolation)
    what = order.split()[0]
    activity = "unloading the binary" if what == "unload" else function_name(2, what)
    (line,) = done.err.splitlines()
    assert line.startswith(f"WARNING {guilty}: {activity} failed: ")
    assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1)
