"""`cosim run --view`: the page of a run while it goes on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import supervision

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from ..process.supervisor import Outcome
    from ..report.live.control import Control
    from ..scenario import Assembly

#: simulated seconds per second, unless `--real-time` says otherwise: what runs as fast as it can is over before it is seen
_SPEED = 1.0

_view = click.option(
    "--view",
    is_flag=True,
    help="Show the run while it goes on, on a page for this machine's browser: pause, step, set its speed, tunable parameters "
    "and unconnected inputs. Begins in real time, or at the FACTOR of --real-time.",
)
_port = click.option("--view-port", type=click.IntRange(0, 65535), default=0, help="Port of that page; default: any free one.")


def option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Whether and where the run is shown: `view` and `view_port`."""
    return _view(_port(command))


def require(isolation: str, sandbox: str | None, late: str) -> None:
    """Raises UsageError when a run under these conditions cannot be shown."""
    from ..process.supervisor import possible

    if isolation == "none" or not possible():
        raise click.UsageError("--view shows a supervised run: it does not go with --isolation none, nor where there is none")
    if sandbox == "strict":
        raise click.UsageError("--view needs the network of this machine, which --sandbox strict takes away")
    if late == "fail":
        raise click.UsageError("--late fail does not go with --view: whoever looks may stop the clock")


def viewed(run: Callable[[Connection], int], isolation: str, salvage: Callable[[Outcome], None], port: int) -> int:
    """Do as `supervision.protected` while the page is served; `run` gets the pipe that commands come through."""
    from ..process.temporary_folders import run_folder
    from ..report.live.viewing import Viewing, has_display, open_browser

    viewing = Viewing(port)
    click.echo(f"live view: {viewing.url}")
    with run_folder() as folder:
        if has_display():
            open_browser(viewing.url, Path(folder))
        return supervision.protected(lambda: run(viewing.link()), isolation, salvage, viewing.serving)


def control(assembly: Assembly, link: Connection) -> Control:
    """What steers a run from the other end of `link`."""
    from ..core.time_grid import Grid
    from ..report.live.control import Control
    from ..report.scene import scene_of

    settings, value = assembly.settings, assembly.document.value
    grid = Grid.of(settings.start_time, settings.stop_time, settings.step_size)
    every = int((settings.record_interval or grid.step) / grid.step)
    about = {
        "name": assembly.spec.name,
        "description": assembly.spec.description,
        "scene": scene_of({"scenario": value, "scenario_file": str(assembly.document.file.resolve())}),
        "rows": grid.count // every + 1,
        "stop_time": float(settings.stop_time),
    }
    return Control(link, assembly.system, grid, settings.real_time or _SPEED, about)


def controlled(assembly: Assembly, control: Control | None) -> Assembly:
    """The same to run with a control, which keeps pace itself."""
    if control is None:
        return assembly
    return replace(assembly, settings=replace(assembly.settings, real_time=None, control=control))
