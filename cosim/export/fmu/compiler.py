"""Discovery and invocation of the C compiler."""

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from ...core.errors import InputError, Problem

#: -ffp-contract=off: fused multiply-add would make results depend on the processor
COMPILER_OPTIONS = (
    "-std=c11",
    "-O2",
    "-fPIC",
    "-shared",
    "-fvisibility=hidden",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
)
_COMPILER_NAMES = ("cc", "gcc", "clang")
#: instructions that every processor of the architecture has, as with the other compilers
_ZIG_OPTIONS = ("-mcpu=baseline",)


def find_compiler() -> list[str]:
    """Return the command of the C compiler.

    The environment variable CC, else cc, gcc, clang or that of ziglang.

    Raises:
        InputError: No compiler was found.
    """
    installed = [name for name in _COMPILER_NAMES if shutil.which(name)][:1]
    zig = ziglang_command()
    command = shlex.split(os.environ.get("CC", "")) or installed or (zig and [*zig, *_ZIG_OPTIONS])
    if not command or shutil.which(command[0]) is None:
        tried = command[0] if os.environ.get("CC") else ", ".join((*_COMPILER_NAMES, "ziglang"))
        raise InputError(
            f"export needs a C compiler, but none was found (tried {tried}); install gcc or set CC"
        )
    return command


def ziglang_command() -> list[str]:
    """Return the command of the C compiler in the package ziglang, empty if it is not installed."""
    return [sys.executable, "-m", "ziglang", "cc"] if find_spec("ziglang") else []


@cache
def compiler_version(command: tuple[str, ...]) -> str:
    """Return the version of a compiler, for example "gcc (Debian 12.2.0-14) 12.2.0".

    It is the first line of the output.
    """
    process = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False)  # noqa: S603
    return process.stdout.partition("\n")[0].strip() or command[0]


def compile_library(folder: Path, sources: Sequence[str], library: Path) -> None:
    """Compile C files to a shared library.

    Args:
        folder: The folder of the C files and headers.
        sources: Names of the C files to compile.
        library: The shared library to write; its folder is created.

    Raises:
        InputError: There is no compiler, or it reports errors (one problem for each).
    """
    library.parent.mkdir(parents=True, exist_ok=True)
    linker_options = ["-Wl,--no-undefined"] if sys.platform == "linux" else []
    command = [
        *find_compiler(),
        *COMPILER_OPTIONS,
        *linker_options,
        "-o",
        str(library.resolve()),
        *sources,
        "-lm",
    ]
    process = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
    if process.returncode:
        lines = process.stderr.splitlines()
        errors = [line for line in lines if "error:" in line or "undefined reference" in line]
        raise InputError(
            [Problem(line, library.stem) for line in errors or lines or ["the C compiler failed"]]
        )
