"""Client of the child process in which rumoca runs (`rumoca_process`)."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from ....core.errors import InputError, Problem
from ....process.failure_attribution import describe_exit_status
from .parts import assigned_values, removable_parts

#: limits of the child process: processor time and wall time (s), private memory and size of the
#: flat model (bytes)
CPU_LIMIT, TIMEOUT, MEMORY_LIMIT, OUTPUT_LIMIT = 120, 900, 2 << 30, 1 << 28
#: numbers of parts of a model that are changed to find the one that rumoca refuses, without and
#: with packages
TRIALS, LIBRARY_TRIALS = 200, 3

_PROGRAM = Path(__file__).with_name("rumoca_process.py")
#: text that Rust writes when memory is exhausted
_OUT_OF_MEMORY = b"memory allocation of"


def run_rumoca(
    version: str,
    files: Sequence[Path],
    packages: Sequence[Path],
    model: str,
    text: tuple[str, str] | None,
    declaration: str = "",
) -> dict[str, Any]:
    """Run rumoca in a child process.

    Args:
        version: The required version.
        files: All files that the model may use; the file of the model is the first one.
        packages: Folders of packages.
        model: Full name of the model.
        text: Name under which the model's file is loaded, and its text; None for a member of a
            package.
        declaration: Text of a further class, which is that of the model.

    Returns:
        The answer of `rumoca_process`.

    Raises:
        InputError: rumoca crashed, did not end in time or exceeded a limit; names the file that it
            was reading.
    """
    request = {
        "version": version,
        "files": [str(file) for file in files],
        "packages": [str(package) for package in packages],
        "model": model,
        "text": text,
        "declaration": declaration,
        "values": assigned_values(text[1]) if text else [],
        "parts": removable_parts(text[1]) if text else [],
        "trials": LIBRARY_TRIALS if packages else TRIALS,
        "memory": MEMORY_LIMIT,
        "output_size": OUTPUT_LIMIT,
        "seconds": CPU_LIMIT,
    }
    with TemporaryFile() as output, TemporaryFile() as errors:
        reason = _run_process(json.dumps(request).encode(), output, errors)
        messages = _read_messages(output)
        errors.seek(0)
        if _OUT_OF_MEMORY in errors.read(OUTPUT_LIMIT):
            reason = f"it needs more than {MEMORY_LIMIT >> 30} GiB of memory"
    present = [message["file"] for message in messages if "file" in message]
    if messages and "file" not in messages[-1]:
        return messages[-1]
    raise InputError(
        Problem(
            f"the Modelica front end failed on this file: {reason}",
            present[-1] if present else str(files[0]),
        )
    )


def _run_process(request: bytes, output: Any, errors: Any) -> str:
    """Run the child process to its end and return the description of a failure."""
    command = [sys.executable, "-P", str(_PROGRAM)]
    # rumoca would read further libraries from the folders of MODELICAPATH
    environment = {name: value for name, value in os.environ.items() if name != "MODELICAPATH"}
    try:
        process = subprocess.run(  # noqa: S603
            command,
            input=request,
            stdout=output,
            stderr=errors,
            timeout=TIMEOUT,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return f"it did not end within {TIMEOUT:g} s"
    return describe_exit_status(
        -process.returncode if process.returncode < 0 else process.returncode << 8
    )


def _read_messages(output: Any) -> list[dict[str, Any]]:
    """Return the complete messages."""
    output.seek(0)
    return [json.loads(line) for line in output if line.endswith(b"\n")]
