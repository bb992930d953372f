"""`cosim compare`: comparison of a result with the tubes around its reference."""

from __future__ import annotations

from pathlib import Path

import click

from ..completion import complete_scenario
from ..messages import print_json
from ..output_options import json_option


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.argument("reference", type=click.Path(path_type=Path), shell_complete=complete_scenario)
@click.option("--absolute", default=0.0, help="Tolerance of values, in the unit of each signal.")
@click.option(
    "--relative",
    default=0.0,
    help="Tolerance of values, relative to the range of each signal in the reference.",
)
@click.option("--time", default=0.0, help="Tolerance of time (s).")
@click.option(
    "--signals",
    multiple=True,
    metavar="PATTERN",
    help='Compare only these signals of the reference; "*" matches any text.',
)
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Draw the worst signals in their tubes (PNG or SVG).",
)
@json_option(
    "an object with passed and signals, a list of signal, passed, problem, time (s) and excess"
)
def command(
    result: Path,
    reference: Path,
    absolute: float,
    relative: float,
    time: float,
    signals: tuple[str, ...],
    plot: Path | None,
    as_json: bool,
) -> int:
    """Compare RESULT with REFERENCE, signal by signal.

    Each is a CSV file or a folder written by `cosim run`. Every signal of the reference must stay
    within the larger of the absolute and the relative tolerance, and within the tolerance of time;
    without tolerances it must be equal. If REFERENCE is a scenario file or the name of a shipped
    scenario, its reference and its tolerances are used. Exit code 0: all signals agree; 3: a signal
    leaves its tube, is missing, ends early, or is not finite. The text lists the 10 earliest
    failures.
    """
    from ...api.comparison import ComparisonTask
    from ...results.comparison import Tolerance

    if plot and plot.suffix not in (".png", ".svg"):
        raise click.BadParameter(
            f'"{plot}" has neither the suffix .png nor .svg', param_hint="--plot"
        )
    task = ComparisonTask.read(result, reference, Tolerance(absolute, relative, time), signals)
    comparison = task.compare()
    if plot:
        from ...report.figures import draw_figure, save_figure

        save_figure(draw_figure(task.result, *task.figure(comparison)), plot)
    if as_json:
        verdicts = [
            {**verdict._asdict(), "passed": verdict.passed} for verdict in comparison.verdicts
        ]
        print_json({"passed": comparison.passed, "signals": verdicts})
    else:
        share = task.needed_share() if comparison.passed else 0
        margin = f"; {share:.0%} of the tolerances would suffice" if share else ""
        click.echo(f"{comparison.shortened()}{margin}", err=not comparison.passed)
    return 0 if comparison.passed else 3
