"""The C compiler of this machine."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from ...core.errors import InputError, Problem

#: contraction to fused multiply-add would make results depend on the machine
COMPILER_OPTIONS = ("-std=c11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off", "-Wall", "-Wextra")
_COMPILER_NAMES = ("cc", "gcc", "clang")


def find_compiler() -> list[str]:
    """The command of the C compiler: the environment variable CC, else cc, gcc or clang. Raises InputError without one."""
    command = shlex.split(os.environ.get("CC", "")) or [name for name in _COMPILER_NAMES if shutil.which(name)][:1]
    if not command or shutil.which(command[0]) is None:
        tried = command[0] if command else ", ".join(_COMPILER_NAMES)
        raise InputError(f"exporting needs a C compiler and none was found (tried {tried}); install gcc or set CC")
    return command


@cache
def compiler_version(command: tuple[str, ...]) -> str:
    """What the compiler calls itself, for example "gcc (Debian 12.2.0-14) 12.2.0"."""
    done = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=False)  # noqa: S603
    return done.stdout.partition("\n")[0].strip() or command[0]


def compile_library(folder: Path, sources: Sequence[str], library: Path) -> None:
    """Compile C files in `folder` to a shared library. Raises InputError with the compiler's errors, one problem each."""
    library.parent.mkdir(parents=True, exist_ok=True)
    all_symbols = ["-Wl,--no-undefined"] if sys.platform == "linux" else []
    command = [*find_compiler(), *COMPILER_OPTIONS, *all_symbols, "-o", str(library.resolve()), *sources, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode:
        lines = done.stderr.splitlines()
        errors = [line for line in lines if "error:" in line or "undefined reference" in line]
        raise InputError([Problem(line, library.stem) for line in errors or lines or ["the C compiler failed"]])
