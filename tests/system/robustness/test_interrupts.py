"""Ctrl-C at any stage: exit code 130, one word, the rows until then, and nothing left behind."""

from __future__ import annotations

import json
import signal
import time

import pytest
from command_folder import TICKER, CommandFolder

import cosim

RUN = ("--output-dir", "out")


def entry(name: str) -> dict[str, str]:
    return {"name": name, "python": f"{TICKER}:{name}"}


def interrupted(
    workplace: CommandFolder, place: str, *options: str, times: int = 1, **scenario: object
) -> float:
    """Interrupt a run at a place; the time (s) it took to end."""
    process = workplace.start("run", workplace.scenario(0.5, **scenario), *RUN, *options)
    assert workplace.wait_for_file(f"reached-{place}"), process.communicate()
    began = time.monotonic()
    for _ in range(times):
        process.send_signal(signal.SIGINT)
        time.sleep(0.2)
    _, errors = process.communicate(timeout=30)
    taken = time.monotonic() - began
    assert process.returncode == 130, errors
    assert errors.splitlines()[-1] == "interrupted"
    assert "Traceback" not in errors
    assert workplace.leftovers() == []
    return taken


def rows(workplace: CommandFolder) -> int:
    file = workplace.out / "result.csv"
    return len(cosim.Result.from_csv(file).time) if file.exists() else 0


@pytest.mark.parametrize(
    ("isolation", "place", "kept"),
    [("run", "load", 0), ("run", "initialization", 0), ("run", "step", 20), ("none", "step", 20)],
)
def test_while_a_component_is_at_work(workplace, isolation, place, kept):
    interrupted(workplace, place, "--isolation", isolation, arguments={"slow": place})
    assert rows(workplace) == kept


@pytest.mark.parametrize(
    ("place", "more"), [("kpi", {}), ("figure", {"figures": [entry("slow_figure")]})]
)
def test_when_all_rows_are_there(workplace, place, more):
    kpis = [entry("row_count"), *([entry("slow_kpi")] if place == "kpi" else [])]
    interrupted(workplace, place, kpis=kpis, **more)
    assert rows(workplace) == 51
    assert json.loads((workplace.out / "kpis.json").read_text()) == {"row_count.number": 51}


def test_a_component_that_does_not_listen_is_ended_after_a_while(workplace):
    assert 2.5 < interrupted(workplace, "stubborn", arguments={"slow": "stubborn"}) < 8
    assert rows(workplace) == 20
    assert json.loads((workplace.out / "run.json").read_text())["failure"] == "interrupted"


def test_a_second_interrupt_does_not_ask(workplace):
    assert interrupted(workplace, "stubborn", times=2, arguments={"slow": "stubborn"}) < 2.5
    assert rows(workplace) == 20


def test_the_end_of_the_terminal_is_no_loss(workplace):
    """SIGTERM and SIGHUP, as from `timeout` or a closed terminal, count as an interrupt."""
    process = workplace.start("run", workplace.scenario(), *RUN)
    assert workplace.wait_for_file("started")
    time.sleep(0.3)
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    assert rows(workplace) > 1
    assert workplace.leftovers() == []
