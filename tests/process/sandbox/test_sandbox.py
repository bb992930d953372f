"""Forbidden operations of worker processes in a sandbox; each test runs real processes."""

from __future__ import annotations

import json
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
    KEPT_VARIABLES,
    SandboxSettings,
    bubblewrap_command,
    enter_sandbox,
    find_available_sandboxes,
    interpreter_folders,
    landlock,
    probe_restrictions,
    system_call_filter,
)

pytestmark = pytest.mark.slow

AVAILABLE = find_available_sandboxes()
needs_sandbox = pytest.mark.skipif(
    not AVAILABLE.confines_fmus, reason="this system cannot confine FMUs"
)
needs_bubblewrap = pytest.mark.skipif(not AVAILABLE.bubblewrap, reason="no bubblewrap that works")

#: a worker enters the sandbox, tries something, and says what came of it
WORKER = """
import json, os, socket, subprocess, sys
from pathlib import Path
from cosim.process.sandbox import (
    SandboxSettings,
    enter_sandbox,
    interpreter_folders,
    probe_restrictions,
)
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
    """Evaluate an expression in a sandboxed process.

    Return its value or the name of its exception.
    """
    words = [sys.executable, "-c", WORKER, json.dumps(settings, default=str), expression]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def private(tmp_path):
    file = tmp_path / "private.txt"
    file.write_text("secret")
    return file


@needs_sandbox
class TestFiles:
    def test_what_is_not_listed_cannot_be_read(self, private):
        assert worker(f"Path({str(private)!r}).read_text()") == "PermissionError"

    def test_what_is_listed_is_read_and_not_written(self, private, tmp_path):
        assert worker(f"Path({str(private)!r}).read_text()", readable=[tmp_path]) == "secret"
        assert (
            worker(f"Path({str(private)!r}).write_text('mine')", readable=[tmp_path])
            == "PermissionError"
        )
        assert private.read_text() == "secret"

    def test_one_file_can_be_listed(self, private, tmp_path):
        (tmp_path / "other").write_text("other")
        assert worker(f"Path({str(private)!r}).read_text()", readable=[private]) == "secret"
        assert (
            worker(f"Path({str(tmp_path / 'other')!r}).read_text()", readable=[private])
            == "PermissionError"
        )

    def test_writing_works_in_the_temporary_folder_only(self, tmp_path):
        (tmp_path / "temporary").mkdir()
        inside, outside = tmp_path / "temporary" / "file", tmp_path / "file"
        assert (
            worker(f"Path({str(inside)!r}).write_text('mine')", writable=[tmp_path / "temporary"])
            == 4
        )
        assert (
            worker(f"Path({str(outside)!r}).write_text('mine')", writable=[tmp_path / "temporary"])
            == "PermissionError"
        )
        assert not outside.exists()

    @pytest.mark.parametrize(
        "act", ["os.unlink({0!r})", "os.rename({0!r}, {0!r} + '2')", "os.truncate({0!r}, 0)"]
    )
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

    @pytest.mark.parametrize(
        "act",
        ["os.fork()", "subprocess.run(['true'])", "os.posix_spawn('/bin/true', ['true'], {})"],
    )
    def test_no_process_is_started(self, act):
        assert worker(act, readable=["/usr/bin", "/bin"]) == "PermissionError"

    def test_threads_are_started(self):
        code = (
            "(lambda t: (t.start(), t.join(2), "
            "t.is_alive()))(__import__('threading').Thread(target=os.getpid))[2]"
        )
        assert worker(code) is False


def listener(kind: socket.SocketKind) -> socket.socket:
    bound = socket.socket(socket.AF_INET, kind)
    bound.bind(("127.0.0.1", 0))
    return bound


SEND = "socket.socket(type=socket.SOCK_DGRAM).sendto(b'out', ('127.0.0.1', {port}))"


@needs_sandbox
@pytest.mark.parametrize("family", ["AF_INET", "AF_INET6", "AF_UNIX", "AF_NETLINK"])
@pytest.mark.parametrize("kind", ["SOCK_STREAM", "SOCK_DGRAM", "SOCK_RAW"])
def test_no_socket_is_opened(family, kind):
    assert worker(f"socket.socket(socket.{family}, socket.{kind})") == "PermissionError"


@needs_sandbox
class TestEnvironment:
    def test_only_a_few_variables_remain(self, monkeypatch):
        monkeypatch.setenv("SECRET", "swordfish")
        monkeypatch.setenv("LC_ALL", "C.UTF-8")
        found = worker("dict(os.environ)")
        assert found["LC_ALL"] == "C.UTF-8"
        assert found.keys() <= {*KEPT_VARIABLES, "HOME"}

    def test_home_is_the_folder_for_temporary_files(self, monkeypatch, tmp_path):
        monkeypatch.setenv("TMPDIR", str(tmp_path))
        assert worker("(os.environ['HOME'], os.environ['TMPDIR'])") == [str(tmp_path)] * 2

    def test_no_value_remains_in_memory(self, monkeypatch):
        """All memory of the process is searched, for the text itself and not for the pattern, which
        is in memory too.
        """
        monkeypatch.setenv("SECRET", "swordfish-in-memory")
        assert searched("pass") > 0
        assert searched("clear_environment()") == 0


#: an environment is cleared, or not, and a text is searched in all memory; the text is put together
#: from its letters
SEARCH = """
import ctypes, os
from cosim.process.sandbox import clear_environment
{act}
found, secret = 0, [ord(c) for c in "yromem-ni-hsifdrows"[::-1]]
regions = [line.split() for line in open("/proc/self/maps")]
with open("/proc/self/mem", "rb", 0) as memory:
    for addresses, permissions, *_ in regions:
        if permissions[:2] != "rw":
            continue
        begin, end = (int(word, 16) for word in addresses.split("-"))
        memory.seek(begin)
        content = memory.read(end - begin)
        first = content.find(bytes(secret[:8]))
        found += first >= 0 and content[first + 8 : first + 19] == bytes(secret[8:])
        ctypes.memset(id(content) + bytes.__basicsize__ - 1, 0, len(content))
print(found)
"""


def searched(act: str) -> int:
    """Return the number of memory regions with the secret text after an action."""
    command = [sys.executable, "-c", SEARCH.format(act=act)]
    return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


class TestLimits:
    def test_memory_ends_where_it_is_told(self):
        assert worker("len(bytearray(300 << 20))", memory=200 << 20) == "MemoryError"
        assert worker("len(bytearray(100 << 20))", memory=200 << 20) == 100 << 20

    def test_open_files_end_where_they_are_told(self):
        assert worker("[open(os.devnull) for n in range(100)]", open_files=50) == "OSError"

    def test_files_do_not_grow_without_end(self, tmp_path):
        assert (
            worker(
                f"Path({str(tmp_path / 'file')!r}).write_bytes(bytes(2000))",
                file_size=1000,
                writable=[tmp_path],
            )
            == "OSError"
        )

    def test_processor_time_ends_the_process(self):
        words = [sys.executable, "-c", WORKER, '{"cpu_seconds": 1}', "[0 for _ in iter(int, 1)]"]
        assert subprocess.run(words, check=False, timeout=60).returncode in (
            -signal.SIGKILL,
            -signal.SIGXCPU,
        )

    def test_nothing_can_be_read_from_standard_input(self):
        words = [sys.executable, "-c", WORKER, "{}", "sys.stdin.read()"]
        done = subprocess.run(
            words, capture_output=True, text=True, input="typed", check=False, timeout=60
        )
        assert json.loads(done.stdout) == ""

    @needs_sandbox
    def test_restrictions_in_force_are_reported(self):
        """A confined process cannot list the root folder."""
        code = "__import__('dataclasses').asdict(probe_restrictions())"
        found = worker(code, memory=2 << 30, open_files=99)
        assert (found["files_confined"], found["network_closed"]) == (True, True)
        assert (found["own_session"], found["no_new_privileges"], found["open_files"]) == (
            True,
            True,
            99,
        )
        assert found["memory"] > 2 << 30

    def test_a_free_process_claims_nothing(self):
        free = subprocess.run(
            [
                sys.executable,
                "-c",
                "from cosim.process.sandbox import probe_restrictions; print(probe_restrictions())",
            ],
            capture_output=True,
            text=True,
            check=True,
        )
        assert "files_confined=False, network_closed=False" in free.stdout


PARENT = """
import os, subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1]], stdout=subprocess.PIPE, text=True)
print(child.stdout.readline().strip(), flush=True)
os.kill(os.getpid(), 9)
"""
CHILD = """
import os, time
from cosim.process.sandbox import SandboxSettings, enter_sandbox
enter_sandbox(SandboxSettings(confine=False, parent=os.getppid()))
print(os.getpid(), flush=True)
time.sleep(100)
"""


def test_a_worker_does_not_outlive_its_parent():
    done = subprocess.run(
        [sys.executable, "-c", PARENT, CHILD],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    worker_id = int(done.stdout)
    ended = time.monotonic() + 10
    while Path(f"/proc/{worker_id}").exists() and time.monotonic() < ended:
        time.sleep(0.02)
    assert (
        not Path(f"/proc/{worker_id}").exists()
        or "Z" in Path(f"/proc/{worker_id}/stat").read_text()
    )


@needs_sandbox
def test_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="nowhere does not exist"):
        enter_sandbox(SandboxSettings(readable=(tmp_path / "nowhere",)))
    assert not probe_restrictions().files_confined


def test_confinement_that_the_kernel_lacks_is_refused_before_anything_is_changed(monkeypatch):
    monkeypatch.setattr(landlock, "abi_version", lambda: 0)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    with pytest.raises(InputError, match=r"Landlock is needed \(Linux 5.13"):
        enter_sandbox(SandboxSettings())
    assert resource.getrlimit(resource.RLIMIT_AS) == limits


@needs_sandbox
def test_a_missing_system_call_filter_is_refused(monkeypatch):
    monkeypatch.setattr(system_call_filter, "is_available", lambda: False)
    with pytest.raises(InputError, match="a system call filter is needed"):
        enter_sandbox(SandboxSettings())


class TestModuleFolders:
    """Folders of Python modules that a sandboxed process may read."""

    @pytest.fixture
    def folder(self, tmp_path, monkeypatch):
        package = tmp_path / "modules/package"
        package.mkdir(parents=True)
        (package / "__init__.py").touch()
        (package / "data.bin").touch()
        (tmp_path / "modules/module.py").touch()
        monkeypatch.setenv("PYTHONPATH", str(tmp_path / "modules"))
        monkeypatch.setattr("sys.path", [*sys.path, str(tmp_path / "modules")])
        return tmp_path / "modules"

    def test_a_folder_of_packages_is_readable(self, folder):
        (folder / "namespace/inner").mkdir(parents=True)
        (folder / "namespace/inner/__init__.py").touch()
        (folder / "package-1.0.dist-info").mkdir()
        (folder / "package-1.0.dist-info/RECORD").touch()
        assert folder in interpreter_folders()

    @pytest.mark.parametrize(
        "other", ["notes.txt", ".ssh/id_rsa", "namespace/deep/letter.odt", ".netrc"]
    )
    def test_a_folder_in_pythonpath_with_other_files_is_refused(self, folder, other):
        (folder / other).parent.mkdir(parents=True, exist_ok=True)
        (folder / other).touch()
        with pytest.raises(InputError, match=rf'"{folder}" in PYTHONPATH holds "{other}"'):
            interpreter_folders()

    def test_a_folder_of_a_script_with_other_files_is_not_readable(self, folder, monkeypatch):
        (folder / "notes.txt").touch()
        monkeypatch.delenv("PYTHONPATH")
        assert folder not in interpreter_folders()

    def test_the_own_packages_are_readable(self):
        assert landlock.__file__ is not None
        assert any(
            Path(landlock.__file__).is_relative_to(folder) for folder in interpreter_folders()
        )


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
            (
                f"import subprocess, sys; subprocess.Popen([sys.executable, '-c', {child!r}], "
                "start_new_session=True)"
            ),
            writable=[tmp_path],
        )
        assert done.returncode == 0, done.stderr
        time.sleep(1)
        assert not late.exists()


def test_strict_mode_without_bubblewrap_is_refused(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match="the strict sandbox needs bubblewrap"):
        bubblewrap_command(["true"], [])
