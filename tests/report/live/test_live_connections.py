"""Connections to the live page that stay idle, are slow or send too much: the page remains
reachable.
"""

import os
import resource
import socket
import time
from http.client import HTTPConnection
from pathlib import Path
from threading import Thread

import pytest
from live_run import LiveRun, wait_until

from cosim.report.live import server as live_server
from cosim.report.live.server import MAX_CONNECTIONS, MAX_HEAD_LENGTH, LiveServer

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A paused run with its page."""
    run = LiveRun(
        tmp_path_factory.mktemp("paused"), "free_flight", "--stop-time", "3", "--real-time", "0.1"
    )
    run.command("pause")
    yield run
    assert run.end() in (0, 3)


@pytest.fixture
def server():
    """A server alone: requests without the token reach no run."""
    server = LiveServer(0, "secret")
    thread = Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    yield server
    server.shutdown()
    server.server_close()
    thread.join()


def connect(address, data=b""):
    connection = socket.create_connection(address, timeout=20)
    connection.sendall(data)
    return connection


def address(run):
    host, port = run.host.split(":")
    return host, int(port)


def reply(connection):
    """Everything until the server closes the connection."""
    received = b""
    try:
        while data := connection.recv(1 << 16):
            received += data
    except ConnectionResetError:
        pass
    return received


def open_descriptors(run):
    return [int(file.name) for file in Path(f"/proc/{run.process.pid}/fd").iterdir()]


HALF_OPEN = b"GET /chat HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"


@pytest.mark.parametrize(
    "data",
    [b"", b"G", HALF_OPEN, b"POST / HTTP/1.1\r\nContent-Length: 99\r\nExpect: 100-continue\r\n"],
)
def test_the_page_is_reachable_beside_many_idle_connections(run, data):
    connections = [connect(address(run), data) for _ in range(300)]
    assert run.get().status == 200
    assert run.command("pause")["paused"]
    wait_until(lambda: len(open_descriptors(run)) < MAX_CONNECTIONS + 30)
    for connection in connections:
        connection.close()


def test_a_connection_with_the_token_survives_a_flood_of_others(run):
    page = HTTPConnection(run.host, timeout=20)
    page.connect()
    first = page.sock.getsockname()

    def fetch_rows():
        page.request("GET", f"{run.path}rows?first=0&version=-1")
        response = page.getresponse()
        response.read()
        return response.status, page.sock.getsockname()

    assert fetch_rows() == (200, first)
    others = [connect(address(run)) for _ in range(2 * MAX_CONNECTIONS)]
    assert fetch_rows() == (200, first)
    for connection in (page, *others):
        connection.close()


def test_without_free_descriptors_the_server_waits(run):
    """The processor stays free for the run; as soon as descriptors are free, the page is there
    again.
    """
    before = resource.prlimit(run.process.pid, resource.RLIMIT_NOFILE)
    resource.prlimit(
        run.process.pid, resource.RLIMIT_NOFILE, (max(open_descriptors(run)) + 1, before[1])
    )
    connections = [connect(address(run)) for _ in range(20)]
    ticks = processor_ticks(run)
    time.sleep(0.6)
    used = (processor_ticks(run) - ticks) / os.sysconf("SC_CLK_TCK")
    resource.prlimit(run.process.pid, resource.RLIMIT_NOFILE, before)
    assert used < 0.3
    assert run.get().status == 200
    for connection in connections:
        connection.close()


def processor_ticks(run):
    fields = Path(f"/proc/{run.process.pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) + int(fields[12])


@pytest.mark.parametrize("data", [b"", b"GET / HTTP/1.1\r\n", HALF_OPEN])
def test_a_connection_without_a_complete_request_is_ended(server, data, monkeypatch):
    monkeypatch.setattr(live_server, "ADMISSION_TIMEOUT", 0.1)
    assert reply(connect(server.server_address, data)) == b""


def test_a_slow_sender_is_ended_too(server, monkeypatch):
    """Each byte comes in time, the request never does."""
    monkeypatch.setattr(live_server, "ADMISSION_TIMEOUT", 0.3)
    connection = connect(server.server_address, b"GET / HTTP/1.1\r\nX: ")

    def send_slowly():
        for _ in range(400):
            connection.sendall(b"x")
            time.sleep(0.05)

    with pytest.raises(OSError, match=r"pipe|reset"):
        send_slowly()


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"GET / HTTP/1.1\r\nX: " + b"x" * MAX_HEAD_LENGTH, b"431"),
        (b"GET / HTTP/1.1\r\n" + b"X: 0123456789\r\n" * (MAX_HEAD_LENGTH // 10), b"431"),
        (b"GET / HTTP/1.1\r\n" + b"X: \r\n" * 101, b"431"),
        (b"GET /" + b"x" * MAX_HEAD_LENGTH, b""),
        (HALF_OPEN + b"\r\n", b"403"),
        (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + b"\0" * 40 + b"\r\n", b"400"),
        (b"\r\n", b""),
    ],
)
def test_a_head_that_is_too_long_or_no_request_gets_an_error_and_an_end(server, head, status):
    answer = reply(connect(server.server_address, head + b"\r\n"))
    assert (status in answer) if status else answer == b""


def test_the_number_of_connections_is_limited(server):
    connections = [connect(server.server_address) for _ in range(2 * MAX_CONNECTIONS)]
    connections[0].settimeout(20)
    assert connections[0].recv(1) == b""
    assert len(server._admissions) <= MAX_CONNECTIONS
    assert reply(connect(server.server_address, b"GET / HTTP/1.1\r\n\r\n")).startswith(
        b"HTTP/1.1 403"
    )
    for connection in connections:
        connection.close()
