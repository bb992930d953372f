"""Attacks of FMUs on files, processes and resources outside: each one succeeds without a sandbox
and fails in it.

All attacks that return are made by one FMU in one run per mode. An attack has reached its target if
its call succeeded, or if the target has changed.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from attack_table import (
    ATTACKS,
    BEGIN,
    ENDED,
    FAULTS,
    NAMED,
    OPEN,
    SECURITY,
    Attack,
    Fault,
    replace_table,
)
from command_runner import CommandResult, CommandRunner
from fault_fmu import STEP_COUNT, FaultFmus, lag_output, scenario

from cosim.process.sandbox import find_available_sandboxes

AVAILABLE = find_available_sandboxes()
MODES = {
    "default": [],
    "sandbox": ["--sandbox"],
    "strict": ["--sandbox", "strict"],
}
ALL = STEP_COUNT + 1
needs_sandbox = pytest.mark.skipif(
    not AVAILABLE.confines_fmus, reason="this system cannot confine FMUs"
)
needs_bubblewrap = pytest.mark.skipif(not AVAILABLE.bubblewrap, reason="no bubblewrap that works")
SANDBOXES = [
    pytest.param("sandbox", marks=needs_sandbox),
    pytest.param("strict", marks=[needs_sandbox, needs_bubblewrap]),
]


@dataclass
class Targets:
    """Files, a process and servers of the user, outside the folders of a run."""

    folder: Path
    process: subprocess.Popen[bytes]
    port: socket.socket
    datagrams: socket.socket
    addresses: dict[str, str]
    sockets: dict[str, socket.socket] = field(default_factory=dict)

    def of(self, attack: Attack) -> str:
        """Return the target of an attack."""
        known = {
            "file": str(self.folder / attack.name),
            "folder": str(self.folder),
            "process": str(self.process.pid),
            "port": str(self.port.getsockname()[1]),
            **self.addresses,
        }
        return known.get(attack.target, attack.target)

    def state(self) -> dict[str, object]:
        """Return the state of the targets by the names of the attacks that change it."""
        files = {
            path.name: file_state(path)
            for path in self.folder.iterdir()
            if path.suffix != ".socket"
        }
        return {**files, **process_state(self.process)}

    def received(self) -> set[str]:
        """Return the names of the attacks by which something has arrived at the servers."""
        arrived = set()
        servers = {"tcp": self.port, "udp": self.datagrams, "local_stream": self.sockets["stream"]}
        servers |= {
            "local_datagram": self.sockets["datagram"],
            "abstract_socket": self.sockets["abstract"],
        }
        for name, server in servers.items():
            with suppress(BlockingIOError):
                server.accept()[0].close() if server.type == socket.SOCK_STREAM else server.recv(10)
                arrived.add(name)
        return arrived


def file_state(path: Path) -> tuple[object, ...]:
    status = path.lstat()
    content = path.read_bytes() if path.is_file() else b""
    return (
        status.st_mode,
        status.st_nlink,
        status.st_mtime_ns,
        status.st_uid,
        content,
        os.listxattr(path, follow_symlinks=False),
    )


def process_state(process: subprocess.Popen[bytes]) -> dict[str, object]:
    """Return the state of a process by the names of the attacks that change it."""
    if process.poll() is not None:
        return {}
    import resource

    return {
        "change_limits": resource.prlimit(process.pid, resource.RLIMIT_NOFILE),
        "change_priority": os.getpriority(os.PRIO_PROCESS, process.pid),
        "change_scheduler": os.sched_getscheduler(process.pid),
        "change_processors": len(os.sched_getaffinity(process.pid)) > 1,
        "offer_to_memory_killer": Path(f"/proc/{process.pid}/oom_score_adj").read_text(),
    }


@pytest.fixture(scope="module")
def make_targets(tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    with ExitStack() as stack:

        def make() -> Targets:
            folder = tmp_path_factory.mktemp("outside")
            for attack in ATTACKS:
                if attack.target == "file":
                    (folder / attack.name).write_text("secret")
            with suppress(OSError):  # file systems without attributes
                os.setxattr(folder / "read_attribute", "user.attack", b"secret")
            process = stack.enter_context(
                subprocess.Popen([sys.executable, "-c", "import time; time.sleep(300)"])
            )
            stack.callback(process.kill)
            port, datagrams = (
                stack.enter_context(socket.socket(type=kind))
                for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM)
            )
            port.bind(("127.0.0.1", 0))
            datagrams.bind(port.getsockname())
            addresses = {
                "stream": str(folder / "s.socket"),
                "datagram": str(folder / "d.socket"),
                "abstract": str(folder),
            }
            targets = Targets(folder, process, port, datagrams, addresses)
            for name, address in addresses.items():
                kind = socket.SOCK_STREAM if name == "stream" else socket.SOCK_DGRAM
                targets.sockets[name] = stack.enter_context(socket.socket(socket.AF_UNIX, kind))
                targets.sockets[name].bind("\0" * (name == "abstract") + address)
            for server in (port, targets.sockets["stream"]):
                server.listen(9)
            for server in (port, datagrams, *targets.sockets.values()):
                server.setblocking(False)
            return targets

        yield make


@dataclass
class Outcome:
    """Outcome of all attacks in one mode.

    Attributes:
        done: The run.
        answers: What each attack found: "reached" or an error.
        changed: Names of the attacks whose targets have changed.
    """

    done: CommandResult
    answers: dict[str, str]
    changed: set[str]

    def reached(self, name: str) -> bool:
        """Return whether an attack has reached its target."""
        return self.answers[name] == "reached" or name in self.changed


@pytest.fixture(scope="module")
def outcomes(fault_libraries, make_targets, runner, tmp_path_factory):
    """Function that returns the outcome of all attacks in a mode, in which they are made once."""
    known: dict[str, Outcome] = {}

    def outcome(mode: str) -> Outcome:
        if mode not in known:
            attacks = [attack for attack in ATTACKS if mode != "default" or not attack.alone]
            known[mode] = attack_all(
                mode,
                attacks,
                make_targets(),
                fault_libraries,
                runner,
                tmp_path_factory.mktemp("run"),
            )
        return known[mode]

    return outcome


def attack_all(
    mode: str,
    attacks: list[Attack],
    targets: Targets,
    libraries: dict[int, Path],
    runner: CommandRunner,
    folder: Path,
) -> Outcome:
    before = targets.state()
    orders = "".join(f"attack {attack.name} {targets.of(attack)}\n" for attack in attacks)
    fmu = FaultFmus(libraries, folder)(2, "DoStep 6 attack", attacks=orders)
    done = runner.simulate(folder, fmu, *MODES[mode])
    answers = dict(re.findall(r"^attack (\w+): (.*)$", done.err, re.MULTILINE))
    after = targets.state()
    different = {
        name.removesuffix(".new")
        for name in before.keys() | after.keys()
        if before.get(name) != after.get(name)
    }
    if targets.process.poll() is not None:
        different |= {"kill_process"}
    return Outcome(done, answers, (different & answers.keys()) | targets.received())


@pytest.mark.parametrize(
    "attack", [each for each in ATTACKS if not each.alone], ids=lambda each: each.name
)
def test_without_a_sandbox_an_attack_has_its_documented_outcome(outcomes, attack):
    """Control: the attacks work, so that they show what a sandbox prevents."""
    outcome = outcomes("default")
    if attack.needs == "root" and os.geteuid() != 0:
        pytest.skip("an ordinary user has no right to it")
    if attack.needs == "system" and not outcome.reached(attack.name):
        pytest.skip(f"this system refuses it to all processes: {outcome.answers[attack.name]}")
    assert outcome.reached(attack.name), outcome.answers[attack.name]
    if attack.default == ENDED:
        assert outcome.done.processes == []


@pytest.mark.parametrize(
    "attack", [each for each in ATTACKS if each.alone], ids=lambda each: each.name
)
def test_without_a_sandbox_an_attack_ends_the_command(fmus, runner, tmp_path, attack):
    done = runner.simulate(
        tmp_path, fmus(2, "DoStep 6 attack", attacks=f"attack {attack.name} -\n")
    )
    assert (attack.default, done.code) == (OPEN, -signal.SIGKILL)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda each: each.name)
@pytest.mark.parametrize("mode", SANDBOXES)
def test_a_sandbox_prevents_the_attack(outcomes, attack, mode):
    outcome = outcomes(mode)
    assert not outcome.reached(attack.name), outcome.answers


@pytest.mark.parametrize("mode", ["default", *SANDBOXES])
def test_the_run_with_the_attacks_ends_as_without_them(outcomes, mode):
    done = outcomes(mode).done
    assert (done.code, done.processes, done.temporary_files) == (0, [], []), done.err
    assert [row["y"] for row in done.rows] == [lag_output(n) for n in range(ALL)]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.order)
@pytest.mark.parametrize("mode", ["default", pytest.param("sandbox", marks=needs_sandbox)])
def test_a_fault_is_contained_and_attributed(fmus, runner, tmp_path, fault: Fault, mode):
    deadlines = (
        {"load": 10.0, "initialization": 10.0, "step": 0.5, "end": 10.0}
        if fault.order == "loop"
        else None
    )
    file = scenario(tmp_path, fmus(2, f"DoStep 6 {fault.order}"), deadlines)
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report", *MODES[mode])
    outcome = fault.sandbox if mode == "sandbox" and fault.sandbox else fault.outcome
    assert done.code == (1 if outcome == NAMED else 0), done.err
    assert len(done.rows) >= (6 if outcome == NAMED else ALL)
    assert outcome != fault.outcome or fault.words in done.err
    assert len(done.err) < 200_000
    assert (done.processes, done.temporary_files) == ([], [])


def test_the_table_of_the_document_is_that_of_the_tests():
    text = SECURITY.read_text()
    assert BEGIN in text
    assert replace_table(text) == text
    assert len(ATTACKS) + len(FAULTS) >= 70
