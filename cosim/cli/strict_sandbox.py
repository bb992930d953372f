"""`--sandbox strict`.

Execution of the same command in bubblewrap, while this process only waits.
"""

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

#: kinds of sandbox; `--sandbox` without a value selects the first
SANDBOX_KINDS = ("default", "strict")

_INSIDE_VARIABLE = "COSIM_INSIDE_STRICT_SANDBOX"

#: variables that name folders for a program's own files
_HOME_VARIABLES = ("TMPDIR", "HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME")

#: variables that the command keeps in addition to those of a sandboxed FMU: programs, modules,
#: compiler and terminal
_COMMAND_VARIABLES = (
    "PATH",
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "PYTHONHASHSEED",
    "CC",
    "TERM",
    "COLUMNS",
    "LINES",
    "NO_COLOR",
)

#: programs (compilers for Modelica sources), shared libraries and fonts; without private files and
#: sockets
_SYSTEM_PATHS = (
    "/usr",
    "/bin",
    "/lib",
    "/lib64",
    "/etc/ld.so.cache",
    "/etc/alternatives",
    "/etc/fonts",
)


class SandboxCommand(click.Command):
    """Command with an option `--sandbox` that needs no value, even if an argument follows."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments after adding the default value to a bare `--sandbox`."""
        words = []
        for word, following in zip_longest(args, args[1:]):
            is_bare = word == "--sandbox" and following not in SANDBOX_KINDS
            words.append(f"--sandbox={SANDBOX_KINDS[0]}" if is_bare else word)
        return super().parse_args(ctx, words)


def must_rerun(sandbox: str | None) -> bool:
    """Return whether the command must be run again inside the strict sandbox."""
    return sandbox == "strict" and _INSIDE_VARIABLE not in os.environ


def rerun_in_bubblewrap(files: Iterable[Path], output: Path | None) -> int:
    """Run this command again inside bubblewrap and return its exit code.

    Args:
        files: files whose folders the command may read, in addition to those of Python and cosim.
        output: the only folder that the command may write, apart from a temporary one; None: no
            other.

    Raises:
        InputError: if bubblewrap is missing or cannot start the command, or a folder contains the
            home folder.
    """
    from ..core import resources
    from ..core.errors import InputError
    from ..process.sandbox import KEPT_VARIABLES, bubblewrap_command, interpreter_folders
    from ..process.supervisor import interrupt_on_termination
    from ..process.temporary_folders import temporary_run_folder

    named: list[Path] = []
    for file in files:  # also the folder of the target of a link
        named += [file.absolute().parent, file.resolve().parent]
    folders = [folder for folder in named if folder.exists()]
    outputs = [output] if output else []
    home = Path.home().resolve()
    for folder in (*folders, *outputs):
        if home.is_relative_to(folder.resolve()):
            raise InputError(
                f'--sandbox strict: "{folder}" holds a file or the results of this run, but '
                "contains the home folder, all of which would be visible inside; expected a "
                "folder of the project"
            )
    with ExitStack() as stack:
        temporary = Path(stack.enter_context(temporary_run_folder()))
        stack.enter_context(interrupt_on_termination())
        reader, writer = os.pipe()
        status = stack.enter_context(os.fdopen(reader))
        with os.fdopen(writer):
            python = [sys.executable, "-P", "-m", "cosim", *current_command_line().arguments]
            installed = [*interpreter_folders(), *map(Path, _SYSTEM_PATHS), resources.root()]
            readable = [path for path in installed if path.exists()]
            words = bubblewrap_command(
                python, [*readable, *folders], [temporary, *outputs], status=writer
            )
            if output:
                stack.enter_context(_output_folder(output))
            kept = {
                name: os.environ[name]
                for name in (*KEPT_VARIABLES, *_COMMAND_VARIABLES)
                if name in os.environ
            }
            homes = dict.fromkeys(_HOME_VARIABLES, str(temporary))
            process = subprocess.Popen(  # noqa: S603
                words,
                pass_fds=[writer],
                env={**kept, **homes, _INSIDE_VARIABLE: "1"},
                stdout=current_command_line().data,
                start_new_session=True,
            )
        report = _wait_for_exit(process, status)
    if "exit-code" not in report:
        raise InputError(f"bubblewrap could not start the command (exit code {process.returncode})")
    return int(report["exit-code"])


@contextmanager
def _output_folder(path: Path) -> Iterator[None]:
    """Create the output directory.

    Afterwards, remove the folders created for it if they are empty.
    """
    from ..results.files import check_writable

    created = [folder for folder in (path, *path.parents) if not folder.exists()]
    check_writable(path)
    path.mkdir(parents=True, exist_ok=True)
    yield
    with suppress(OSError):
        for folder in created:
            folder.rmdir()


def _wait_for_exit(process: subprocess.Popen[bytes], status: IO[str]) -> dict[str, int]:
    """Wait until bubblewrap exits and return the status that it reported.

    Forward interrupts to the command.
    """
    report: dict[str, int] = {}
    while True:
        try:
            while line := status.readline():
                report |= json.loads(line)
            process.wait()
            return report
        except KeyboardInterrupt:
            with suppress(ProcessLookupError):
                os.kill(report.get("child-pid", process.pid), SIGINT)
