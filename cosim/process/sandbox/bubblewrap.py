"""Strict mode: bubblewrap starts a command with its own processes, users, network and files."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path

from ...core.errors import InputError

_ISOLATION_OPTIONS = ("--unshare-all", "--die-with-parent", "--new-session", "--as-pid-1")
_MOUNT_OPTIONS = ("--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp")  # noqa: S108


def find_bubblewrap() -> str:
    """Path of the program `bwrap`; empty where it is not installed or may not do its work."""
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
    arguments: Sequence[str], readable: Iterable[Path], writable: Iterable[Path] = (), *, status: int | None = None
) -> list[str]:
    """The command that runs `arguments` in this folder seeing nothing but the listed ones, under their own paths.

    No network at all, no process of outside, an empty /tmp; everything ends with the caller. Where folders lie in each other,
    the inner one counts; `writable` counts more than `readable`. To the descriptor `status` bubblewrap writes lines of JSON
    with "child-pid", and "exit-code" at the end of a command that was started. Raises InputError where bubblewrap is missing
    or not permitted.
    """
    program = find_bubblewrap()
    if not program:
        raise InputError(
            "the strict sandbox needs bubblewrap (program bwrap, package bubblewrap) and user namespaces; found none that works"
        )
    words = [program, *_ISOLATION_OPTIONS, *_MOUNT_OPTIONS]
    bound = {**dict.fromkeys(readable, "--ro-bind"), **dict.fromkeys(writable, "--bind")}
    for path in sorted(bound):
        words += [bound[path], str(path), str(path)]
    if status is not None:
        words += ["--json-status-fd", str(status)]
    here = str(Path.cwd())
    return [*words, "--dir", here, "--chdir", here, "--", *arguments]
