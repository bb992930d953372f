"""`cosim report`: report of a finished run."""

from __future__ import annotations

from pathlib import Path

import click

from ..completion import complete_scenario
from ..messages import print_log


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--output-file",
    type=click.Path(path_type=Path),
    help="File of the page; default: report.html in the folder of RESULT.",
)
@click.option(
    "--reference",
    type=click.Path(path_type=Path),
    shell_complete=complete_scenario,
    metavar="RESULT|SCENARIO",
    help=(
        "Also show the signals with the largest deviations from this result, or from the reference "
        "of this scenario."
    ),
)
@click.option("--open", "open_page", is_flag=True, help="Open the page in the browser.")
def command(
    result: Path, output_file: Path | None, reference: Path | None, open_page: bool
) -> None:
    """Write the report of a finished run again: KPIs, figures, system and 3-D replay.

    RESULT is a folder written by `cosim run`. The page is a single file and needs no network.
    """
    from ...api.comparison import ComparisonTask, is_scenario
    from ...report.finished_run import Deviation, write_folder_report
    from ...results.comparison import Tolerance
    from ...studies.regression import accept_command

    print_log()
    target = output_file or result / "report.html"
    if reference:
        task = ComparisonTask.read(result, reference, Tolerance())
        comparison = task.compare()
        accept = accept_command([str(reference)]) if is_scenario(reference) else ""
        deviation = None if comparison.passed else Deviation(str(comparison), task.changes, accept)
        write_folder_report(result, target, [task.figure(comparison)], deviation)
    else:
        write_folder_report(result, target)
    click.echo(target)
    if open_page:
        click.launch(str(target.absolute()))
