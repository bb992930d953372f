"""Attacks of FMUs, the outcomes that are expected in each mode, and the table of SECURITY.md that
lists them.

Run this file to write the table.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from pathlib import Path

SECURITY = Path(__file__).parents[3] / "SECURITY.md"
BEGIN, END = "<!-- made by tests/system/faults/attack_table.py -->\n", "<!-- end -->\n"

OPEN, PREVENTED, ENDED = "**possible**", "prevented", "ended with the run"
NAMED, SURVIVED = "rows kept, component named", "the run goes on"
WARNED = "the run goes on, component named"


@dataclass(frozen=True)
class Attack:
    """Attack by a system call, see attacks.c.

    Attributes:
        name: Name of the function in attacks.c.
        text: Description for the table.
        target: "file" or "folder" outside, "process" of the user, "port", "stream", "datagram" or
            "abstract" socket; other texts are passed to the function.
        default: Outcome without sandbox.
        needs: Precondition of the outcome without sandbox: "root", or a property that a "system"
            may lack or refuse to all processes; "" for none.
        alone: The attack ends the run where it is possible.
    """

    name: str
    text: str
    target: str = "-"
    default: str = OPEN
    needs: str = ""
    alone: bool = False


@dataclass(frozen=True)
class Fault:
    """Fault that concerns only the run itself: an order of fault_actions.c.

    Attributes:
        order: Fault in the sixth step of the FMU.
        text: Description for the table.
        words: Message that names the component without sandbox.
        outcome: Outcome for the table without sandbox.
        sandbox: Outcome in a sandbox if it differs.
    """

    order: str
    text: str
    words: str = ""
    outcome: str = SURVIVED
    sandbox: str = ""


FAILED = "lag: fmi2DoStep failed at t = 0.05 s: "
SIGNAL, EXIT = (
    FAILED + "the process was ended by signal ",
    FAILED + "it ended the process with exit code ",
)

CLASSES: dict[str, list[Attack]] = {
    "files of the user": [
        Attack("read_file", "read a private file", "file"),
        Attack("read_users", "read a file of the system (`/etc/passwd`)"),
        Attack("list_folder", "list a folder", "folder"),
        Attack("create_file", "create a file", "file"),
        Attack("append_to_file", "write to a file", "file"),
        Attack("truncate_file", "empty a file by its path", "file"),
        Attack("truncate_by_reading", "empty a file that is opened to read", "file"),
        Attack("delete_file", "delete a file", "file"),
        Attack("rename_file", "rename a file", "file"),
        Attack("link_file", "link a file", "file"),
        Attack("create_symlink", "create a symbolic link", "file"),
        Attack("create_folder", "create a folder", "file"),
        Attack("create_fifo", "create a named pipe", "file"),
        Attack("create_socket_file", "create a socket with a path", "file"),
        Attack("change_mode", "change the mode of a file (`chmod`)", "file"),
        Attack("change_mode_at", "change the mode of a file (`fchmodat`)", "file"),
        Attack("change_owner", "change the owner of a file", "file"),
        Attack("change_times", "change the times of a file (`utimes`)", "file"),
        Attack("change_times_at", "change the times of a file (`utimensat`)", "file"),
        Attack("set_attribute", "set an extended attribute of a file", "file", needs="system"),
        Attack("read_attribute", "read an extended attribute of a file", "file", needs="system"),
        Attack("watch_folder", "monitor accesses to a folder (`inotify`)", "folder"),
        Attack("create_device", "create a device as root", needs="root"),
        Attack(
            "open_by_handle",
            "create a handle of a file (`name_to_handle_at`)",
            "file",
            needs="system",
        ),
    ],
    "environment variables": [
        Attack("environment", "read a variable (`getenv`)"),
        Attack("environment_file", "read the variables from `/proc/self/environ`"),
        Attack("environment_memory", "read the initial environment from the memory of the process"),
    ],
    "processes": [
        Attack("list_processes", "list the processes"),
        Attack("read_environment_of_process", "read the environment of another process", "process"),
        Attack("read_memory", "read the memory of another process", "process", needs="system"),
        Attack("trace_process", "trace another process", "process", needs="system"),
        Attack("kill_importer", "kill cosim", alone=True),
        Attack("outlive_importer", "continue after cosim was killed"),
        Attack("signal_thread", "send a signal (`tgkill`)", "process"),
        Attack("queue_signal", "send a signal (`sigqueue`)", "process"),
        Attack("signal_by_descriptor", "send a signal (`pidfd_send_signal`)", "process"),
        Attack("signal_by_pipe", "send signals through a pipe (`F_SETOWN`)", "process"),
        Attack("change_limits", "change the limits of another process (`prlimit`)", "process"),
        Attack(
            "change_priority", "change the priority of another process (`setpriority`)", "process"
        ),
        Attack("change_io_priority", "change the I/O priority of another process", "process"),
        Attack("change_processors", "change the processor affinity of another process", "process"),
        Attack("change_scheduler", "change the scheduling policy of another process", "process"),
        Attack(
            "offer_to_memory_killer", "raise the out-of-memory score of another process", "process"
        ),
        Attack("kill_process", "kill another process of the user", "process"),
        Attack("raise_limits", "raise its own limits as root", needs="system"),
        Attack("fork_process", "start a process (`fork`)"),
        Attack("fork_by_clone", "start a process (`clone`)"),
        Attack("run_program", "start a program"),
        Attack("leave_process", "leave a process running after the run", default=ENDED),
    ],
    "network and sockets": [
        Attack("tcp", "connect by TCP", "port"),
        Attack("tcp6", "open an IPv6 socket", needs="system"),
        Attack("udp", "send by UDP", "port"),
        Attack("server", "open a server socket"),
        Attack(
            "server_without_bind",
            "open a server socket without an address (`listen` without `bind`)",
        ),
        Attack("local_stream", "connect to a local socket with a path", "stream"),
        Attack("local_datagram", "send to a local socket with a path", "datagram"),
        Attack("abstract_socket", "send to an abstract local socket", "abstract"),
        Attack("socket_pair", "create a pair of sockets"),
        Attack("list_interfaces", "list the network interfaces"),
    ],
    "system objects": [
        Attack("shared_memory", "create shared memory (System V)"),
        Attack("message_queue", "create a message queue (System V)"),
        Attack("semaphores", "create semaphores (System V)"),
        Attack("posix_queue", "create a message queue (POSIX)", "/cosim-attack", needs="system"),
        Attack("posix_memory", "create shared memory (POSIX)", "/cosim-attack", needs="system"),
        Attack("add_key", "add a key to a keyring", needs="system"),
        Attack("find_keyring", "find the keyring of the user", needs="system"),
        Attack("memory_file", "create a file in memory (`memfd_create`)"),
        Attack("user_namespace", "become root of a user namespace", needs="system"),
        Attack("io_ring", "bypass a system call filter (`io_uring`)", needs="system"),
        Attack("kernel_log", "read the kernel log", needs="system"),
        Attack("fixed_addresses", "switch off address randomization"),
    ],
}
ATTACKS = list(chain.from_iterable(CLASSES.values()))

FAULTS = [
    Fault("segv", "read at address 0", SIGNAL + "11", NAMED),
    Fault("deep", "overflow the stack", SIGNAL + "11", NAMED),
    Fault("free_twice", "free a memory block twice", SIGNAL + "6", NAMED),
    Fault("kill", "kill itself", SIGNAL + "9", NAMED),
    Fault("exit_0", "exit with code 0", EXIT + "0", NAMED),
    Fault("loop", "never return", FAILED + "did not return within 0.5 s", NAMED),
    Fault("memory", "use all memory", FAILED + "status 3 (error)", NAMED),
    Fault("fp_traps", "enable floating-point traps", "changed the floating-point mode", WARNED),
    Fault(
        "close_all",
        "close all files of the process",
        "lag: a call that closed the files",
        NAMED,
        SURVIVED,
    ),
    Fault(
        "open_files",
        "open files endlessly",
        "lag: changed the number of free descriptors",
        WARNED,
        SURVIVED,
    ),
    Fault("flood_stdout", "print endlessly"),
    Fault("log_20000", "log endlessly"),
    Fault("print_control", "send control sequences to the terminal", "\\x1b[31mred", "escaped"),
    Fault("log_control", "fake log lines", "WARNING lag: \\x1b[31mred", "escaped"),
    Fault("read_stdin", "wait for keyboard input"),
    Fault(
        "change_folder",
        "change the working directory",
        "lag: changed the working directory",
        WARNED,
        SURVIVED,
    ),
    Fault(
        "change_environment",
        "change the environment",
        "lag: changed the environment",
        WARNED,
        SURVIVED,
    ),
    Fault("ignore_interrupts", "ignore Ctrl-C", "lag: changed what is done upon", WARNED, SURVIVED),
    Fault("thread", "leave a thread running"),
]


def render_table() -> str:
    """Return the table of SECURITY.md."""
    lines = ["| attack of an FMU | default | `--sandbox`, `--sandbox strict` |", "|---|---|---|"]
    for title, attacks in CLASSES.items():
        lines.append(f"| *{title}* | | |")
        lines += [f"| {attack.text} | {attack.default} | {PREVENTED} |" for attack in attacks]
    lines.append("| *the run itself* | | |")
    lines += [
        f"| {fault.text} | {fault.outcome} | {fault.sandbox or fault.outcome} |" for fault in FAULTS
    ]
    return "\n".join(lines) + "\n"


def replace_table(text: str) -> str:
    """Return a document with the present table."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}{render_table()}{END}{after}"


if __name__ == "__main__":
    SECURITY.write_text(replace_table(SECURITY.read_text()))
