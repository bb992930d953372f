"""Child process of a supervisor."""

from __future__ import annotations

import os
import resource
import sys
import tempfile
from collections.abc import Callable
from typing import NoReturn

from . import journal as journals
from .forks import watch_forks
from .journal import EXIT_CODE, Journal, Phase
from .limits import detach, lower_limit
from .process_attributes import reserve_descriptors
from .python_stack import write_stack_on_signals
from .standard_streams import protected_stream

#: limit of the private memory of a supervised run (bytes); mapped files of rows do not count
MEMORY_LIMIT = 4 << 30


def run_child(
    entry: Callable[[], int],
    journal: Journal,
    output: int,
    stack: int,
    temporary_folder: str,
    supervisor: int,
) -> NoReturn:
    """Run `entry` in this process, which was just forked, and end the process.

    Args:
        entry: Returns the exit code.
        journal: Journal in memory that the supervisor reads.
        output: Descriptor of the pipe for the output of foreign code.
        stack: Descriptor of the file for the Python stack (see `python_stack`).
        temporary_folder: Folder for temporary files.
        supervisor: Process id of the supervisor.
    """
    code = 70
    try:
        _isolate(output, supervisor)
        write_stack_on_signals(stack)
        tempfile.tempdir = os.environ["TMPDIR"] = temporary_folder
        journal.exclude_from_forks()
        watch_forks()
        journals.set_current_journal(journal)
        code = entry()
        sys.stdout.flush()
        sys.stderr.flush()
        journal[EXIT_CODE] = code
        journal.enter_phase(Phase.DONE)
    finally:
        os._exit(code)  # skips the exit handlers of foreign code


def _isolate(output: int, supervisor: int) -> None:
    """Enter a new session that ends with the supervisor, limit memory, and connect descriptors 1 and 2 to the pipe `output`.

    Python's own output goes to duplicates of the former descriptors. The limit keeps a component that allocates without end from
    affecting other processes. Core files are not written. Some descriptors are reserved for results.
    """
    detach(supervisor)
    lower_limit(resource.RLIMIT_DATA, MEMORY_LIMIT)
    lower_limit(resource.RLIMIT_CORE, 0)
    reserve_descriptors()
    sys.stdout, sys.stderr = (
        protected_stream(sys.stdout, duplicate=True),
        protected_stream(sys.stderr, duplicate=True),
    )
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
