"""`cosim run --view`: live page of a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from . import supervision
from .options import flag_option, options

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from ..process.supervisor import SupervisedOutcome
    from ..report.live.control import LiveControl
    from ..scenario import PreparedRun

#: simulated seconds per second of wall time without `--real-time`; at full speed a run ends before
#: it can be seen
_DEFAULT_SPEED = 1.0

view_options = options(
    flag_option(
        "--view",
        help=(
            "Show the run live in a browser on this machine: pause, step, set the speed, tunable "
            "parameters and unconnected inputs. Starts in real time, or with the FACTOR of "
            "--real-time."
        ),
    ),
    flag_option("--wait", help="With --view: begin when the live page has been opened."),
    click.option(
        "--view-port",
        type=click.IntRange(0, 65535),
        default=0,
        help="Port of the live page; default: any free port.",
    ),
)


def check_view_options(isolation: str, sandbox: str | None, late: str) -> None:
    """Raise UsageError if these options exclude a live view."""
    from ..process.supervisor import can_supervise

    if isolation == "none" or not can_supervise():
        raise click.UsageError(
            "--view requires a supervised run: it cannot be combined with --isolation none, and "
            "needs a platform with supervision"
        )
    if sandbox == "strict":
        raise click.UsageError(
            "--view requires a network connection to the browser, which --sandbox strict blocks"
        )
    if late == "fail":
        raise click.UsageError(
            "--view cannot be combined with --late fail: the user may pause the run"
        )


def run_with_view(
    run: Callable[[Connection], int],
    isolation: str,
    save_partial: Callable[[SupervisedOutcome], None],
    port: int,
    *,
    wait: bool = False,
) -> int:
    """Run a command in a supervised child process while this process serves the live page.

    Args:
        run: the command's work in the child; receives the connection to the page and returns the
            exit code.
        isolation: value of `--isolation`.
        save_partial: see `run_supervised_command`.
        port: port of the page; 0: any free port.
        wait: begin the run when the page has been opened.
    """
    from ..process.temporary_folders import temporary_run_folder
    from ..report.live.live_view import LiveView, has_display, open_browser

    view = LiveView(port, wait)
    click.echo(f"live view: {view.url}")
    with temporary_run_folder() as folder:
        if has_display():
            open_browser(view.url, Path(folder))
        return supervision.run_supervised_command(
            lambda: run(view.open_in_child()), isolation, save_partial, view.serve
        )


def create_control(prepared: PreparedRun, link: Connection, speed: float | None) -> LiveControl:
    """Return the control that paces the run and executes the commands of the page.

    Args:
        prepared: the run; it must not be paced itself.
        link: connection to the page.
        speed: simulated seconds per second at the start; None: in real time.
    """
    from ..report.live.control import LiveControl
    from ..report.scene import build_scene

    plan, document = prepared.plan, prepared.document
    metadata = {"scenario": document.value, "scenario_file": str(document.file.resolve())}
    about = {
        "name": prepared.spec.name,
        "description": prepared.spec.description,
        "scene": build_scene(metadata),
        "rows": plan.row_count,
        "stop_time": float(plan.settings.stop_time),
    }
    return LiveControl(link, plan.system, plan.grid, speed or _DEFAULT_SPEED, about)
