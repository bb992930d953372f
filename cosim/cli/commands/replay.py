"""`cosim replay`: runs in three dimensions."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.argument("other", required=False, type=click.Path(path_type=Path))
@click.option("--output-file", type=click.Path(path_type=Path), help="Default: replay.html in the folder of RESULT.")
@click.option("--open", "shall_open", is_flag=True, help="Show the page in the browser.")
def command(result: Path, other: Path | None, output_file: Path | None, shall_open: bool) -> None:
    """Make a page with the 3-D replay of RESULT, a folder that `cosim run` wrote.

    The page is one file and needs no network. With OTHER, a second run is laid over the first one.
    """
    from ...report.replay import write_replay
    from ...report.runs import read_run
    from ...report.scene import build_scene

    target = output_file or result / "replay.html"
    runs = [read_run(directory) for directory in (result, *([other] if other else []))]
    write_replay(runs, target)
    if not build_scene(runs[0].metadata)["bodies"]:
        text = 'nothing says what this run looks like (key "scene" of the scenario): the page shows signals, and nothing in 3-D'
        click.echo(f"{result}: {text}", err=True)
    click.echo(target)
    if shall_open:
        click.launch(str(target.absolute()))
