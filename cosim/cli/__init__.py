"""Command line of cosim.

Each command imports its packages only when it runs, which keeps `cosim --help` fast.
"""

import atexit
import gc
import os
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TextIO

import click

from ..core import __version__
from ..core.errors import CosimError, did_you_mean
from ..process.standard_streams import open_closed_streams, protected_stream

#: descriptions of the commands
COMMANDS = {
    "run": "Run a scenario and write results, figures and a report.",
    "check": "Check a scenario without running it and print the expanded system.",
    "recover": "Write the results of a run that could not be written when it ended.",
    "simulate": "Simulate a single FMU.",
    "compare": "Compare a result with a reference, signal by signal.",
    "regress": (
        "Run all scenarios that have checks or a reference, and compare their results with these."
    ),
    "bench-controller": "Benchmark a controller in every scenario with its role.",
    "sweep": "Run a scenario at many points: parameter studies and Monte Carlo.",
    "tune": "Find the parameters that minimise a KPI.",
    "trim": "Find values with which a scenario starts in equilibrium.",
    "linearize": "Linearise a scenario, or some of its components, at a point in time.",
    "margins": "Print the stability margins at the inputs and outputs of a controller.",
    "plot": "Draw the figures of finished runs again.",
    "report": "Write the report of a finished run again.",
    "replay": "Write a page with the 3-D replay of one run, or of two runs to compare.",
    "info": "Print the properties and variables of an FMU.",
    "validate": "Validate FMUs against the FMI standard without running them.",
    "build": "Export controllers and plants to fmus/.",
    "init": "Create a project with a controller, a scenario, its reference, tests and CI.",
    "new": "Create a controller, a scenario, or a vehicle.",
    "list": "List the shipped scenarios, sweeps, vehicle models, roles of controllers and KPIs.",
    "schema": "Print the JSON Schema of scenarios, sweeps or tunings.",
    "doctor": "Print which packages, tools and sandboxes are available on this machine.",
}
#: module in `commands`, ":" and function of the commands that have no module of their own
_FUNCTIONS = {
    "compare": "regress:compare",
    "regress": "regress:regress",
    "trim": "analysis:trim",
    "linearize": "analysis:linearize",
    "margins": "analysis:margins",
    "plot": "finished_runs:plot",
    "report": "finished_runs:report",
    "replay": "finished_runs:replay",
    "list": "list:list_shipped",
    "schema": "list:schema",
}


#: new objects after which Python searches for reference cycles; a run with figures makes 400 000
_GC_THRESHOLD = 500_000


class _LazyGroup(click.Group):
    """Command group that imports a command only when it is used."""

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return list(COMMANDS)

    def get_command(self, _ctx: click.Context, name: str) -> click.Command | None:
        """Import the command called `name`; None if there is none."""
        if name not in COMMANDS:
            return None
        default = f"{name.replace('-', '_')}:command"
        module, _, function = _FUNCTIONS.get(name, default).partition(":")
        imported = import_module(f".commands.{module}", __name__)
        command: click.Command = getattr(imported, function)
        import_module(".options", __name__).add_verbosity_options(command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return name, command and remaining arguments.

        The error of an unknown command names the nearest valid one.
        """
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"No such command '{args[0]}'{did_you_mean(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@dataclass
class CommandLine:
    """Arguments of this call of `cosim`, and its options once click has parsed them.

    Attributes:
        arguments: words after the program's name.
        debug: --debug was given.
        verbosity: -1 with --quiet, 1 with --verbose.
        data: stream for the text of --json; None: standard output.
    """

    arguments: tuple[str, ...] = ()
    debug: bool = False
    verbosity: int = 0
    data: TextIO | None = None


def current_command_line() -> CommandLine:
    """Return the command line of the running command.

    An empty one if it was called without the group `cosim`.
    """
    context = click.get_current_context(silent=True)
    return context.find_root().ensure_object(CommandLine) if context else CommandLine()


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
    if arguments is None:
        # almost all objects of a command exist until its process ends
        gc.set_threshold(_GC_THRESHOLD)
        atexit.register(gc.freeze)
        # NumPy's BLAS starts threads when it is loaded. They wait busily, which takes a fifth of
        # the processor time of a short run, and large matrices get other bits with each number
        # of processors
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        arguments = sys.argv[1:]
    open_closed_streams()
    sys.stdout, sys.stderr = protected_stream(sys.stdout), protected_stream(sys.stderr)
    sys.exit(run_command_line(arguments))


def run_command_line(arguments: list[str]) -> int:
    """Run the command `cosim` in this process and return its exit code."""
    command_line = CommandLine(tuple(arguments))
    return run_guarded(
        lambda: cli.main(arguments, prog_name="cosim", standalone_mode=False, obj=command_line),
        command_line,
    )


def run_guarded(command: Callable[[], Any], command_line: CommandLine) -> int:
    """Call `command` and return its exit code, 0 if it returns none.

    Report whatever it raises to the user.
    """
    try:
        code = command()
        return code if isinstance(code, int) else 0
    except (Exception, KeyboardInterrupt) as error:
        return report_error(error, command_line)


def report_error(error: BaseException, command_line: CommandLine) -> int:
    """Print an error to standard error and return its exit code; --debug adds the traceback."""
    if isinstance(error, click.ClickException):
        error.show()
        return error.exit_code
    interrupted = isinstance(error, KeyboardInterrupt | click.exceptions.Abort)
    if command_line.debug and not interrupted:
        traceback.print_exception(error)
    if interrupted:
        text = "interrupted"
    elif isinstance(error, CosimError):
        text = str(error)
    elif isinstance(error, OSError):
        text = f"operating system error: {error}"
    elif isinstance(error, MemoryError):
        text = "the memory of the process is used up"
    else:
        text = (
            f"internal error: {type(error).__name__}: {error}  (`cosim --debug ...` prints the "
            "traceback)"
        )
    click.echo(text, err=True)
    return exit_code_of(error)


def exit_code_of(error: BaseException) -> int:
    """Return the exit code for an error."""
    if isinstance(error, KeyboardInterrupt | click.exceptions.Abort):
        return 130
    if isinstance(error, click.ClickException | CosimError):
        return error.exit_code
    return 1 if isinstance(error, OSError | MemoryError) else 70
