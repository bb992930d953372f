"""The command line. Each command imports what it needs when it runs, so that `cosim --help` is quick."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import click

from ..core.errors import CosimError
from ..core.version import __version__
from ..process.standard_streams import ignoring_broken_pipe

#: command -> (module in this package, what it does)
COMMANDS = {
    "run": ("run", "Run a scenario; write results and figures."),
    "check": ("check", "Load, wire and validate a scenario; print the expanded system."),
    "simulate": ("simulate", "Simulate one FMU alone."),
    "compare": ("compare", "Compare a result with a reference, signal by signal."),
    "regress": ("regress", "Run all scenarios that have checks or references, and hold them against these."),
    "bench-controller": ("bench_controller", "Put a controller in a shipped one's place, in every scenario that has it."),
    "sweep": ("sweep", "Run a scenario at many points: parameter studies and Monte Carlo, here or on a cluster."),
    "tune": ("tune", "Find the parameters that make a KPI small."),
    "plot": ("plot", "Draw the figures of finished runs again."),
    "report": ("report", "Make the page about a finished run again."),
    "replay": ("replay", "Make a page with the 3-D replay of one run, or of two to compare."),
    "info": ("info", "Print what an FMU says about itself."),
    "validate": ("validate", "Examine FMUs against the FMI standard without running them."),
    "build": ("build", "Export controllers and plants to fmus/."),
    "init": ("init", "Begin a project of your own: controller, scenario, reference, tests, CI."),
    "new": ("new", "Begin a controller of your own that runs at once."),
    "schema": ("schema", "Print the JSON Schema of scenarios."),
    "doctor": ("doctor", "Print what is installed and active here."),
}


class _LazyGroup(click.Group):
    """Knows its commands by name and imports them when they are used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        command: click.Command = import_module(f".commands.{COMMANDS[name][0]}", __name__).command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in COMMANDS.items()])


@dataclass
class CommandLine:
    """Arguments of this call of `cosim`, and its option --debug once click has parsed it."""

    arguments: tuple[str, ...] = ()
    debug: bool = False


def current_command_line() -> CommandLine:
    """Return the command line of the running command; an empty one if the command was called without the group `cosim`."""
    return click.get_current_context().find_root().ensure_object(CommandLine)


@click.command(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--debug", is_flag=True, help="Show tracebacks.")
@click.version_option(__version__, package_name="cosim", message="cosim %(version)s")
def cli(debug: bool) -> None:
    """Run FMI co-simulations of controllers and plants in lockstep."""
    current_command_line().debug = debug


def main(arguments: list[str] | None = None) -> None:
    """Run the command `cosim` and end the process with its exit code.

    Args:
        arguments: words after the program's name; default: those of this process.
    """
    sys.stdout, sys.stderr = ignoring_broken_pipe(sys.stdout), ignoring_broken_pipe(sys.stderr)
    sys.exit(_run_command_line(sys.argv[1:] if arguments is None else arguments))


def _run_command_line(arguments: list[str]) -> int:
    command_line = CommandLine(tuple(arguments))
    return run_guarded(
        lambda: _exit_code(cli.main(arguments, prog_name="cosim", standalone_mode=False, obj=command_line)), command_line
    )


def run_guarded(command: Callable[[], int], command_line: CommandLine) -> int:
    """Call `command` and return its exit code; report whatever it raises to the user."""
    try:
        return command()
    except (Exception, KeyboardInterrupt) as error:
        return report_error(error, command_line)


def report_error(error: BaseException, command_line: CommandLine) -> int:
    """Print an error to standard error, with its traceback after --debug, and return the exit code for it."""
    if isinstance(error, KeyboardInterrupt | click.exceptions.Abort):
        click.echo("interrupted", err=True)
        return 130
    if isinstance(error, click.ClickException):
        error.show()
        return error.exit_code
    if command_line.debug:
        traceback.print_exception(error)
    if isinstance(error, CosimError):
        click.echo(str(error), err=True)
        return error.exit_code
    if isinstance(error, OSError):
        click.echo(f"operating system error: {error}", err=True)
        return 1
    click.echo(f"internal error: {type(error).__name__}: {error}  (`cosim --debug ...` prints the traceback)", err=True)
    return 70


def _exit_code(value: Any) -> int:
    return value if isinstance(value, int) else 0
