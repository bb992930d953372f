"""Forbidden operations of worker processes in a sandbox; each test runs real processes."""

from __future__ import annotations

import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cosim.core.errors import InputError
from cosim.process.sandbox import (
    SandboxSettings,
    bubblewrap_command,
    enter_sandbox,
    find_available_sandboxes,
    interpreter_folders,
    landlock,
    probe_restrictions,
)

AVAILABLE = find_available_sandboxes()
needs_landlock = pytest.mark.skipif(not AVAILABLE.landlock, reason="this kernel has no Landlock")
needs_closed_tcp = pytest.mark.skipif(AVAILABLE.landlock < landlock.NETWORK_ABI, reason="Landlock without TCP rules")
needs_bubblewrap = pytest.mark.skipif(not AVAILABLE.bubblewrap, reason="no bubblewrap that works")

#: a worker enters the sandbox, tries something, and says what came of it
WORKER = """
import json, os, socket, subprocess, sys
from pathlib import Path
from cosim.process.sandbox import SandboxSettings, enter_sandbox, interpreter_folders, probe_restrictions
settings = json.loads(sys.argv[1])
for kind in ("readable", "writable"):
    settings[kind] = tuple(Path(p) for p in settings.get(kind, ()))
if settings.pop("interpreter", True):
    settings["readable"] += interpreter_folders()
enter_sandbox(SandboxSettings(**settings))
try:
    outcome = eval(sys.argv[2])
except BaseException as error:
    outcome = type(error).__name__
print(json.dumps(outcome, default=str))
"""


def worker(expression: str, **settings: object) -> object:
    """Evaluate an expression in a sandboxed process; return its value or the name of its exception."""
    words = [sys.executable, "-c", WORKER, json.dumps(settings, default=str), expression]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def private(tmp_path):
    file = tmp_path / "private.txt"
    file.write_text("secret")
    return file


@needs_landlock
class TestFiles:
    def test_what_is_not_listed_cannot_be_read(self, private):
        assert worker(f"Path({str(private)!r}).read_text()") == "PermissionError"

    def test_what_is_listed_is_read_and_not_written(self, private, tmp_path):
        assert worker(f"Path({str(private)!r}).read_text()", readable=[tmp_path]) == "secret"
        assert worker(f"Path({str(private)!r}).write_text('mine')", readable=[tmp_path]) == "PermissionError"
        assert private.read_text() == "secret"

    def test_one_file_can_be_listed(self, private, tmp_path):
        (tmp_path / "other").write_text("other")
        assert worker(f"Path({str(private)!r}).read_text()", readable=[private]) == "secret"
        assert worker(f"Path({str(tmp_path / 'other')!r}).read_text()", readable=[private]) == "PermissionError"

    def test_writing_works_in_the_temporary_folder_only(self, tmp_path):
        (tmp_path / "temporary").mkdir()
        inside, outside = tmp_path / "temporary" / "file", tmp_path / "file"
        assert worker(f"Path({str(inside)!r}).write_text('mine')", writable=[tmp_path / "temporary"]) == 4
        assert worker(f"Path({str(outside)!r}).write_text('mine')", writable=[tmp_path / "temporary"]) == "PermissionError"
        assert not outside.exists()

    @pytest.mark.parametrize("act", ["os.unlink({0!r})", "os.rename({0!r}, {0!r} + '2')", "os.truncate({0!r}, 0)"])
    def test_files_outside_are_not_removed_moved_or_cut(self, private, act):
        assert worker(act.format(str(private))) == "PermissionError"
        assert private.read_text() == "secret"

    def test_programs_outside_are_not_started(self, tmp_path):
        program = tmp_path / "program"
        program.write_text("#!/bin/sh\n")
        program.chmod(0o755)
        assert worker(f"os.posix_spawn({str(program)!r}, ['p'], {{}})") == "PermissionError"

    def test_libraries_inside_still_load(self):
        assert worker("__import__('numpy').ones(3).sum()", memory=4 << 30) == 3.0

    def test_children_are_confined_like_their_parent(self, private):
        code = f"open({str(private)!r})"
        call = f"subprocess.run([sys.executable, '-c', {code!r}], capture_output=True).stderr.decode()"
        assert "PermissionError" in str(worker(call, readable=["/usr/bin", "/bin", Path(sys.executable).parent]))


def listener(kind: socket.SocketKind) -> socket.socket:
    bound = socket.socket(socket.AF_INET, kind)
    bound.bind(("127.0.0.1", 0))
    if kind == socket.SOCK_STREAM:
        bound.listen()
    return bound


CONNECT = "socket.create_connection(('127.0.0.1', {port}), 2) and 'connected'"
SEND = "socket.socket(type=socket.SOCK_DGRAM).sendto(b'out', ('127.0.0.1', {port}))"


@needs_closed_tcp
class TestNetwork:
    def test_tcp_is_closed_unless_asked_for(self):
        with listener(socket.SOCK_STREAM) as server:
            connect = CONNECT.format(port=server.getsockname()[1])
            assert worker(connect) == "PermissionError"
            assert worker(connect, network=True) == "connected"

    def test_no_server_can_be_opened(self):
        assert worker("socket.create_server(('127.0.0.1', 0))") == "PermissionError"

    def test_udp_is_not_blocked_by_landlock(self):
        """A documented limit of Landlock; the strict mode has no such limit."""
        with listener(socket.SOCK_DGRAM) as server:
            assert worker(SEND.format(port=server.getsockname()[1])) == 3

    @pytest.mark.skipif(AVAILABLE.landlock < landlock.SCOPE_ABI, reason="Landlock without signals")
    def test_processes_outside_get_no_signals(self):
        assert worker(f"os.kill({os.getpid()}, 0)") == "PermissionError"


class TestLimits:
    def test_memory_ends_where_it_is_told(self):
        assert worker("len(bytearray(300 << 20))", memory=200 << 20) == "MemoryError"
        assert worker("len(bytearray(100 << 20))", memory=200 << 20) == 100 << 20

    def test_open_files_end_where_they_are_told(self):
        assert worker("[open(os.devnull) for n in range(100)]", open_files=50) == "OSError"

    def test_files_do_not_grow_without_end(self, tmp_path):
        assert (
            worker(f"Path({str(tmp_path / 'file')!r}).write_bytes(bytes(2000))", file_size=1000, writable=[tmp_path]) == "OSError"
        )

    def test_processor_time_ends_the_process(self):
        words = [sys.executable, "-c", WORKER, '{"cpu_seconds": 1}', "[0 for _ in iter(int, 1)]"]
        assert subprocess.run(words, check=False, timeout=60).returncode in (-signal.SIGKILL, -signal.SIGXCPU)

    def test_nothing_can_be_read_from_standard_input(self):
        words = [sys.executable, "-c", WORKER, "{}", "sys.stdin.read()"]
        done = subprocess.run(words, capture_output=True, text=True, input="typed", check=False, timeout=60)
        assert json.loads(done.stdout) == ""

    def test_restrictions_in_force_are_reported(self):
        """A confined process cannot list the root folder."""
        code = "__import__('dataclasses').asdict(probe_restrictions())"
        found = worker(code, memory=2 << 30, open_files=99, confine="available")
        assert found["files_confined"] is (AVAILABLE.landlock > 0)
        assert found["tcp_closed"] is (AVAILABLE.landlock >= landlock.NETWORK_ABI)
        assert (found["own_session"], found["no_new_privileges"], found["open_files"]) == (True, True, 99)
        assert found["memory"] > 2 << 30

    def test_a_free_process_claims_nothing(self):
        free = subprocess.run(
            [sys.executable, "-c", "from cosim.process.sandbox import probe_restrictions; print(probe_restrictions())"],
            capture_output=True,
            text=True,
            check=True,
        )
        assert "files_confined=False, tcp_closed=False" in free.stdout


PARENT = """
import os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1]], stdout=subprocess.PIPE, text=True)
print(child.stdout.readline().strip(), flush=True)
os.kill(os.getpid(), 9)
"""
CHILD = """
import os, time
from cosim.process.sandbox import SandboxSettings, enter_sandbox
enter_sandbox(SandboxSettings(confine="never", parent=os.getppid()))
print(os.getpid(), flush=True)
time.sleep(100)
"""


def test_a_worker_does_not_outlive_its_parent():
    done = subprocess.run([sys.executable, "-c", PARENT, CHILD], capture_output=True, text=True, check=False, timeout=60)
    worker_id = int(done.stdout)
    ended = time.monotonic() + 10
    while Path(f"/proc/{worker_id}").exists() and time.monotonic() < ended:
        time.sleep(0.02)
    assert not Path(f"/proc/{worker_id}").exists() or "Z" in Path(f"/proc/{worker_id}/stat").read_text()


@needs_landlock
def test_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="nowhere does not exist"):
        enter_sandbox(SandboxSettings(readable=(tmp_path / "nowhere",)))
    assert not probe_restrictions().files_confined


def test_confinement_that_the_kernel_lacks_is_refused_before_anything_is_changed(monkeypatch):
    monkeypatch.setattr(landlock, "abi_version", lambda: 0)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.raises(InputError, match=r"Landlock is needed \(Linux 5.13"):
        enter_sandbox(SandboxSettings(confine="required"))
    assert resource.getrlimit(resource.RLIMIT_AS) == limits


@needs_landlock
def test_a_network_that_the_kernel_cannot_close_is_refused(monkeypatch):
    monkeypatch.setattr(landlock, "abi_version", lambda: 3)
    with pytest.raises(InputError, match="needs Landlock 4"):
        enter_sandbox(SandboxSettings(confine="required"))


def strict(code: str, **folders: list[Path]) -> subprocess.CompletedProcess[str]:
    """Run a Python program in strict mode."""
    readable = [*interpreter_folders(), *folders.get("readable", [])]
    words = bubblewrap_command([sys.executable, "-c", code], readable, folders.get("writable", []))
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)


@needs_bubblewrap
class TestStrict:
    def test_nothing_leaves_by_udp_either(self):
        with listener(socket.SOCK_DGRAM) as server:
            server.settimeout(0.3)
            sent = strict(f"import socket; {SEND.format(port=server.getsockname()[1])}")
            assert sent.returncode == 0, sent.stderr
            with pytest.raises(TimeoutError):
                server.recv(10)

    def test_private_files_do_not_exist_there(self, private):
        assert "FileNotFoundError" in strict(f"open({str(private)!r})").stderr

    def test_the_temporary_folder_is_shared_and_nothing_else_written(self, tmp_path):
        done = strict(f"open({str(tmp_path / 'file')!r}, 'w').write('mine')", writable=[tmp_path])
        assert (done.returncode, (tmp_path / "file").read_text()) == (0, "mine")
        assert strict(f"open({str(tmp_path / 'file')!r}, 'w')", readable=[tmp_path]).returncode == 1

    def test_orphans_end_with_the_worker(self, tmp_path):
        """A grandchild in another session would write a file after half a second."""
        late = tmp_path / "late"
        child = f"import time; time.sleep(0.5); open({str(late)!r}, 'w')"
        done = strict(
            f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {child!r}], start_new_session=True)",
            writable=[tmp_path],
        )
        assert done.returncode == 0, done.stderr
        time.sleep(1)
        assert not late.exists()


def test_strict_mode_without_bubblewrap_is_refused(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="the strict sandbox needs bubblewrap"):
        bubblewrap_command(["true"], [])
