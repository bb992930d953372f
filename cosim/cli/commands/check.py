"""`cosim check`: what a scenario becomes before it runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

from ...core.errors import InputError
from ...core.system import Group, Stage
from .. import strict_sandbox, supervision

if TYPE_CHECKING:
    from ...scenario import Assembly


@click.command(cls=strict_sandbox.Command)
@click.argument("scenario")
@click.option("--set", "settings", multiple=True, metavar="NAME=value", help="As for `cosim run`.")
@click.option("--connections/--no-connections", default=True, help="List every connection.")
@supervision.option
def command(scenario: str, settings: tuple[str, ...], connections: bool, isolation: str, sandbox: str | None) -> None:
    """Load, wire and validate SCENARIO without running it; print components, processes, stages, connections and conversions.

    What is probably a mistake is a warning: a forgotten connection, a missing reference, an event after the end.
    --isolation and --sandbox are those of `cosim run`; here they only say what would run where.
    """
    from ...api import load
    from ...scenario.nested_systems import parse_settings
    from ...scenario.warnings import doubts

    apart: Literal["fmu", "none"] = "fmu" if isolation == "fmu" else "none"
    assembly = load(scenario, parse_settings(settings), isolation=apart, sandbox=bool(sandbox))
    try:
        if problems := assembly.figure_problems():
            raise InputError(problems)
        _components(assembly)
        _processes(assembly, isolation, sandbox)
        _stages(assembly)
        if connections:
            _connections(assembly)
            _unfed(assembly)
        found = doubts(assembly)
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


def _components(assembly: Assembly) -> None:
    click.echo("components")
    width = max(map(len, assembly.system.components))
    for name, component in assembly.system.components.items():
        counts = {kind: sum(len(v.slots) for v in component.variables if v.causality == kind) for kind in ("input", "output")}
        period = assembly.system.periods.get(name)
        every = f", every {float(period):g} s" if period else ""
        click.echo(f"  {name:{width}}  {assembly.origin(name)}, {counts['input']} inputs, {counts['output']} outputs{every}")


def _processes(assembly: Assembly, isolation: str, sandbox: str | None) -> None:
    from ...components.fmi.isolated.remote import RemoteFmu

    components = assembly.system.components
    apart = {name: component.isolation for name, component in components.items() if isinstance(component, RemoteFmu)}
    together = [name for name in components if name not in apart]
    click.echo("\nprocesses" + (", all of them in bubblewrap" if sandbox == "strict" else ""))
    if together:
        click.echo(f"  {'that of the command' if isolation == 'none' else 'the supervised run'}: {', '.join(together)}")
    for name, how in apart.items():
        click.echo(f"  {name}: one of its own{', in a sandbox' if how.sandbox else ''}")


def _stages(assembly: Assembly) -> None:
    click.echo("\nstages, in order (components of one line step side by side)")
    _list_stages(assembly.system.stages, "  ")


def _list_stages(stages: tuple[Stage, ...] | object, indent: str) -> None:
    for i, stage in enumerate(stages, 1):  # type: ignore[var-annotated,arg-type]
        names = ", ".join(member.name if isinstance(member, Group) else member for member in stage)
        click.echo(f"{indent}{i}. {names}")
        for member in stage:
            if isinstance(member, Group):
                _list_stages(member.stages, indent + "   ")


def _connections(assembly: Assembly) -> None:
    from ...engine.transfer_plan import conversion

    system = assembly.system
    click.echo(f"\nconnections ({len(system.connections)})")
    for connection in system.connections:
        source, target = system.place(connection.source).variable, system.place(connection.target).variable
        notes = [f"delay {connection.delay}"] if connection.delay else []
        if conversion(source, target) != (1.0, 0.0) and source.unit and target.unit:
            notes.append(f"{source.unit.name} to {target.unit.name}")
        if source.type != target.type:
            notes.append(f"{source.type} to {target.type}")
        click.echo(f"  {connection.source} -> {connection.target}" + (f"  ({', '.join(notes)})" if notes else ""))


def _unfed(assembly: Assembly) -> None:
    """Inputs that keep their own start values."""
    from ...scenario.warnings import unfed

    free: dict[str, list[str]] = {}
    for end in unfed(assembly):
        free.setdefault(end.component, []).append(end.slot)
    for name, slots in free.items():
        click.echo(f"\ninputs of {name} that nothing feeds or sets\n  {', '.join(slots)}")
