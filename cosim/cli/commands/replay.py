"""`cosim replay`: page with the 3-D replay of runs."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.argument("other", required=False, type=click.Path(path_type=Path))
@click.option(
    "--output-file",
    type=click.Path(path_type=Path),
    help="File of the page; default: replay.html in the folder of RESULT.",
)
@click.option("--open", "open_page", is_flag=True, help="Open the page in the browser.")
def command(result: Path, other: Path | None, output_file: Path | None, open_page: bool) -> None:
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
    click.echo(target)
    if open_page:
        click.launch(str(target.absolute()))
