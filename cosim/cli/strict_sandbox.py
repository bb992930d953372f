"""`--sandbox strict`: the same command once more inside bubblewrap, while this process only waits for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import zip_longest
from pathlib import Path
from signal import SIGINT
from typing import IO

import click

from . import current_command_line

#: kinds of sandbox; `--sandbox` alone is the first one
SANDBOX_KINDS = ("default", "strict")

_INSIDE_VARIABLE = "COSIM_INSIDE_STRICT_SANDBOX"

#: where programs put what they make for themselves
_HOME_VARIABLES = ("TMPDIR", "HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME")

#: programs (compilers for Modelica sources), shared libraries and fonts; they hold nothing private and nobody listens there
_SYSTEM_PATHS = ("/usr", "/bin", "/lib", "/lib64", "/etc/ld.so.cache", "/etc/alternatives", "/etc/fonts")


class SandboxCommand(click.Command):
    """A command whose `--sandbox` may stand alone, also before an argument."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        return super().parse_args(ctx, list(_with_explicit_kind(args)))


def _with_explicit_kind(words: list[str]) -> Iterator[str]:
    for word, following in zip_longest(words, words[1:]):
        yield f"--sandbox={SANDBOX_KINDS[0]}" if word == "--sandbox" and following not in SANDBOX_KINDS else word


def must_rerun(sandbox: str | None) -> bool:
    """Whether the command has to go into the sandbox yet."""
    return sandbox == "strict" and _INSIDE_VARIABLE not in os.environ


def rerun_in_bubblewrap(files: Iterable[Path], output: Path | None) -> int:
    """Run this command again where it sees only the folders of `files` and what Python needs, and writes only to the folder
    `output`; returns its exit code. Raises InputError when bubblewrap cannot do that."""
    from ..core.errors import InputError
    from ..process.sandbox import bubblewrap_command
    from ..process.supervisor import interrupt_on_termination
    from ..process.temporary_folders import temporary_run_folder

    with ExitStack() as stack:
        temporary = Path(stack.enter_context(temporary_run_folder()))
        stack.enter_context(interrupt_on_termination())
        reader, writer = os.pipe()
        status = stack.enter_context(os.fdopen(reader))
        with os.fdopen(writer):
            python = [sys.executable, "-P", "-m", "cosim", *current_command_line().arguments]
            writable = [temporary, *([output] if output else [])]
            words = bubblewrap_command(python, _readable_folders(files), writable, status=writer)
            if output:
                stack.enter_context(_output_folder(output))
            own = dict.fromkeys(_HOME_VARIABLES, str(temporary))
            process = subprocess.Popen(  # noqa: S603
                words, pass_fds=[writer], env={**os.environ, **own, _INSIDE_VARIABLE: "1"}, start_new_session=True
            )
        told = _wait_for_exit(process, status)
    if "exit-code" not in told:
        raise InputError(f"bubblewrap could not start the command (exit code {process.returncode})")
    return int(told["exit-code"])


@contextmanager
def _output_folder(path: Path) -> Iterator[None]:
    """A folder for results; what is new of it goes again when nothing was written there."""
    from ..results.files import check_writable

    new = [folder for folder in (path, *path.parents) if not folder.exists()]
    check_writable(path)
    yield
    with suppress(OSError):
        for folder in new:
            folder.rmdir()


def _wait_for_exit(process: subprocess.Popen[bytes], status: IO[str]) -> dict[str, int]:
    """What bubblewrap tells until the end; interrupts are passed on to the command, which ends in order."""
    told: dict[str, int] = {}
    while True:
        try:
            while line := status.readline():
                told |= json.loads(line)
            process.wait()
            return told
        except KeyboardInterrupt:
            with suppress(ProcessLookupError):
                os.kill(told.get("child-pid", process.pid), SIGINT)


def _readable_folders(files: Iterable[Path]) -> list[Path]:
    """Folders of the files, those that links lead to, too, and of Python and of what is shipped."""
    from ..core import resources
    from ..process.sandbox import interpreter_folders

    named = [Path(path) for file in files for path in (os.path.abspath(file), os.path.realpath(file))]  # noqa: PTH100
    own = [*map(Path, _SYSTEM_PATHS), resources.root()]
    return [path for path in (*interpreter_folders(), *own, *(file.parent for file in named)) if path.exists()]
