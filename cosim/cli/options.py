"""Options that several commands share, and the shell completion of their arguments."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from ..core import resources
from ..core.errors import InputError, Problem
from ..process.standard_streams import protected_stream
from . import CommandLine

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

#: type of options that are paths
PATH = click.Path(path_type=Path)
#: values of an option that may be repeated
Texts = tuple[str, ...]
#: decorator that adds options to a command
Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def options(*decorators: Decorator) -> Decorator:
    """Return a decorator that adds several options to a command."""

    def add_options(command: Callable[..., Any]) -> Callable[..., Any]:
        for decorate in reversed(decorators):
            command = decorate(command)
        return command

    return add_options


def flag_option(*names: str, **settings: Any) -> Decorator:
    """Return a decorator that adds an option without a value to a command."""
    return click.option(*names, is_flag=True, **settings)


def path_option(*names: str, **settings: Any) -> Decorator:
    """Return a decorator that adds an option whose value is a path to a command."""
    return click.option(*names, type=PATH, **settings)


def complete_shipped(
    pattern: str,
) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    """Return a completion by the shipped files that match a pattern, and by the user's JSON files.

    The shell completes other paths if none of these fits.
    """

    def complete(
        _context: click.Context, _parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        folder = Path(incomplete) if incomplete.endswith("/") else Path(incomplete).parent
        files = sorted(str(path) for path in folder.glob("*.json"))
        names = [*resources.shipped_names(pattern), *files]
        found = [CompletionItem(name) for name in names if name.startswith(incomplete)]
        return [CompletionItem(incomplete, type="file"), *found]

    return complete


complete_scenario = complete_shipped("scenarios/*.json")
complete_study = complete_shipped("scenarios/sweeps/*.json")
complete_role = complete_shipped("scenarios/roles/*.json")

scenario_argument = click.argument("scenario", shell_complete=complete_scenario)
settings_option = click.option(
    "--set", "settings", multiple=True, metavar="NAME=value", help="As for `cosim run`."
)
output_dir_option = path_option(
    "--output-dir",
    help="Folder for the results; default: runs/NAME.",
)
jobs_option = click.option(
    "--jobs",
    type=click.IntRange(min=1),
    help="Number of scenarios at a time; default: one per processor.",
)
page_option = flag_option("--open", "open_page", help="Open the page in the browser.")


def new_file_options(result: str = "file") -> Decorator:
    """Return a decorator that adds `--directory` and `--force` to a command that creates files."""
    help_texts = {
        "file": ("Folder of the file; default: the working directory.", "an existing file"),
        "folder": ("Parent of the folder NAME; default: the working directory.", "existing files"),
    }
    where, what = help_texts[result]
    return options(
        path_option("--directory", default=Path(), help=where),
        flag_option("--force", help=f"Overwrite {what}."),
    )


def refuse_existing(paths: Iterable[Path], force: bool) -> None:
    """Raise InputError if files exist and `--force` is not given."""
    present = [str(path) for path in paths if path.exists()]
    if present and not force:
        raise InputError([Problem("exists; --force overwrites it", path) for path in present])


def _set_excel_safe(_context: click.Context, _option: click.Parameter, enabled: bool) -> None:
    if enabled:
        from ..results.csv_files import set_excel_safe

        set_excel_safe(True)


#: option of commands that write CSV files
csv_option = flag_option(
    "--excel-safe",
    expose_value=False,
    callback=_set_excel_safe,
    help=(
        "In CSV files, write an apostrophe before texts that begin with = + - or @, which "
        "spreadsheets take for formulas."
    ),
)


def json_option(content: str) -> Decorator:
    """Return a decorator that adds the option `--json` to a command.

    Args:
        content: the JSON value in words, for the help text.
    """
    return flag_option(
        "--json",
        "as_json",
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
    """Send what components and functions of the user print to standard error.

    So the output is JSON.
    """
    if enabled:
        is_quiet = _command_line(context).verbosity < 0
        _redirect_output(context, sys.stdout if is_quiet else sys.stderr)
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
