"""A result writes the same folder as `cosim run`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cosim
from cosim.core.errors import InputError


def test_a_loop_of_ones_own_writes_a_folder_with_a_report(tmp_path: Path) -> None:
    with cosim.load("free_flight", stop_time=0.5) as simulation:
        while simulation.step():
            pass
        simulation.result.write(tmp_path / "run")
    assert {"result.csv", "kpis.json", "run.json", "report.html"} <= {
        path.name for path in (tmp_path / "run").iterdir()
    }
    written = cosim.Result.from_csv(tmp_path / "run/result.csv")
    assert written.signals() == simulation.result.signals()
    assert json.loads((tmp_path / "run/run.json").read_text())["name"] == "free_flight"
    assert "free_flight" in (tmp_path / "run/report.html").read_text()


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="file"):
        cosim.run("free_flight", stop_time=0.1).write(tmp_path / "file/run")
