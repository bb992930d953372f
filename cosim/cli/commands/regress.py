"""`cosim regress`: regression test of all scenarios against their checks and references."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...core.processors import available_processors
from ...studies.regression import RegressionOutcome
from ...studies.regression_runs import default_folder, run_regressions
from ..messages import print_verdict

if TYPE_CHECKING:
    from ...report.junit import JUnitCase

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
    outcomes = []
    for outcome in run_regressions(scenarios or [default_folder()], update, output_dir, jobs or available_processors()):
        _print_outcome(outcome)
        outcomes.append(outcome)
    if junit:
        from ...report.junit import write_junit

        write_junit("cosim regress", [_junit_case(outcome) for outcome in outcomes], junit)
    failed = sum(outcome.code != 0 for outcome in outcomes)
    count = "1 scenario" if len(outcomes) == 1 else f"{len(outcomes)} scenarios"
    click.echo(f"{count}, {failed} failed" if failed else f"{count}, all passed")
    return min((outcome.code for outcome in outcomes), key=EXIT_CODE_SEVERITY.index)


def _print_outcome(outcome: RegressionOutcome) -> None:
    print_verdict(outcome.code == 0)
    click.echo(f"  {outcome.name:<28} {outcome.summary:<24} {outcome.seconds:5.1f} s")
    for line in outcome.details:
        click.echo(f"        {line}")


def _junit_case(outcome: RegressionOutcome) -> JUnitCase:
    from ...report.junit import JUnitCase

    kind = {0: "passed", 3: "failure"}.get(outcome.code, "error")
    return JUnitCase(outcome.name, kind, outcome.seconds, outcome.details)
