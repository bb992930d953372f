"""The live view of a run: its effect on the result, and access control."""

import html
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from live_run import LiveRun, wait_until

import cosim
from cosim.report.live.live_view import open_browser
from cosim.results import Result

pytestmark = pytest.mark.slow

STOP = 3.0
FORCE = "vessel.external_force.y"


@pytest.fixture(scope="module")
def paused(tmp_path_factory):
    """A run that stands still; nothing that a test asks of it may move it."""
    run = LiveRun(
        tmp_path_factory.mktemp("paused"),
        "free_flight",
        "--stop-time",
        str(STOP),
        "--real-time",
        "0.1",
    )
    assert run.command("pause")["paused"]
    rows = run.count()
    yield run
    assert run.count() == rows
    assert run.end() in (0, 3)
    assert run.run_metadata()["live_events"] == []


@pytest.fixture
def begun(tmp_path):
    """A run that has just started and is slow."""
    run = LiveRun(tmp_path, "free_flight", "--stop-time", str(STOP), "--real-time", "0.1")
    run.command("pause")
    yield run
    run.process.kill()
    run.process.wait()


def values(result):
    return {"time": result.time, **{name: result[name] for name in result}}


def same(one, other):
    return all(
        np.array_equal(mine, its)
        for mine, its in zip(values(one).values(), values(other).values(), strict=True)
    )


# -- what it does
# ------------------------------------------------------------------------------------------


def test_a_step_is_one_macro_step_and_viewing_does_not_change_the_result(begun):
    before = begun.count()
    for more in (1, 2, 3):
        assert begun.command("step")["paused"]
        wait_until(lambda expected=before + more: begun.count() == expected)
    assert begun.end() in (0, 3)
    assert same(Result.from_csv(begun.out / "result.csv"), cosim.run("free_flight", stop_time=STOP))


def test_values_that_were_set_are_events_that_reproduce_the_result(begun):
    assert (
        begun.command("set", name="usv.speed_command", value=0.5)["time"] == begun.rows()[0]["time"]
    )
    before = begun.count()
    for _ in range(7):
        begun.command("step")
    wait_until(lambda: begun.count() == before + 7)
    begun.command("set", name=FORCE, value=-2)
    described = {each["name"]: each["value"] for each in begun.page()["adjustable"]}
    assert (described["usv.speed_command"], described[FORCE]) == (0.5, -2)
    assert begun.end() in (0, 3)
    assert "values were set 2 times while it ran" in begun.output
    events = begun.run_metadata()["live_events"]
    assert [event["set"] for event in events] == [{"usv.speed_command": 0.5}, {FORCE: -2}]
    assert round(events[1]["time"] - events[0]["time"], 9) == 0.07
    result = Result.from_csv(begun.out / "result.csv")
    assert same(result, cosim.run("free_flight", {"/events": events}, stop_time=STOP))
    assert not same(result, cosim.run("free_flight", stop_time=STOP))


def test_the_page_receives_the_rows_of_the_result(begun):
    columns = begun.page()["columns"]
    begun.command("speed", factor=2.0)
    begun.command("resume")
    state, pieces = {"complete": False}, []
    while not state["complete"]:
        state, piece = begun.rows(sum(piece.shape[1] for piece in pieces))
        pieces += [piece] if state["count"] else []
    assert begun.wait() in (0, 3)
    assert len(pieces) > 3  # they came while the run went on
    result = Result.from_csv(begun.out / "result.csv")
    for column, received in zip(columns, np.concatenate(pieces, axis=1), strict=True):
        assert np.array_equal(received, values(result)[column].astype(np.float32)), column


def test_the_speed_is_relative_to_real_time(begun):
    """At a tenth of its speed a run is no further than a tenth of the time that has passed, on a
    busy machine not even there.
    """
    began = time.monotonic()
    before = begun.command("resume")["time"]
    time.sleep(0.5)
    moved = begun.command("pause")["time"] - before
    assert 0 < moved <= 0.1 * (time.monotonic() - began) + 0.01
    assert begun.command("speed", factor=None)["speed"] is None
    begun.command("resume")
    assert begun.wait() in (0, 3)


def test_an_interrupt_ends_a_run_that_is_paused(begun):
    begun.command("set", name=FORCE, value=1.5)
    begun.process.send_signal(signal.SIGINT)
    assert begun.wait() == 130
    about = begun.run_metadata()
    assert (about["failure"], [event["set"] for event in about["live_events"]]) == (
        "interrupted",
        [{FORCE: 1.5}],
    )


def test_the_values_that_were_set_survive_a_killed_run(begun):
    begun.command("set", name=FORCE, value=1.5)
    number = begun.process.pid
    os.kill(
        int(Path(f"/proc/{number}/task/{number}/children").read_text().split()[0]), signal.SIGKILL
    )
    assert begun.wait() == 1
    assert [event["set"] for event in begun.run_metadata()["live_events"]] == [{FORCE: 1.5}]
    assert len(Result.from_csv(begun.out / "result.csv").time)


# -- who is let in
# ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", ["/", "/rows?first=0&version=-1", "/wrong/", "//", "/?token"])
def test_requests_without_the_token_are_refused(paused, path):
    reply = paused.request("GET", path)
    assert (reply.status, reply.body) == (403, b"Forbidden")


@pytest.mark.parametrize("method", ["GET", "POST"])
@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1", "localhost:1", "127.0.0.1:{port}.evil.example", None]
)
def test_another_host_is_refused(paused, method, host):
    """A name that somebody else lets point to this machine is no name of it."""
    host = host and host.format(port=paused.host.rpartition(":")[2])
    body = (
        {"body": b"{}", "Content_Length": "2", "Content_Type": "application/json"}
        if method == "POST"
        else {}
    )
    origin = {"Origin": f"http://{host}"} if method == "POST" else {}
    assert (
        paused.request(
            method,
            f"{paused.path}{'command' if method == 'POST' else ''}",
            **body,
            Host=host,
            **origin,
        ).status
        == 403
    )


def test_the_host_localhost_is_accepted(paused):
    name = paused.host.replace("127.0.0.1", "localhost")
    assert paused.get(Host=name).status == 200
    assert paused.post(b'{"command": "pause"}', Host=name, Origin=f"http://{name}").status == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://{host}", "http://localhost:{port}", None]
)
def test_commands_of_other_pages_are_refused(paused, origin):
    origin = origin and origin.format(host=paused.host, port=paused.host.rpartition(":")[2])
    assert paused.post(b'{"command": "resume"}', Origin=origin).status == 403


def test_requests_for_rows_by_other_pages_are_refused(paused):
    assert paused.get("rows?first=0&version=-1", Origin="http://evil.example").status == 403


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        (b'{"command": "resume"}', {"Content_Type": "text/plain"}, 415),
        (b'{"command": "resume"}', {"Content_Type": None}, 415),
        (b'{"command": "resume"}', {"Content_Length": None}, 411),
        (b'{"command": "resume"}', {"Content_Length": "-1"}, 411),
        (b"", {"Content_Length": str(1 << 20)}, 413),
        (b"no JSON", {}, 400),
        (b'["resume"]', {}, 400),
        (b"[" * 60_000, {}, 400),
        (b'{"command": "set", "value": ' + b"[" * 970 + b"]" * 970 + b"}", {}, 400),
        (b'{"command": "set", "value": [{}]}', {}, 400),
        (b'{"command": {"resume": 1}}', {}, 400),
    ],
)
def test_an_invalid_request_body_is_refused(paused, body, headers, status):
    assert paused.post(body, **headers).status == status


@pytest.mark.parametrize(
    ("message", "error"),
    [
        ({"command": "resum"}, 'unknown command "resum"; did you mean "resume"?'),
        ({}, 'unknown command "None"'),
        (
            {"command": "set", "name": "usv.sped_command", "value": 1},
            'did you mean "usv.speed_command"?',
        ),
        (
            {"command": "set", "name": "usv.waypoint_count", "value": 33},
            '"waypoint_count" must lie in 1.0 ... 32.0, found 33',
        ),
        (
            {"command": "set", "name": "usv.waypoint_count", "value": 2.5},
            "is of type Int32, found 2.5",
        ),
        (
            {"command": "set", "name": "usv.speed_command", "value": "fast"},
            'is of type Float64, found "fast"',
        ),
        (
            {"command": "set", "name": "usv.speed_command", "value": float("nan")},
            "is of type Float64, found NaN",
        ),
        ({"command": "set", "name": "usv.speed_command"}, "is of type Float64, found null"),
        (
            {"command": "set", "name": "vessel.thrust", "value": 1.0},
            '"vessel.thrust" is neither a tunable parameter nor an',
        ),
        (
            {"command": "speed", "factor": 0},
            "the speed must lie in 0.01 ... 1000, or be null; found 0",
        ),
        ({"command": "speed", "factor": True}, "found true"),
        ({"command": "speed", "factor": "1"}, 'found "1"'),
    ],
)
def test_a_command_that_cannot_be_carried_out_gets_an_error(paused, message, error):
    reply = paused.post(json.dumps(message).encode())
    assert reply.status == 400
    assert error in reply.json()["error"]


@pytest.mark.parametrize(
    ("resource", "status"),
    [("run.json", 404), ("../", 404), ("rows", 400), ("rows?first=-1&version=0", 400)],
)
def test_unknown_resources_are_not_found(paused, resource, status):
    assert paused.get(resource).status == status


@pytest.mark.parametrize("method", ["PUT", "DELETE", "OPTIONS", "HEAD"])
def test_other_methods_are_not_supported(paused, method):
    assert paused.request(method, paused.path).status == 501


def test_the_page_may_connect_only_to_its_server_and_cannot_be_framed(paused):
    reply = paused.get()
    policy = reply.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "connect-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert policy.startswith(
        re.search(r'-Policy" content="(.*?)">', html.unescape(reply.body.decode())).group(1)
    )
    assert not [name for name in reply.headers if name.lower().startswith("access-control")]


def refused(*options):
    done = subprocess.run(
        [sys.executable, "-m", "cosim", "run", "free_flight", "--view", *options],
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("options", "error"),
    [
        (["--isolation", "none"], "--view requires a supervised run"),
        (["--sandbox", "strict"], "--view requires a network connection"),
        (["--late", "fail"], "--view cannot be combined with --late fail"),
    ],
)
def test_options_that_exclude_the_live_view_are_refused(options, error):
    code, said = refused(*options)
    assert code == 2
    assert error in said


def test_a_port_that_is_taken_is_refused(paused):
    port = paused.host.rpartition(":")[2]
    assert refused("--view-port", port) == (
        2,
        f"--view cannot listen on 127.0.0.1:{port}: Address already in use\n",
    )


def test_the_address_of_the_page_is_in_no_list_of_processes(tmp_path, monkeypatch):
    """And it is no child of ours, since those of a supervisor end with it."""
    seen = tmp_path / "seen"
    browser = tmp_path / "xdg-open"
    browser.write_text(f'#!/bin/sh\nprintf "%s" "$*" > {seen}.part && mv {seen}.part {seen}\n')
    browser.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    open_browser("http://127.0.0.1:1/secret/", tmp_path)
    wait_until(seen.exists)
    page = Path(seen.read_text())
    assert "secret" not in str(page)
    assert 'url=http://127.0.0.1:1/secret/"' in page.read_text()
    assert page.stat().st_mode & 0o777 == 0o600


def test_a_run_waits_for_the_browser_on_request(tmp_path):
    run = LiveRun(tmp_path, "free_flight", "--stop-time", "0.5", "--real-time", "100", "--wait")
    described = run.page()
    assert described["name"] == "free_flight"
    time.sleep(0.5)
    assert run.process.poll() is None
    assert run.rows()[0]["count"] <= 51
    assert run.wait() in (0, 3)
    assert len(Result.from_csv(run.out / "result.csv").time) == 51
