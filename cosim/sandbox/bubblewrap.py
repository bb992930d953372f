"""Strict mode: bubblewrap starts the worker with its own processes, users, network and files."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError

_CLOSED = ("--unshare-all", "--die-with-parent", "--new-session")
_OWN = ("--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp")  # noqa: S108


def bubblewrap() -> str:
    """Path of the program `bwrap`; empty where it is not installed or may not do its work."""
    program = shutil.which("bwrap")
    if program is None:
        return ""
    trial = [program, *_CLOSED, "--ro-bind", "/", "/", "true"]
    try:
        subprocess.run(trial, capture_output=True, check=True, timeout=5)  # noqa: S603
    except (OSError, subprocess.SubprocessError):
        return ""
    return program


def command(arguments: Sequence[str], readable: Sequence[Path], writable: Sequence[Path] = ()) -> list[str]:
    """The command that runs `arguments` seeing nothing but the listed folders, under their own paths.

    No network at all, no process of outside, an empty /tmp; everything ends with the caller. Raises InputError where
    bubblewrap is missing or not permitted.
    """
    program = bubblewrap()
    if not program:
        raise InputError("strict isolation needs bubblewrap (program bwrap) and user namespaces; found none that works")
    words = [program, *_CLOSED, *_OWN]
    for path in readable:
        words += ["--ro-bind", str(path), str(path)]
    for path in writable:
        words += ["--bind", str(path), str(path)]
    return [*words, "--", *arguments]
