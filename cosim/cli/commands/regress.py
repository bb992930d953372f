"""`cosim regress`: do all scenarios still do what their checks and references say?"""

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

if TYPE_CHECKING:
    from ...report.junit import JUnitCase

T = TypeVar("T")

#: of several exit codes the first one counts
EXIT_CODE_SEVERITY = (130, 70, 2, 1, 3, 0)


@click.command()
@click.argument("scenarios", nargs=-1, metavar="[DIR|SCENARIO...]", type=click.Path(path_type=Path))
@click.option("--update", is_flag=True, help="Write the references anew from these runs.")
@click.option("--junit", type=click.Path(path_type=Path), metavar="FILE.xml", help="Write the outcomes as JUnit XML too.")
@click.option("--output-dir", type=click.Path(path_type=Path), default=Path("runs"), show_default=True, help="Where results go.")
@click.option("--jobs", type=click.IntRange(min=1), help="How many scenarios run at a time; default: one per processor.")
def command(scenarios: tuple[Path, ...], update: bool, junit: Path | None, output_dir: Path, jobs: int | None) -> int:
    """Run every scenario that has checks or a reference, and hold it against them.

    SCENARIO is a file or the name of a shipped scenario; of a DIR its *.json count, without any the folder scenarios/. Each runs
    as by `cosim run`. With --update the references are written: the signals that the patterns of their tolerances name, as
    few rows as describe them, and beside them what made them; a run that fails its checks becomes no reference. Ends with 3 when
    a check or comparison was not met, 1 when a component failed, 2 when a scenario was refused.
    """
    expected = ("reference",) if update else EXPECTATION_KEYS
    files = [file for file in find_scenario_files(scenarios or [default_folder()]) if has_keys(file, expected)]
    if not files:
        raise InputError('there is no scenario with a "reference" (or, without --update, "checks")')
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
    click.echo(f"{len(outcomes)} scenarios, {failed} failed" if failed else f"{len(outcomes)} scenarios, all well")
    return min((outcome.code for outcome in outcomes), key=EXIT_CODE_SEVERITY.index)


def default_folder() -> Path:
    """The folder scenarios/ here, else that of the shipped ones."""
    own = Path("scenarios")
    return own if own.is_dir() else resources.root() / own


def find_scenario_files(paths: Iterable[Path]) -> Iterator[Path]:
    """The scenario files that are meant by files, names of shipped scenarios and folders. Raises InputError."""
    from ...scenario.nested_systems import find_scenario

    for path in paths:
        if not path.is_dir():
            yield find_scenario(path)
        elif files := sorted(path.glob("*.json")):
            yield from files
        else:
            raise InputError(f'the folder "{path}" holds no scenario (*.json)')


def check_unique_names(files: Iterable[Path]) -> None:
    """Each has a folder of its own for results. Raises InputError."""
    counts = Counter(file.stem for file in files)
    if several := [name for name, count in counts.items() if count > 1]:
        raise InputError(
            [f'{counts[name]} scenarios are called "{name}.json": their results would go to one folder' for name in several]
        )


def run_in_parallel(work: Sequence[Callable[[], T]], jobs: int) -> Iterator[T]:
    """What all functions return, in order; each is called on a thread that mostly waits for a child process.

    When the caller is interrupted, those that wait for their turn are not called any more.
    """
    from concurrent.futures import ThreadPoolExecutor

    pool = ThreadPoolExecutor(jobs)
    try:
        yield from pool.map(lambda function: function(), work)
    finally:
        pool.shutdown(cancel_futures=True)


def _print_outcome(outcome: RegressionOutcome) -> None:
    word = click.style("passed", fg="green") if outcome.code == 0 else click.style("FAILED", fg="red", bold=True)
    click.echo(f"{word}  {outcome.name:<28} {outcome.summary:<24} {outcome.seconds:5.1f} s")
    for line in outcome.details:
        click.echo(f"        {line}")


def _junit_case(outcome: RegressionOutcome) -> JUnitCase:
    from ...report.junit import JUnitCase

    kind = {0: "passed", 3: "failure"}.get(outcome.code, "error")
    return JUnitCase(outcome.name, kind, outcome.seconds, outcome.details)
