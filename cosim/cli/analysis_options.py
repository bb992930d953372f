"""Common parts of the commands that analyse a scenario as a control loop.

Trim, linearize and margins.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .completion import complete_scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def scenario_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the argument SCENARIO and the option `--set` to a command."""
    settings = click.option(
        "--set", "settings", multiple=True, metavar="NAME=value", help="As for `cosim run`."
    )
    return click.argument("scenario", shell_complete=complete_scenario)(settings(function))


def time_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options `--at` and `--duration` to a command."""
    at = click.option("--at", help="Time (s) of the operating point; default: the start time.")
    duration = click.option(
        "--duration",
        type=click.FloatRange(min=0, min_open=True),
        help="Duration (s) of the responses; default: 256 samples.",
    )
    return at(duration(function))


def split_names(texts: Iterable[str]) -> list[str]:
    """Return the names in texts such as "a,b".

    Commas in brackets, as in "gain[1,2]", separate no names.
    """
    names: list[str] = []
    for text in texts:
        depth, begin = 0, 0
        for i, character in enumerate(f"{text},"):
            depth += (character == "[") - (character == "]")
            if character == "," and not depth:
                names.append(text[begin:i].strip())
                begin = i + 1
    return [name for name in names if name]


def print_notes(notes: Sequence[str]) -> None:
    """Print hints about the validity of a result to standard error."""
    for note in notes:
        click.echo(f"NOTE {note}", err=True)


def write_figures(figures: Iterable[tuple[str, Callable[[], Figure]]], folder: Path) -> None:
    """Draw figures in the common style, and write NAME.png and NAME.svg of each.

    Args:
        figures: Name, and function that draws the figure.
        folder: The folder; it is created.
    """
    from ..report.figures import figure_style, save_figure

    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in figures:
        with figure_style():
            figure = draw()
        for suffix in (".png", ".svg"):
            save_figure(figure, folder / f"{name}{suffix}")
            click.echo(folder / f"{name}{suffix}")
