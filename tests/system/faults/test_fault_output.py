"""Foreign text reaches the terminal only in printable characters, wherever it comes from."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys

import pytest
from fault_fmu import scenario

#: a colour, a title of the terminal, the one-character introducer of control sequences,
#: right-to-left override, return
CONTROL = "\x1b[31mred\x1b]0;title\a\x9b31m \u202ertl\r"
ESCAPED = r"\x1b[31mred\x1b]0;title\x07\x9b31m \u202ertl\r"
ISOLATION = pytest.mark.parametrize(
    "words", [(), ("--isolation", "fmu"), ("--sandbox",)], ids=["run", "fmu", "sandbox"]
)


def assert_printable(done):
    for text in (done.out, done.err):
        assert all(line.replace("\t", "").isprintable() for line in text.split("\n")), ascii(text)


@ISOLATION
def test_a_log_message_is_one_printable_line(fmus, runner, tmp_path, version, words):
    done = runner.simulate(tmp_path, fmus(version, "DoStep 6 log_control"), *words)
    assert done.code == 0, done.err
    assert f"WARNING Lag: {ESCAPED}\\nERROR other: faked\n" in done.err
    assert_printable(done)


@ISOLATION
def test_what_an_fmu_prints_is_escaped(fmus, runner, tmp_path, version, words):
    done = runner.simulate(tmp_path, fmus(version, "DoStep 6 print_control"), *words)
    assert done.code == 0, done.err
    assert done.err.count(ESCAPED) == 2
    assert_printable(done)


@pytest.mark.parametrize("place", ["modelName", 'name="y_start"', 'description="a lag'])
def test_info_prints_names_and_descriptions_in_one_line_each(fmus, runner, tmp_path, place):
    """A line break in a description would fake a line of the list."""
    sly = "a&#10;FMI version   9.9&#x9b;31m&#x202e;"
    changes = {
        "modelName": ('modelName="Lag"', f'modelName="{sly}"'),
        'name="y_start"': ('name="y_start"', f'name="y_start" description="{sly}"'),
        'description="a lag': ('description="a lag', f'description="{sly}'),
    }
    old, new = changes[place]
    done = runner.cosim(tmp_path, "info", fmus(2, changes={old: new}))
    assert done.code == 0, done.err
    assert done.out.count(r"a\nFMI version   9.9\x9b31m\u202e") == 1, done.out + done.err
    assert [line for line in done.out.splitlines() if line.startswith("FMI version   9.9")] == []
    assert_printable(done)


def kpi_scenario(folder, fmu):
    (folder / "kpi.py").write_text(f"def sly(result):\n    return {{{CONTROL!r}: 1.0}}\n")
    checks = [{"kpi": f"sly.{CONTROL}", "max": 2.0}]
    return scenario(folder, fmu, kpis=[{"name": "sly", "python": "kpi.py:sly"}], checks=checks)


def test_names_of_kpis_are_escaped(fmus, runner, tmp_path):
    done = runner.cosim(
        tmp_path, "run", kpi_scenario(tmp_path, fmus(2)), "--output-dir", "out", "--no-report"
    )
    assert done.code == 0, done.err
    assert f"sly.{ESCAPED}" in done.out
    assert_printable(done)


def test_on_a_terminal_only_the_own_colours_remain(fmus, tmp_path):
    """The command writes to a pseudo terminal: its table may have colours, but the KPI's name
    cannot.
    """
    primary, secondary = pty.openpty()
    words = ["run", kpi_scenario(tmp_path, fmus(2)), "--output-dir", "out", "--no-report"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "200"}
    with subprocess.Popen(
        [sys.executable, "-m", "cosim", *words], cwd=tmp_path, env=environment, stdout=secondary
    ) as process:
        assert process.wait(60) == 0
    os.close(secondary)
    shown = os.read(primary, 1 << 16).decode()
    os.close(primary)
    assert ESCAPED in shown
    assert "\x1b[" in shown.replace(ESCAPED, "")
    assert "\x1b[31mred" not in shown
    assert "\x9b" not in shown


def test_labels_of_sweeps_are_escaped(fmus, runner, tmp_path):
    levels = {CONTROL: {"lag.y_start": 1.0}, "plain": {"lag.y_start": 2.0}}
    sweep = {
        "name": "s",
        "scenario": kpi_scenario(tmp_path, fmus(2)).name,
        "factors": [{"name": "level", "levels": levels}],
    }
    more = {"by": [["level"]], "success": [{"kpi": f"sly.{CONTROL}", "max": 2.0}]}
    (tmp_path / "sweep.json").write_text(json.dumps({**sweep, **more}))
    done = runner.cosim(tmp_path, "sweep", "sweep.json", "--workers", 1, "--output-dir", "out")
    assert done.code == 0, done.err
    assert ESCAPED in done.out
    assert_printable(done)


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_the_encoding_of_the_terminal_does_not_matter(fmus, tmp_path, encoding):
    words = [sys.executable, "-m", "cosim", "simulate", fmus(2, "DoStep 6 log_control")]
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    done = subprocess.run(words, cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert ESCAPED.encode() in done.stderr
    assert b"\x1b" not in done.stderr + done.stdout
    assert b"\x9b" not in done.stderr + done.stdout


class TestSpreadsheets:
    """Texts in CSV files that spreadsheet programs take for formulas."""

    SLY = ("=1+1", "+1", "-1", "@SUM(A1)")

    def write(self, folder, fmus):
        levels = {label: {"lag.y_start": 1.0 + n} for n, label in enumerate(self.SLY)}
        sweep = {
            "name": "s",
            "scenario": scenario(folder, fmus(2)).name,
            "factors": [{"name": "level", "levels": levels}],
        }
        (folder / "sweep.json").write_text(json.dumps(sweep))
        return "sweep.json", "--workers", 1, "--output-dir", "out"

    def test_texts_are_written_as_they_are(self, fmus, runner, tmp_path):
        done = runner.cosim(tmp_path, "sweep", *self.write(tmp_path, fmus))
        assert done.code == 0, done.err
        _, *rows = (tmp_path / "out/table.csv").read_text().splitlines()
        assert [row.split(",")[1] for row in rows] == [*self.SLY]

    def test_on_request_an_apostrophe_precedes_them(self, fmus, runner, tmp_path):
        done = runner.cosim(tmp_path, "sweep", *self.write(tmp_path, fmus), "--excel-safe")
        assert done.code == 0, done.err
        _, *rows = (tmp_path / "out/table.csv").read_text().splitlines()
        assert [row.split(",")[1] for row in rows] == [f"'{label}" for label in self.SLY]

    @pytest.mark.parametrize(("words", "name"), [((), '"=y"'), (("--excel-safe",), '"\'=y"')])
    def test_names_of_signals(self, fmus, runner, tmp_path, words, name):
        fmu = fmus(2, changes={'name="y" ': 'name="=y" '})
        done = runner.simulate(tmp_path, fmu, *words)
        header, first, *_ = (tmp_path / "result.csv").read_text().splitlines()
        assert (done.code, header) == (0, f'"time",{name}'), done.err
        assert first == "0.0,1.0"

    def test_negative_numbers_stay_numbers(self, fmus, runner, tmp_path):
        done = runner.simulate(tmp_path, fmus(2), "--start-value", "y_start=-2", "--excel-safe")
        assert done.code == 0, done.err
        assert (tmp_path / "result.csv").read_text().splitlines()[1] == "0.0,-2.0"
