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

    from ..process.supervisor import SupervisedOutcome
    from ..report.live.control import LiveControl
    from ..scenario import PreparedRun

#: simulated seconds per second, unless `--real-time` says otherwise: what runs as fast as it can is over before it is seen
_DEFAULT_SPEED = 1.0

_view = click.option(
    "--view",
    is_flag=True,
    help="Show the run while it goes on, on a page for this machine's browser: pause, step, set its speed, tunable parameters "
    "and unconnected inputs. Begins in real time, or at the FACTOR of --real-time.",
)
_port = click.option("--view-port", type=click.IntRange(0, 65535), default=0, help="Port of that page; default: any free one.")


def view_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Whether and where the run is shown: `view` and `view_port`."""
    return _view(_port(command))


def check_view_options(isolation: str, sandbox: str | None, late: str) -> None:
    """Raises UsageError when a run under these conditions cannot be shown."""
    from ..process.supervisor import can_supervise

    if isolation == "none" or not can_supervise():
        raise click.UsageError("--view shows a supervised run: it does not go with --isolation none, nor where there is none")
    if sandbox == "strict":
        raise click.UsageError("--view needs the network of this machine, which --sandbox strict takes away")
    if late == "fail":
        raise click.UsageError("--late fail does not go with --view: whoever looks may stop the clock")


def run_with_view(
    run: Callable[[Connection], int], isolation: str, salvage: Callable[[SupervisedOutcome], None], port: int
) -> int:
    """Do as `supervision.protected` while the page is served; `run` gets the pipe that commands come through."""
    from ..process.temporary_folders import temporary_run_folder
    from ..report.live.live_view import LiveView, has_display, open_browser

    viewing = LiveView(port)
    click.echo(f"live view: {viewing.url}")
    with temporary_run_folder() as folder:
        if has_display():
            open_browser(viewing.url, Path(folder))
        return supervision.run_supervised_command(lambda: run(viewing.open_in_child()), isolation, salvage, viewing.serve)


def create_control(assembly: PreparedRun, link: Connection) -> LiveControl:
    """What steers a run from the other end of `link`."""
    from ..core.time_grid import TimeGrid
    from ..report.live.control import LiveControl
    from ..report.scene import build_scene

    settings, value = assembly.settings, assembly.document.value
    grid = TimeGrid.from_times(settings.start_time, settings.stop_time, settings.step_size)
    every = int((settings.record_interval or grid.step) / grid.step)
    about = {
        "name": assembly.spec.name,
        "description": assembly.spec.description,
        "scene": build_scene({"scenario": value, "scenario_file": str(assembly.document.file.resolve())}),
        "rows": grid.count // every + 1,
        "stop_time": float(settings.stop_time),
    }
    return LiveControl(link, assembly.system, grid, settings.real_time or _DEFAULT_SPEED, about)


def with_control(assembly: PreparedRun, control: LiveControl | None) -> PreparedRun:
    """The same to run with a control, which keeps pace itself."""
    if control is None:
        return assembly
    return replace(assembly, settings=replace(assembly.settings, real_time=None, step_hook=control))
