"""`cosim check`: check of a scenario without running it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import click

from ...core.errors import InputError
from ...core.system import Group, Stage
from .. import strict_sandbox, supervision

if TYPE_CHECKING:
    from ...scenario import PreparedRun


@click.command(cls=strict_sandbox.SandboxCommand)
@click.argument("scenario")
@click.option("--set", "settings", multiple=True, metavar="NAME=value", help="As for `cosim run`.")
@click.option("--connections/--no-connections", default=True, help="List every connection.")
@supervision.supervision_options
def command(scenario: str, settings: tuple[str, ...], connections: bool, isolation: str, sandbox: str | None) -> None:
    """Check SCENARIO without running it and print the expanded system.

    SCENARIO is a JSON file or the name of a shipped scenario. Prints components, processes, stages, connections and unit
    conversions. Probable mistakes are warnings: a forgotten connection, a missing reference, an event after the end.
    --isolation and --sandbox only affect the printed processes.
    """
    from ...api import load
    from ...scenario.nested_systems import parse_settings
    from ...scenario.plausibility import find_warnings

    fmu_isolation: Literal["fmu", "none"] = "fmu" if isolation == "fmu" else "none"
    prepared = load(scenario, parse_settings(settings), isolation=fmu_isolation, sandbox=bool(sandbox))
    try:
        if problems := prepared.figure_problems():
            raise InputError(problems)
        _print_components(prepared)
        _print_processes(prepared, isolation, sandbox)
        _print_stages(prepared)
        if connections:
            _print_connections(prepared)
            _print_unconnected_inputs(prepared)
        warnings = find_warnings(prepared)
        for problem in warnings:
            click.echo(f"WARNING {problem}", err=True)
        verdict = f"{len(warnings)} warning{'s' * (len(warnings) > 1)}." if warnings else "No warnings."
        times, steps = prepared.settings, prepared.plan.grid.count
        click.echo(
            f"\n{prepared.spec.name}: {float(times.start_time):g} s ... {float(times.stop_time):g} s in {steps} steps of "
            f"{float(times.step_size):g} s, {len(times.columns)} signals recorded. {verdict}"
        )
    finally:
        prepared.free()


def _print_components(prepared: PreparedRun) -> None:
    click.echo("components")
    width, sources = max(map(len, prepared.system.components)), prepared.sources
    for name, component in prepared.system.components.items():
        counts = {
            kind: sum(len(v.scalar_names) for v in component.variables if v.causality == kind) for kind in ("input", "output")
        }
        period = prepared.system.periods.get(name)
        every = f", every {float(period):g} s" if period else ""
        click.echo(f"  {name:{width}}  {sources[name]}, {counts['input']} inputs, {counts['output']} outputs{every}")


def _print_processes(prepared: PreparedRun, isolation: str, sandbox: str | None) -> None:
    from ...components.fmi.isolated.isolated_fmu import IsolatedFmu

    components = prepared.system.components
    isolated = {name: component.isolation for name, component in components.items() if isinstance(component, IsolatedFmu)}
    shared = [name for name in components if name not in isolated]
    click.echo("\nprocesses" + (", all in bubblewrap" if sandbox == "strict" else ""))
    if shared:
        click.echo(f"  {'process of the command' if isolation == 'none' else 'supervised process'}: {', '.join(shared)}")
    for name, settings in isolated.items():
        click.echo(f"  {name}: its own process{', in a sandbox' if settings.sandbox else ''}")


def _print_stages(prepared: PreparedRun) -> None:
    click.echo("\nstages, in order (the components of a line may step in parallel)")
    _print_nested_stages(prepared.system.stages, "  ")


def _print_nested_stages(stages: Sequence[Stage], indent: str) -> None:
    for i, stage in enumerate(stages, 1):
        names = ", ".join(member.name if isinstance(member, Group) else member for member in stage)
        click.echo(f"{indent}{i}. {names}")
        for member in stage:
            if isinstance(member, Group):
                _print_nested_stages(member.stages, indent + "   ")


def _print_connections(prepared: PreparedRun) -> None:
    from ...scenario.overview import connection_notes

    system = prepared.system
    click.echo(f"\nconnections ({len(system.connections)})")
    for connection in system.connections:
        notes = connection_notes(system, connection)
        click.echo(f"  {connection.source} -> {connection.target}" + (f"  ({notes})" if notes else ""))


def _print_unconnected_inputs(prepared: PreparedRun) -> None:
    """Print the inputs that keep their start values."""
    from ...scenario.plausibility import unconnected_inputs

    unconnected: dict[str, list[str]] = {}
    for end in unconnected_inputs(prepared):
        unconnected.setdefault(end.component, []).append(end.scalar)
    for name, slots in unconnected.items():
        click.echo(f"\nunconnected inputs of {name}\n  {', '.join(slots)}")
