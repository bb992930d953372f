"""Strict sandbox: bubblewrap runs a command with separate process ids, users, network and files."""

import shutil
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

from ...core.errors import InputError

_ISOLATION_OPTIONS = ("--unshare-all", "--die-with-parent", "--new-session", "--as-pid-1")
_MOUNT_OPTIONS = ("--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp")  # noqa: S108


def find_bubblewrap() -> str:
    """Return the path of the program `bwrap`; "" if it is not installed or lacks permissions."""
    program = shutil.which("bwrap")
    if program is None:
        return ""
    trial = [program, *_ISOLATION_OPTIONS, "--ro-bind", "/", "/", "true"]
    try:
        subprocess.run(trial, capture_output=True, check=True, timeout=5)  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        return ""
    return program


def bubblewrap_command(
    arguments: Sequence[str],
    readable: Iterable[Path],
    writable: Iterable[Path] = (),
    *,
    status: int | None = None,
) -> list[str]:
    """Return a command line that runs a command in bubblewrap, in the current folder.

    The command has no network, an empty /tmp, only the listed files under their usual paths, and
    ends with the caller. If one listed folder contains another, the permission of the inner one
    applies to it.

    Args:
        arguments: Program and arguments.
        readable: Folders and files that may be read.
        writable: Folders and files that may be read and written; they take precedence over
            `readable`.
        status: Descriptor to which bubblewrap writes lines of JSON with "child-pid" and, at the
            end, "exit-code".

    Raises:
        InputError: bubblewrap is not installed or lacks permissions.
    """
    program = find_bubblewrap()
    if not program:
        raise InputError(
            "the strict sandbox needs bubblewrap (program bwrap, package bubblewrap) and user "
            "namespaces; found none that works"
        )
    command = [program, *_ISOLATION_OPTIONS, *_MOUNT_OPTIONS]
    bound = {**dict.fromkeys(readable, "--ro-bind"), **dict.fromkeys(writable, "--bind")}
    for path in sorted(bound):
        command += [bound[path], str(path), str(path)]
    if status is not None:
        command += ["--json-status-fd", str(status)]
    folder = str(Path.cwd())
    return [*command, "--dir", folder, "--chdir", folder, "--", *arguments]
