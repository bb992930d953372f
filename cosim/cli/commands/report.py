"""`cosim report`: report of a finished run."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.option(
    "--output-file", type=click.Path(path_type=Path), help="File of the page; default: report.html in the folder of RESULT."
)
@click.option("--open", "open_page", is_flag=True, help="Open the page in the browser.")
def command(result: Path, output_file: Path | None, open_page: bool) -> None:
    """Write the report of a finished run again: KPIs, figures, system and 3-D replay.

    RESULT is a folder written by `cosim run`. The page is a single file and needs no network.
    """
    from ...report.figures import draw_figure, figure_to_svg
    from ...report.run_page import write_report
    from ...report.runs import load_figures, read_run
    from ...results.checks import evaluate_checks

    run, target = read_run(result), output_file or result / "report.html"
    checks = run.metadata.get("scenario", {}).get("checks", [])
    outcomes = evaluate_checks(run.kpis, [check for check in checks if check["kpi"] in run.kpis])
    pictures = (
        (name, figure_to_svg(draw_figure(run, name, function, arguments))) for name, function, arguments in load_figures(run)
    )
    write_report(run, outcomes, pictures, target)
    click.echo(target)
    if open_page:
        click.launch(str(target.absolute()))
