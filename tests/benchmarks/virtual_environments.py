"""Virtual environments of the peers, created once below a cache folder."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

_INSTALLED = "installed.txt"


def environment(folder: Path, requirements: Sequence[str]) -> Path:
    """Return the interpreter of an environment with these packages. Raises CalledProcessError if
    they cannot be installed.
    """
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    marker = folder / _INSTALLED
    if marker.is_file() and marker.read_text().split() == list(requirements):
        return python
    _run([sys.executable, "-m", "venv", "--clear", folder])
    _run([python, "-m", "pip", "install", "--quiet", *requirements])
    marker.write_text("\n".join(requirements))
    return python


def versions(python: Path, packages: Sequence[str]) -> str:
    """Return name and version of each package in the environment."""
    code = (
        "import sys; from importlib.metadata import version; print(*(f'{p} {version(p)}' for p in "
        "sys.argv[1:]), sep=', ')"
    )
    return _run([python, "-c", code, *packages]).strip()


def _run(command: Sequence[str | Path]) -> str:
    return subprocess.run([*map(str, command)], capture_output=True, text=True, check=True).stdout
