"""The system call filter, executed by an interpreter of its program for both architectures."""

from __future__ import annotations

import errno
import struct

import pytest

from cosim.process.sandbox.system_call_filter import DENIED_CALLS, filter_program

ALLOWED, PROCESS = 0x7FFF0000, 4711
ARCHITECTURES = {"x86_64": 0xC000003E, "aarch64": 0xC00000B7}
#: calls of every program: numbers on x86_64 and aarch64
COMMON = {
    "read": (0, 63),
    "write": (1, 64),
    "poll or ppoll": (7, 73),
    "mmap": (9, 222),
    "futex": (202, 98),
    "rename or renameat2": (82, 276),
    "exit_group": (231, 94),
    "getpid": (39, 172),
    "getrandom": (318, 278),
}
THREAD_FLAGS, FORK_FLAGS = 0x3D0F00, 17
TRUNCATE = 0o1000
#: name, numbers, arguments, allowed
CONDITIONAL = [
    ("clone of a thread", (56, 220), (THREAD_FLAGS,), True),
    ("clone of a process", (56, 220), (FORK_FLAGS,), False),
    ("kill itself", (62, 129), (PROCESS, 6), True),
    ("kill another process", (62, 129), (1, 6), False),
    ("kill its group", (62, 129), (0, 6), False),
    ("kill everything", (62, 129), (2**64 - 1, 6), False),
    ("tgkill itself", (234, 131), (PROCESS, PROCESS, 6), True),
    ("tgkill another process", (234, 131), (1, 1, 6), False),
    ("read its limits", (302, 261), (0, 7, 0, 0xFFF), True),
    ("set its limits", (302, 261), (0, 7, 0xFFF, 0), False),
    ("set its limits from high memory", (302, 261), (0, 7, 0xFFF00000000, 0), False),
    ("read limits of another process", (302, 261), (1, 7, 0, 0xFFF), False),
    ("outlive its parent", (157, 167), (1, 0), False),
    ("name a thread", (157, 167), (15, 0), True),
    ("own a descriptor's signals", (72, 25), (0, 8, 1), False),
    ("duplicate a descriptor", (72, 25), (0, 1030, 3), True),
    ("ask for a terminal", (16, 29), (1, 0x5401), True),
    ("type into a terminal", (16, 29), (1, 0x5412), False),
    ("change flags of a file", (16, 29), (3, 0x40086602), False),
    ("open to read", (257, 56), (0, 0, 0), True),
    ("open to write from the start", (257, 56), (0, 0, 1 | TRUNCATE), True),
    ("truncate by reading", (257, 56), (0, 0, TRUNCATE), False),
    ("truncate without access", (257, 56), (0, 0, 3 | TRUNCATE), False),
    ("bind another process to a processor", (203, 122), (1, 8), False),
    ("bind itself to a processor", (203, 122), (0, 8), True),
]


def decide(
    machine: str, number: int, arguments: tuple[int, ...] = (), architecture: int | None = None
) -> int:
    """Execute the filter as the kernel does and return its decision."""
    data = struct.pack(
        "<iIQ6Q",
        number,
        architecture or ARCHITECTURES[machine],
        0,
        *arguments,
        *[0] * (6 - len(arguments)),
    )
    program, counter, register = filter_program(machine, PROCESS), 0, 0
    while True:
        code, if_true, if_false, operand = program[counter]
        counter += 1
        if code == 0x06:
            return operand
        if code == 0x20:
            (register,) = struct.unpack_from("<I", data, operand)
        elif code == 0x54:
            register &= operand
        elif code in (0x15, 0x25):
            holds = register == operand if code == 0x15 else register > operand
            counter += if_true if holds else if_false
        else:
            raise AssertionError(f"code {code:#x}")


def refused(error: int) -> int:
    return 0x00050000 | error


@pytest.mark.parametrize("machine", ARCHITECTURES)
class TestProgram:
    def test_every_denied_call_is_refused(self, machine):
        column = 1 + list(ARCHITECTURES).index(machine)
        calls = [call.split() for call in ",".join(DENIED_CALLS.values()).split(",")]
        numbers = [int(call[column]) for call in calls if call[column] != "-"]
        assert len(numbers) > 85
        assert len(set(numbers)) == len(numbers)
        assert {decide(machine, number) for number in numbers} == {refused(errno.EPERM)}

    @pytest.mark.parametrize("call", COMMON)
    def test_calls_of_every_program_are_allowed(self, machine, call):
        assert decide(machine, COMMON[call][list(ARCHITECTURES).index(machine)]) == ALLOWED

    @pytest.mark.parametrize("case", CONDITIONAL, ids=lambda case: case[0])
    def test_arguments_decide(self, machine, case):
        _, numbers, arguments, allowed = case
        decision = decide(machine, numbers[list(ARCHITECTURES).index(machine)], arguments)
        assert decision == (ALLOWED if allowed else refused(errno.EPERM))

    @pytest.mark.parametrize("number", [435, 437, 457, 1000, 0x40000000 | 41])
    def test_calls_that_cannot_be_judged_do_not_exist(self, machine, number):
        """Calls with arguments in memory, newer calls, and those of the interface x32."""
        assert decide(machine, number) == refused(errno.ENOSYS)

    def test_calls_of_another_architecture_are_refused(self, machine):
        for other in (0x40000003, 0x40000028, *ARCHITECTURES.values()):
            if other != ARCHITECTURES[machine]:
                assert decide(machine, 0, architecture=other) == refused(errno.EPERM)
