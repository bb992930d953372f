"""`cosim plot`: figures and videos of finished runs."""

from __future__ import annotations

from pathlib import Path

import click

from ..csv_options import csv_options
from ..progress import progress_bar

FORMATS = ("png", "svg")


@click.command()
@click.argument(
    "results", nargs=-1, required=True, metavar="RESULT...", type=click.Path(path_type=Path)
)
@click.option(
    "--output-dir",
    type=click.Path(path_type=Path),
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
@click.option(
    "--timings",
    is_flag=True,
    help="Also draw a comparison of the real-time factors of all RESULTs.",
)
@click.option(
    "--video", is_flag=True, help='Also render a video of each run, CAMERA.mp4 (extra "video").'
)
@csv_options
@click.option(
    "--camera",
    default="chase",
    help="Camera of the video: overview, chase (default), deck or landing.",
)
def command(
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
    from ...report.figures import draw_figures
    from ...report.runs import load_figures, read_run
    from ...report.timings import draw_timings
    from ...report.video import write_video

    suffixes = [f".{name}" for name in formats]
    runs = {directory: read_run(directory) for directory in results}
    for directory, result in runs.items():
        target = (
            directory
            if output_dir is None
            else output_dir / directory.name
            if len(runs) > 1
            else output_dir
        )
        _print_paths(draw_figures(result, load_figures(result), target, suffixes, write_data=True))
        if video:
            with progress_bar(f"{camera}.mp4") as progress:
                file = write_video(result, target / f"{camera}.mp4", camera, progress=progress)
            _print_paths([file])
    if timings:
        figure = ("timings", draw_timings, {"others": list(runs.values())[1:]})
        _print_paths(
            draw_figures(
                next(iter(runs.values())),
                [figure],
                output_dir or results[0].parent,
                suffixes,
                write_data=True,
            )
        )


def _print_paths(files: list[Path]) -> None:
    for path in files:
        click.echo(path)
