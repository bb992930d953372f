"""Options that choose what a command prints.

--quiet and --verbose of every command, --json of those that print data.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any, TextIO

import click

from ..process.standard_streams import protected_stream
from . import CommandLine


def _command_line(context: click.Context) -> CommandLine:
    return context.find_root().ensure_object(CommandLine)


def _be_quiet(context: click.Context, _option: click.Parameter, enabled: bool) -> None:
    if enabled:
        _command_line(context).verbosity = -1
        _redirect_output(context, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115


def _be_verbose(context: click.Context, _option: click.Parameter, enabled: bool) -> None:
    if enabled:
        _command_line(context).verbosity = 1


def _prepare_json(context: click.Context, _option: click.Parameter, enabled: bool) -> bool:
    """Send what components and functions of the user print to standard error, so that the output is JSON."""
    if enabled:
        _redirect_output(
            context, sys.stdout if _command_line(context).verbosity < 0 else sys.stderr
        )
    return enabled


def _redirect_output(context: click.Context, stream: TextIO) -> None:
    """Replace standard output; `CommandLine.data` keeps the former one."""
    command_line = _command_line(context)
    command_line.data = command_line.data or protected_stream(sys.stdout, duplicate=True)
    sys.stdout = stream


QUIET = click.Option(
    ["-q", "--quiet"],
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_be_quiet,
    help=(
        "Print only warnings, errors and failed checks, to standard error; with --json also the "
        "JSON text."
    ),
)
VERBOSE = click.Option(
    ["-v", "--verbose"],
    is_flag=True,
    expose_value=False,
    callback=_be_verbose,
    help="Print more: debug messages of FMUs, timings, and tables in full length.",
)


def json_option(content: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds the option `--json` to a command.

    Args:
        content: the JSON value in words, for the help text.
    """
    return click.option(
        "--json",
        "as_json",
        is_flag=True,
        callback=_prepare_json,
        help=f"Print only JSON: {content}.",
    )


def add_verbosity_options(command: click.Command) -> None:
    """Add `--quiet` and `--verbose` to a command, or to all commands of a group."""
    if isinstance(command, click.Group):
        for child in command.commands.values():
            add_verbosity_options(child)
    elif QUIET not in command.params:
        command.params += [QUIET, VERBOSE]
