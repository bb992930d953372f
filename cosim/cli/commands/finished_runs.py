"""Commands that present finished runs: `cosim plot`, `report` and `replay`."""

from collections.abc import Iterable
from pathlib import Path

import click

from ..messages import print_log, progress_bar
from ..options import PATH, complete_scenario, csv_option, flag_option, page_option, path_option

FORMATS = ("png", "svg")


@click.command()
@click.argument("results", nargs=-1, required=True, metavar="RESULT...", type=PATH)
@path_option(
    "--output-dir",
    help="Folder for the figures; default: that of the result.",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice(FORMATS),
    default=FORMATS,
    help="File format of the figures; default: both.",
)
@flag_option(
    "--timings",
    help="Also draw a comparison of the real-time factors of all RESULTs.",
)
@flag_option("--video", help='Also render a video of each run, CAMERA.mp4 (extra "video").')
@csv_option
@click.option(
    "--camera",
    default="chase",
    help="Camera of the video: overview, chase (default), deck or landing.",
)
def plot(
    results: tuple[Path, ...],
    output_dir: Path | None,
    formats: tuple[str, ...],
    timings: bool,
    video: bool,
    camera: str,
) -> None:
    """Draw the figures of finished runs again; RESULT is a folder written by `cosim run`.

    Each figure of the scenario is written to NAME.png and NAME.svg, with its data in NAME.csv.
    Several RESULTs have separate folders in the output directory; the figure of --timings is
    written next to these.
    """
    from ...report.comparison_figures import draw_timings
    from ...report.figures import draw_figures
    from ...report.runs import load_figures, read_run
    from ...report.video import write_video

    suffixes = [f".{name}" for name in formats]
    runs = {directory: read_run(directory) for directory in results}
    for directory, result in runs.items():
        target = directory
        if output_dir:
            target = output_dir / directory.name if len(runs) > 1 else output_dir
        figures = load_figures(result)
        _print_paths(draw_figures(result, figures, target, suffixes, write_data=True))
        if video:
            with progress_bar(f"{camera}.mp4") as progress:
                file = write_video(result, target / f"{camera}.mp4", camera, progress=progress)
            _print_paths([file])
    if timings:
        first, *others = runs.values()
        figure = ("timings", draw_timings, {"others": others})
        target = output_dir or results[0].parent
        _print_paths(draw_figures(first, [figure], target, suffixes, write_data=True))


def _print_paths(files: Iterable[Path]) -> None:
    for path in files:
        click.echo(path)


@click.command()
@click.argument("result", type=PATH)
@path_option(
    "--output-file",
    help="File of the page; default: report.html in the folder of RESULT.",
)
@path_option(
    "--reference",
    shell_complete=complete_scenario,
    metavar="RESULT|SCENARIO",
    help=(
        "Also show the signals with the largest deviations from this result, or from the reference "
        "of this scenario."
    ),
)
@page_option
def report(result: Path, output_file: Path | None, reference: Path | None, open_page: bool) -> None:
    """Write the report of a finished run again: KPIs, figures, system and 3-D replay.

    RESULT is a folder written by `cosim run`. The page is a single file and needs no network.
    """
    from ...api.reference_comparison import ComparisonTask, is_scenario
    from ...report.run_page import Deviation, write_folder_report
    from ...results.tolerance_tube import Tolerance
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
    _show_page(target, open_page)


@click.command()
@click.argument("result", type=PATH)
@click.argument("other", required=False, type=PATH)
@path_option(
    "--output-file",
    help="File of the page; default: replay.html in the folder of RESULT.",
)
@page_option
def replay(result: Path, other: Path | None, output_file: Path | None, open_page: bool) -> None:
    """Write a page with the 3-D replay of one run, or of two runs to compare.

    RESULT and OTHER are folders written by `cosim run`; the bodies of both are shown in the same
    scene. The page is a single file and needs no network.
    """
    from ...report.replay import write_replay
    from ...report.runs import read_run
    from ...report.scene import build_scene

    target = output_file or result / "replay.html"
    runs = [read_run(directory) for directory in (result, *([other] if other else []))]
    write_replay(runs, target)
    if not build_scene(runs[0].metadata)["bodies"]:
        text = 'the scenario has no "scene": the page shows only signals and no 3-D view'
        click.echo(f"{result}: {text}", err=True)
    _show_page(target, open_page)


def _show_page(page: Path, open_page: bool) -> None:
    """Print the path of a page, and open it in the browser if required."""
    click.echo(page)
    if open_page:
        click.launch(str(page.absolute()))
