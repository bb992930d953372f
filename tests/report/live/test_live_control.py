"""Unit tests of the control of a live run and of the feed of its rows."""

import json
from fractions import Fraction
from multiprocessing import Pipe

import numpy as np
import pytest
from fakes import FakeComponent, inputs, outputs
from systems import endpoint, make_system

import cosim.report.live.session
from cosim.core.component import Variable
from cosim.core.errors import ComponentError
from cosim.core.time_grid import TimeGrid
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Event, Settings
from cosim.process.run_files import ROWS_FILE, SIGNALS, TIME, Column, RowLayout, RowsFile
from cosim.report.live.control import LiveControl
from cosim.report.live.session import RowFeed

STEP = Fraction(1, 60)
GRID = TimeGrid.from_times(Fraction(0), Fraction(1), STEP)


class Steered:
    """y adds k in every step; before the step after n of them, `commands[n]` come in."""

    def __init__(self, commands, refuse=None, speed=None):
        self.commands, self.refuse = commands, refuse
        self.connection, child_end = Pipe()
        gain = Variable(
            "k", causality="parameter", variability="tunable", start=1.0, minimum=0.0, maximum=9.0
        )
        text = Variable("text", "String", causality="parameter", variability="tunable", start="")
        self.fake = FakeComponent(
            [gain, text, *inputs("u"), *outputs("y")], self.step, start={"k": 1.0, "text": ""}
        )
        self.fake.set = self.set
        self.system = make_system({"a": self.fake})
        self.control = LiveControl(child_end, self.system, GRID, speed, {"rows": 61})
        self.count = 0
        self.connection.send_bytes(b"{}")
        self.send()

    def set(self, name, value):
        if value == self.refuse:
            raise ComponentError("a", "set", "it does not like it")
        self.fake.values[name] = value

    def send(self):
        for message in self.commands.get(self.count, []):
            self.connection.send_bytes(json.dumps(message).encode())

    def step(self, values, _time, _step_size):
        values["y"] += values["k"]
        self.count += 1
        self.send()

    def run(self, events=(), control=True):
        columns = {"y": endpoint("a.y")}
        settings = Settings(Fraction(0), Fraction(1), STEP, columns, events=events)
        return simulate(self.system, settings, step_hook=self.control if control else None)

    def said(self):
        messages = []
        while self.connection.poll():
            messages.append(json.loads(self.connection.recv_bytes()))
        return messages


def change(value, name="a.k"):
    return {"command": "set", "name": name, "value": value}


@pytest.mark.usefixtures("executor")
def test_a_value_takes_effect_in_the_next_step():
    run = Steered({0: [change(2.0)], 7: [change(5)]})
    values = run.run().recording.columns["y"]
    assert values[:10].tolist() == [0, 2, 4, 6, 8, 10, 12, 14, 19, 24]


@pytest.mark.usefixtures("executor")
def test_values_that_were_set_are_returned_as_events_at_exact_times():
    """Seven sixtieths of a second have no decimal text."""
    run = Steered({0: [change(2.0)], 6: [change(4.0)], 7: [change(5)]})
    values = run.run().recording.columns["y"]
    events = run.control.finish()
    assert [event["time"] for event in events] == [0.0, 0.1, "7/60"]
    repeated = [Event(Fraction(str(e["time"])), {"a": {"k": e["set"]["a.k"]}}) for e in events]
    assert (
        Steered({}).run(repeated, control=False).recording.columns["y"].tolist() == values.tolist()
    )


def test_a_paused_run_waits_for_step_or_resume():
    run = Steered(
        {
            3: [{"command": "pause"}, {"command": "step"}, {"command": "step"}],
            5: [{"command": "resume"}],
        }
    )
    assert run.run().macro_steps == 60
    _, pause, step, more, resume = run.said()
    assert [answer["time"] for answer in (pause, step, more)] == [3 / 60] * 3
    assert (resume["time"], pause["paused"], more["paused"], resume["paused"]) == (
        5 / 60,
        True,
        True,
        False,
    )


def test_the_first_message_lists_the_variables_that_can_be_set():
    run = Steered({})
    run.run()
    about, *rest = run.said()
    assert rest == []
    gain, text, free = about["about"]["adjustable"]
    assert text["name"] == "a.text"
    assert (gain["name"], gain["value"], gain["minimum"], gain["maximum"]) == ("a.k", 1.0, 0.0, 9.0)
    assert free["name"] == "a.u"


def test_an_error_of_a_component_while_a_value_is_set_ends_the_run():
    run = Steered({4: [change(3.0)]}, refuse=3.0)
    outcome = run.run()
    assert (str(outcome.failure), outcome.macro_steps) == ("a: set failed: it does not like it", 4)
    assert run.said()[-1]["error"] == "a: set failed: it does not like it"
    assert run.control.finish() == []


@pytest.mark.parametrize("value", [9.5, -1, True, "2", [1.0], None, 10**400])
def test_an_invalid_value_changes_nothing(value):
    run = Steered({4: [change(value)]})
    assert run.run().recording.columns["y"][-1] == 60
    assert '"k"' in run.said()[-1]["error"]


@pytest.mark.parametrize("value", ["\ud800", "end\0"])
@pytest.mark.parametrize("name", ["a.text", "a.k"])
def test_a_text_that_no_fmu_can_hold_is_refused_and_the_run_goes_on(name, value):
    run = Steered({4: [change(value, name)]})
    assert run.run().macro_steps == 60
    assert "is not allowed" in run.said()[-1]["error"]
    assert run.control.finish() == []


@pytest.fixture
def recorded(tmp_path):
    """A folder with 101 rows of an unfinished run: a number, an integer and a Boolean."""
    columns = [
        Column("x", "<f8", 0, False, ""),
        Column("n", "<i4", 8, False, ""),
        Column("b", "|b1", 12, True, ""),
    ]
    layout = RowLayout(16, columns, [])
    rows = np.zeros(101, layout.dtype)
    rows[TIME], signals = np.arange(101) / 50, rows[SIGNALS]
    signals["x"], signals["n"], signals["b"] = (
        np.arange(101) ** 2,
        np.arange(101),
        np.arange(101) % 2,
    )
    rows.tofile(tmp_path / ROWS_FILE)
    return RowsFile(tmp_path, layout)


def test_rows_are_columns_of_32_bit_floats(recorded):
    feed = RowFeed(recorded, expected_rows=101)
    assert (feed.available(0), feed.available(101), feed.capacity) == (0, 101, 101)
    time, x, n, b = np.frombuffer(feed.read(10, 3), "<f4").reshape(4, 3)
    assert time == pytest.approx([0.2, 0.22, 0.24])
    assert (x.tolist(), n.tolist(), b.tolist()) == ([100, 121, 144], [10, 11, 12], [0, 1, 0])


def test_rows_of_long_runs_are_downsampled(recorded, monkeypatch):
    monkeypatch.setattr(cosim.report.live.session, "MAX_VALUES", 4 * 26)
    feed = RowFeed(recorded, expected_rows=101)
    assert (feed.stride, feed.available(1), feed.available(9), feed.capacity) == (4, 1, 3, 26)
    assert np.frombuffer(feed.read(1, 25), "<f4").reshape(4, 25)[2].tolist() == list(
        range(4, 101, 4)
    )
