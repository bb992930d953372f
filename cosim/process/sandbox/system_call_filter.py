"""System call filter (Linux seccomp) against calls that reach beyond own files and memory.

The filter is a program of the Berkeley Packet Filter (BPF), which the kernel executes at each
system call. Constants are from linux/filter.h, linux/seccomp.h and linux/audit.h, numbers of calls
from the tables of both architectures.
"""

import ctypes
import errno
import os
import struct
import sys
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import NamedTuple

#: refused calls by the resource that they reach: name, number on x86_64, number on aarch64 ("-":
#: the call does not exist there)
DENIED_CALLS = {
    "network and local sockets": "socket 41 198, socketpair 53 199",
    "new processes and programs": "fork 57 -, vfork 58 -, execve 59 221, execveat 322 281",
    "owners, modes, times and attributes of files": """
        chmod 90 -, fchmod 91 52, fchmodat 268 53, fchmodat2 452 452, chown 92 -,
        fchown 93 55, lchown 94 -, fchownat 260 54, utime 132 -, utimes 235 -,
        futimesat 261 -, utimensat 280 88, setxattr 188 5, lsetxattr 189 6, fsetxattr 190 7,
        getxattr 191 8, lgetxattr 192 9, fgetxattr 193 10, listxattr 194 11,
        llistxattr 195 12, flistxattr 196 13, removexattr 197 14, lremovexattr 198 15,
        fremovexattr 199 16""",
    "files past the confinement": """
        truncate 76 45, mknod 133 -, mknodat 259 33, name_to_handle_at 303 264,
        open_by_handle_at 304 265""",
    "observation of files": """
        inotify_init 253 -, inotify_init1 294 26, inotify_add_watch 254 27,
        fanotify_init 300 262, fanotify_mark 301 263""",
    "mounts and namespaces": """
        mount 165 40, umount2 166 39, pivot_root 155 41, chroot 161 51, move_mount 429 429,
        open_tree 428 428, fsopen 430 430, fsconfig 431 431, fsmount 432 432,
        fspick 433 433, mount_setattr 442 442, setns 308 268, unshare 272 97""",
    "System V and POSIX objects": """
        shmget 29 194, shmat 30 196, shmctl 31 195, msgget 68 186, msgsnd 69 189,
        msgrcv 70 188, msgctl 71 187, semget 64 190, semop 65 193, semctl 66 191,
        semtimedop 220 192, mq_open 240 180, mq_unlink 241 181""",
    "files in memory, which no limit counts": "memfd_create 319 279, memfd_secret 447 447",
    "keys": "add_key 248 217, request_key 249 218, keyctl 250 219",
    "other processes": """
        tkill 200 130, rt_sigqueueinfo 129 138, rt_tgsigqueueinfo 297 240,
        pidfd_open 434 434, pidfd_getfd 438 438, pidfd_send_signal 424 424, ptrace 101 117,
        process_vm_readv 310 270, process_vm_writev 311 271, process_madvise 440 440,
        process_mrelease 448 448, kcmp 312 272, perf_event_open 298 241, move_pages 279 239,
        migrate_pages 256 238""",
    "priorities and limits": """
        setpriority 141 140, ioprio_set 251 30, sched_setscheduler 144 119,
        sched_setparam 142 118, sched_setattr 314 274, setrlimit 160 164""",
    "calls past a filter": """
        io_uring_setup 425 425, io_uring_enter 426 426, io_uring_register 427 427,
        bpf 321 280""",
    "the kernel and the machine": """
        userfaultfd 323 282, init_module 175 105, finit_module 313 273,
        delete_module 176 106, kexec_load 246 104, kexec_file_load 320 294, reboot 169 142,
        swapon 167 224, swapoff 168 225, acct 163 89, quotactl 179 60, quotactl_fd 443 443,
        syslog 103 116, sethostname 170 161, setdomainname 171 162, settimeofday 164 170,
        clock_settime 227 112, adjtimex 159 171, clock_adjtime 305 266, iopl 172 -,
        ioperm 173 -, vhangup 153 58, modify_ldt 154 -, uselib 134 -, personality 135 92""",
}
#: calls that pass their arguments in memory, where a filter cannot read them; programs use older
#: ones when they do not exist
_MISSING_CALLS = "clone3 435 435, openat2 437 437"
#: the last call that was judged for this filter (futex_requeue); newer ones do not exist for the
#: process
_LAST_CALL = 456

_CLONE_THREAD = 0x10000
_ACCESS_MODE, _TRUNCATE = 3, 0o1000
#: PR_SET_PDEATHSIG and PR_SCHED_CORE
_DENIED_PRCTL = (1, 62)
#: F_SETOWN, F_SETOWN_EX, F_SETLEASE and F_NOTIFY
_DENIED_FCNTL = (8, 15, 1024, 1026)
#: TCGETS, TIOCGWINSZ, FIONREAD, FIONBIO, FIONCLEX and FIOCLEX
_ALLOWED_IOCTL = (0x5401, 0x5413, 0x541B, 0x5421, 0x5450, 0x5451)

_LOAD, _AND, _EQUAL, _GREATER, _RETURN = 0x20, 0x54, 0x15, 0x25, 0x06
_ALLOW, _REFUSE = 0x7FFF0000, 0x00050000
_NUMBER_OFFSET, _ARCHITECTURE_OFFSET, _ARGUMENTS_OFFSET = 0, 4, 16
#: AUDIT_ARCH_* and column of the tables, by the name of the machine
_ARCHITECTURES = {"x86_64": (0xC000003E, 0), "aarch64": (0xC00000B7, 1)}
_PR_SET_SECCOMP, _SECCOMP_MODE_FILTER = 22, 2


class Instruction(NamedTuple):
    """BPF instruction.

    Code, numbers of instructions to skip if a comparison is true or false, and operand.
    """

    code: int
    if_true: int
    if_false: int
    operand: int


class Condition(NamedTuple):
    """Condition for a call.

    An argument (32 bits), combined with a mask, equals one of the values (or none of them).
    """

    argument: int
    values: Sequence[int]
    allowed: bool = True
    mask: int = 0xFFFFFFFF
    upper_half: bool = False


def is_available() -> bool:
    """Return whether system and processor support the filter."""
    if sys.platform != "linux" or os.uname().machine not in _ARCHITECTURES:
        return False
    # a filter at no address is refused with EFAULT where filters are supported
    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_SECCOMP, _SECCOMP_MODE_FILTER, None, 0, 0)
    return ctypes.get_errno() == errno.EFAULT


def enter_filter() -> None:
    """Refuse the denied calls of this thread and all that it starts, irrevocably.

    The process must have set no_new_privs (see `limits.detach`) or be privileged.

    Raises:
        OSError: The kernel refused the filter.
    """
    program = b"".join(
        struct.pack("<HBBI", *instruction)
        for instruction in filter_program(os.uname().machine, os.getpid())
    )
    instructions = ctypes.create_string_buffer(program, len(program))
    header = _Program(len(program) // 8, ctypes.addressof(instructions))
    library = ctypes.CDLL(None, use_errno=True)
    if library.prctl(_PR_SET_SECCOMP, _SECCOMP_MODE_FILTER, ctypes.byref(header), 0, 0):
        error = ctypes.get_errno()
        raise OSError(error, f"system call filter: {os.strerror(error)}")


class _Program(ctypes.Structure):
    _fields_ = [("length", ctypes.c_ushort), ("instructions", ctypes.c_void_p)]


def filter_program(machine: str, process: int) -> list[Instruction]:
    """Return the filter.

    Args:
        machine: Architecture, "x86_64" or "aarch64".
        process: Process id of the process, which may send signals to itself.
    """
    architecture, column = _ARCHITECTURES[machine]
    # A program of BPF is a list without loops: each call number is compared in turn. A comparison
    # skips `if_true` or `if_false` instructions, and the first "return" that is reached decides.
    program = [
        Instruction(_LOAD, 0, 0, _ARCHITECTURE_OFFSET),
        Instruction(_EQUAL, 1, 0, architecture),
        _refuse(errno.EPERM),
        Instruction(_LOAD, 0, 0, _NUMBER_OFFSET),
        Instruction(_GREATER, 0, 1, _LAST_CALL),
        _refuse(errno.ENOSYS),
    ]
    for number in _numbers(", ".join(DENIED_CALLS.values()), column):
        program += [Instruction(_EQUAL, 0, 1, number), _refuse(errno.EPERM)]
    for number in _numbers(_MISSING_CALLS, column):
        program += [Instruction(_EQUAL, 0, 1, number), _refuse(errno.ENOSYS)]
    for call, conditions in _conditional_calls(process).items():
        for number in _numbers(call, column):
            checks = chain.from_iterable(map(_check, conditions))
            block = [*checks, Instruction(_RETURN, 0, 0, _ALLOW)]
            program += [Instruction(_EQUAL, 0, len(block), number), *block]
    return [*program, Instruction(_RETURN, 0, 0, _ALLOW)]


def _conditional_calls(process: int) -> dict[str, Sequence[Condition]]:
    """Return the calls that are allowed under conditions."""
    # O_TRUNC without the right to write (access modes 0 and 3), which Landlock does not know before
    # Linux 6.2
    truncating = {
        "values": (_TRUNCATE, _TRUNCATE | 3),
        "allowed": False,
        "mask": _TRUNCATE | _ACCESS_MODE,
    }
    own, zero = (process,), (0,)
    return {
        "clone 56 220": [Condition(0, (_CLONE_THREAD,), mask=_CLONE_THREAD)],
        "kill 62 129": [Condition(0, own)],
        "tgkill 234 131": [Condition(0, own)],
        "sched_setaffinity 203 122": [Condition(0, zero)],
        # reading the own limits: no process, no new limits
        "prlimit64 302 261": [
            Condition(0, zero),
            Condition(2, zero),
            Condition(2, zero, upper_half=True),
        ],
        "prctl 157 167": [Condition(0, _DENIED_PRCTL, allowed=False)],
        "fcntl 72 25": [Condition(1, _DENIED_FCNTL, allowed=False)],
        "ioctl 16 29": [Condition(1, _ALLOWED_IOCTL)],
        "open 2 -": [Condition(1, **truncating)],  # type: ignore[arg-type]
        "openat 257 56": [Condition(2, **truncating)],  # type: ignore[arg-type]
    }


def _check(condition: Condition) -> Iterator[Instruction]:
    """Yield instructions that refuse the call unless the condition holds."""
    yield Instruction(
        _LOAD, 0, 0, _ARGUMENTS_OFFSET + 8 * condition.argument + 4 * condition.upper_half
    )
    yield Instruction(_AND, 0, 0, condition.mask)
    if condition.allowed:
        for remaining in range(len(condition.values), 0, -1):
            yield Instruction(_EQUAL, remaining, 0, condition.values[-remaining])
        yield _refuse(errno.EPERM)
    else:
        for value in condition.values:
            yield from (Instruction(_EQUAL, 0, 1, value), _refuse(errno.EPERM))


def _refuse(error: int) -> Instruction:
    return Instruction(_RETURN, 0, 0, _REFUSE | error)


def _numbers(calls: str, column: int) -> list[int]:
    """Return the numbers of listed calls on one architecture."""
    numbers = [call.split()[1 + column] for call in calls.split(",")]
    return [int(number) for number in numbers if number != "-"]
