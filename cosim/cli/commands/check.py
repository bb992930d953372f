"""`cosim check`: what a scenario becomes before it runs."""

from __future__ import annotations

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
    """Load, wire and validate SCENARIO without running it; print components, processes, stages, connections and conversions.

    What is probably a mistake is a warning: a forgotten connection, a missing reference, an event after the end.
    --isolation and --sandbox are those of `cosim run`; here they only say what would run where.
    """
    from ...api import load
    from ...scenario.nested_systems import parse_settings
    from ...scenario.plausibility import find_warnings

    apart: Literal["fmu", "none"] = "fmu" if isolation == "fmu" else "none"
    assembly = load(scenario, parse_settings(settings), isolation=apart, sandbox=bool(sandbox))
    try:
        if problems := assembly.figure_problems():
            raise InputError(problems)
        _print_components(assembly)
        _print_processes(assembly, isolation, sandbox)
        _print_stages(assembly)
        if connections:
            _print_connections(assembly)
            _print_unconnected_inputs(assembly)
        found = find_warnings(assembly)
        for problem in found:
            click.echo(f"WARNING {problem}", err=True)
        verdict = f"{len(found)} warning{'s' * (len(found) > 1)}." if found else "All is well."
        times = assembly.settings
        steps = int((times.stop_time - times.start_time) / times.step_size)
        click.echo(
            f"\n{assembly.spec.name}: {float(times.start_time):g} s ... {float(times.stop_time):g} s in {steps} steps of "
            f"{float(times.step_size):g} s, {len(times.columns)} signals recorded. {verdict}"
        )
    finally:
        assembly.free()


def _print_components(assembly: PreparedRun) -> None:
    click.echo("components")
    width = max(map(len, assembly.system.components))
    for name, component in assembly.system.components.items():
        counts = {
            kind: sum(len(v.scalar_names) for v in component.variables if v.causality == kind) for kind in ("input", "output")
        }
        period = assembly.system.periods.get(name)
        every = f", every {float(period):g} s" if period else ""
        click.echo(
            f"  {name:{width}}  {assembly.component_source(name)}, {counts['input']} inputs, {counts['output']} outputs{every}"
        )


def _print_processes(assembly: PreparedRun, isolation: str, sandbox: str | None) -> None:
    from ...components.fmi.isolated.isolated_fmu import IsolatedFmu

    components = assembly.system.components
    apart = {name: component.isolation for name, component in components.items() if isinstance(component, IsolatedFmu)}
    together = [name for name in components if name not in apart]
    click.echo("\nprocesses" + (", all of them in bubblewrap" if sandbox == "strict" else ""))
    if together:
        click.echo(f"  {'that of the command' if isolation == 'none' else 'the supervised run'}: {', '.join(together)}")
    for name, how in apart.items():
        click.echo(f"  {name}: one of its own{', in a sandbox' if how.sandbox else ''}")


def _print_stages(assembly: PreparedRun) -> None:
    click.echo("\nstages, in order (components of one line step side by side)")
    _print_nested_stages(assembly.system.stages, "  ")


def _print_nested_stages(stages: tuple[Stage, ...] | object, indent: str) -> None:
    for i, stage in enumerate(stages, 1):  # type: ignore[var-annotated,arg-type]
        names = ", ".join(member.name if isinstance(member, Group) else member for member in stage)
        click.echo(f"{indent}{i}. {names}")
        for member in stage:
            if isinstance(member, Group):
                _print_nested_stages(member.stages, indent + "   ")


def _print_connections(assembly: PreparedRun) -> None:
    from ...engine.transfer_plan import unit_conversion

    system = assembly.system
    click.echo(f"\nconnections ({len(system.connections)})")
    for connection in system.connections:
        source, target = system.find_element(connection.source).variable, system.find_element(connection.target).variable
        notes = [f"delay {connection.delay}"] if connection.delay else []
        if unit_conversion(source, target) != (1.0, 0.0) and source.unit and target.unit:
            notes.append(f"{source.unit.name} to {target.unit.name}")
        if source.type != target.type:
            notes.append(f"{source.type} to {target.type}")
        click.echo(f"  {connection.source} -> {connection.target}" + (f"  ({', '.join(notes)})" if notes else ""))


def _print_unconnected_inputs(assembly: PreparedRun) -> None:
    """Inputs that keep their own start values."""
    from ...scenario.plausibility import unconnected_inputs

    free: dict[str, list[str]] = {}
    for end in unconnected_inputs(assembly):
        free.setdefault(end.component, []).append(end.scalar)
    for name, slots in free.items():
        click.echo(f"\ninputs of {name} that nothing feeds or sets\n  {', '.join(slots)}")
