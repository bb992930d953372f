"""FMUs that take away the access of the process to the files of the run: they are named, and the
supervisor saves the rows.
"""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT

from cosim.process.sandbox import landlock

pytestmark = pytest.mark.skipif(
    landlock.abi_version() < 1, reason="without Landlock no process can give up its access"
)


def test_the_component_is_named_and_the_rows_are_kept(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version, "DoStep 6 give_up_files"))
    assert "lag: a call that gave up the access to the files of the run failed: " in done.err
    assert (done.code, len(done.rows)) == (1, STEP_COUNT + 1)
