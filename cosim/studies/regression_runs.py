"""Regression tests of several scenarios, run side by side."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TypeVar

from ..core import resources
from ..core.errors import InputError
from ..scenario import find_scenario
from .regression import (
    EXPECTATION_KEYS,
    CommandRunner,
    Regression,
    RegressionOutcome,
    has_keys,
    run_in_new_process,
)

T = TypeVar("T")

#: makes, for a number of threads, the context in which commands can be run
CommandContext = Callable[[int], AbstractContextManager[CommandRunner]]


def new_processes(_threads: int) -> AbstractContextManager[CommandRunner]:
    """Return a context in which each command runs in a new process."""
    return nullcontext(run_in_new_process)


def run_regressions(
    paths: Iterable[Path],
    update: bool,
    output_dir: Path,
    jobs: int,
    commands: CommandContext = new_processes,
) -> Iterator[RegressionOutcome]:
    """Run all scenarios that have checks or a reference, and yield their outcomes in order.

    Args:
        paths: Scenario files, names of shipped scenarios, and folders of scenario files.
        update: Write the references instead of comparing with them.
        output_dir: Folder of the folders of results.
        jobs: Number of scenarios that run at a time.
        commands: Makes the context in which `cosim run` is called.

    Raises:
        InputError: There is no such scenario, or two files have the same name.
    """
    expected = ("reference",) if update else EXPECTATION_KEYS
    files = [file for file in find_scenario_files(paths) if has_keys(file, expected)]
    if not files:
        raise InputError(
            'found no scenario with a "reference" (or, without --update, with "checks")'
        )
    check_unique_names(files)
    with commands(min(jobs, len(files))) as run_command:
        work = [Regression(file, output_dir / file.stem, update, run_command).run for file in files]
        yield from run_in_parallel(work, jobs)


def default_folder() -> Path:
    """Return the folder scenarios/ of the working directory if it exists, else that of the shipped scenarios."""
    folder = Path("scenarios")
    return folder if folder.is_dir() else resources.root() / folder


def find_scenario_files(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the scenario files for files, names of shipped scenarios and folders.

    Raises:
        InputError: if a file does not exist, a folder has no scenarios, or a name is that of a
            folder and of a shipped scenario.
    """
    for path in paths:
        if not path.is_dir():
            yield find_scenario(path)
        elif str(path) in resources.shipped_names("scenarios/*.json"):
            shipped = resources.root() / "scenarios" / f"{path}.json"
            raise InputError(
                f'"{path}" is a folder here and a shipped scenario: write {path.absolute()} or '
                f"{shipped}"
            )
        elif files := sorted(path.glob("*.json")):
            yield from files
        else:
            raise InputError(f'the folder "{path}" contains no scenario (*.json)')


def check_unique_names(files: Iterable[Path]) -> None:
    """Raise InputError if two files have the same name.

    The results of both would have the same folder.
    """
    counts = Counter(file.stem for file in files)
    if repeated := [name for name, count in counts.items() if count > 1]:
        raise InputError(
            [
                (
                    f'{counts[name]} scenarios are called "{name}.json": their results would go to '
                    "one folder"
                )
                for name in repeated
            ]
        )


def run_in_parallel(work: Sequence[Callable[[], T]], jobs: int) -> Iterator[T]:
    """Call functions on `jobs` threads and yield their return values, in order.

    After an interrupt, functions that have not started are not called.
    """
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(jobs)
    try:
        yield from pool.map(lambda function: function(), work)
    finally:
        pool.shutdown(cancel_futures=True)
