"""`cosim regress`: regression test of all scenarios against their checks and references."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from ...core import resources
from ...core.errors import InputError
from ...core.processors import available_processors
from ...studies.regression import EXPECTATION_KEYS, Regression, RegressionOutcome, has_keys
from ..messages import print_verdict

if TYPE_CHECKING:
    from ...report.junit import JUnitCase

T = TypeVar("T")

#: exit codes from the most to the least severe; the most severe one is returned
EXIT_CODE_SEVERITY = (130, 70, 2, 1, 3, 0)


@click.command()
@click.argument("scenarios", nargs=-1, metavar="[DIR|SCENARIO...]", type=click.Path(path_type=Path))
@click.option("--update", is_flag=True, help="Write new references from these runs.")
@click.option("--junit", type=click.Path(path_type=Path), metavar="FILE.xml", help="Also write the outcomes as JUnit XML.")
@click.option(
    "--output-dir", type=click.Path(path_type=Path), default=Path("runs"), show_default=True, help="Folder for the results."
)
@click.option("--jobs", type=click.IntRange(min=1), help="Number of scenarios at a time; default: one per processor.")
def command(scenarios: tuple[Path, ...], update: bool, junit: Path | None, output_dir: Path, jobs: int | None) -> int:
    """Run all scenarios that have checks or a reference, and compare their results with these.

    SCENARIO is a file or the name of a shipped scenario; DIR stands for its files *.json; default: the folder scenarios/. Each
    scenario runs as with `cosim run`. --update writes the references: the signals matched by the patterns of their tolerances,
    with as few rows as necessary, and a JSON file with their origin. A run that fails its checks does not become a reference.
    Exit code 0: all passed; 1: a component failed; 2: a scenario was refused; 3: a check or comparison failed.
    """
    expected = ("reference",) if update else EXPECTATION_KEYS
    files = [file for file in find_scenario_files(scenarios or [default_folder()]) if has_keys(file, expected)]
    if not files:
        raise InputError('found no scenario with a "reference" (or, without --update, with "checks")')
    check_unique_names(files)
    work = [Regression(file, output_dir / file.stem, update) for file in files]
    outcomes = []
    for outcome in run_in_parallel([each.run for each in work], jobs or available_processors()):
        _print_outcome(outcome)
        outcomes.append(outcome)
    if junit:
        from ...report.junit import write_junit

        write_junit("cosim regress", [_junit_case(outcome) for outcome in outcomes], junit)
    failed = sum(outcome.code != 0 for outcome in outcomes)
    count = "1 scenario" if len(outcomes) == 1 else f"{len(outcomes)} scenarios"
    click.echo(f"{count}, {failed} failed" if failed else f"{count}, all passed")
    return min((outcome.code for outcome in outcomes), key=EXIT_CODE_SEVERITY.index)


def default_folder() -> Path:
    """Return the folder scenarios/ of the working directory if it exists, else that of the shipped scenarios."""
    folder = Path("scenarios")
    return folder if folder.is_dir() else resources.root() / folder


def find_scenario_files(paths: Iterable[Path]) -> Iterator[Path]:
    """Yield the scenario files for files, names of shipped scenarios and folders.

    Raises:
        InputError: if a file does not exist or a folder has no scenarios.
    """
    from ...scenario import find_scenario

    for path in paths:
        if not path.is_dir():
            yield find_scenario(path)
        elif files := sorted(path.glob("*.json")):
            yield from files
        else:
            raise InputError(f'the folder "{path}" contains no scenario (*.json)')


def check_unique_names(files: Iterable[Path]) -> None:
    """Raise InputError if two files have the same name: the results of both would have the same folder."""
    counts = Counter(file.stem for file in files)
    if repeated := [name for name, count in counts.items() if count > 1]:
        raise InputError(
            [f'{counts[name]} scenarios are called "{name}.json": their results would go to one folder' for name in repeated]
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


def _print_outcome(outcome: RegressionOutcome) -> None:
    print_verdict(outcome.code == 0)
    click.echo(f"  {outcome.name:<28} {outcome.summary:<24} {outcome.seconds:5.1f} s")
    for line in outcome.details:
        click.echo(f"        {line}")


def _junit_case(outcome: RegressionOutcome) -> JUnitCase:
    from ...report.junit import JUnitCase

    kind = {0: "passed", 3: "failure"}.get(outcome.code, "error")
    return JUnitCase(outcome.name, kind, outcome.seconds, outcome.details)
