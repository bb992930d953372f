"""`cosim check`: check of a scenario without running it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import click

from ...core.errors import InputError, Problem
from ...core.system import Group, Stage
from ...core.text import count_noun
from .. import strict_sandbox, supervision
from ..messages import collect_log, print_json
from ..options import flag_option, json_option, scenario_argument, settings_option

if TYPE_CHECKING:
    from ...core.component import Variable
    from ...scenario import PreparedRun


@click.command(cls=strict_sandbox.SandboxCommand)
@scenario_argument
@settings_option
@click.option("--connections/--no-connections", default=True, help="List every connection.")
@flag_option(
    "--expanded",
    help="Print the scenario as JSON instead, with what it extends and --set applied.",
)
@json_option(
    "an object with name, start_time, stop_time and step_size (s), steps, signals, components, "
    "stages, connections (source, "
    "target, unit, notes), unconnected_inputs, recommendations and warnings; with --expanded the "
    "scenario"
)
@supervision.supervision_options
def command(
    scenario: str,
    settings: tuple[str, ...],
    connections: bool,
    expanded: bool,
    as_json: bool,
    isolation: str,
    sandbox: str | None,
) -> None:
    """Check SCENARIO without running it and print the expanded system.

    SCENARIO is a JSON file or the name of a shipped scenario. Prints components, processes, stages,
    connections and unit conversions, and recommends an order of the components. Probable mistakes
    are warnings: a forgotten connection, a missing reference, an event after the end. --isolation
    and --sandbox only affect the printed processes. The JSON of --expanded has absolute paths: a
    file with it is a scenario that runs anywhere on this machine.
    """
    from ...scenario import load
    from ...scenario.nested_systems import load_scenario
    from ...scenario.settings import parse_settings
    from ...scenario.stages import recommend

    fmu_isolation: Literal["fmu", "none"] = "fmu" if isolation == "fmu" else "none"
    logged = collect_log()
    prepared = load(
        scenario, parse_settings(settings), isolation=fmu_isolation, sandbox=bool(sandbox)
    )
    try:
        if problems := prepared.figure_problems():
            raise InputError(problems)
        if expanded:
            print_json(load_scenario(scenario, parse_settings(settings)).expanded())
            return
        if as_json:
            print_json(_describe(prepared, _warnings(prepared, logged)))
            return
        _print_components(prepared)
        _print_processes(prepared, isolation, sandbox)
        _print_stages(prepared)
        if connections:
            _print_connections(prepared)
            _print_unconnected_inputs(prepared)
        click.echo("\nrecommendation for the order")
        for line in recommend(prepared.system):
            click.echo(f"  {line}")
        _print_verdict(prepared, _warnings(prepared, logged))
    finally:
        prepared.free()


def _warnings(prepared: PreparedRun, logged: Sequence[str]) -> list[Problem]:
    """Return the warnings about a scenario and those that its components have logged."""
    from ...scenario.plausibility import find_warnings

    return [*find_warnings(prepared), *(Problem(text.removeprefix("WARNING ")) for text in logged)]


def _describe(prepared: PreparedRun, warnings: Sequence[Problem]) -> dict[str, Any]:
    """Return the expanded system as JSON."""
    from ...scenario.plausibility import unconnected_inputs
    from ...scenario.stages import recommend

    times = prepared.plan.settings
    unconnected: dict[str, list[str]] = {}
    for end in unconnected_inputs(prepared):
        unconnected.setdefault(end.component, []).append(end.scalar)
    return {
        "name": prepared.spec.name,
        **{name: float(getattr(times, name)) for name in ("start_time", "stop_time", "step_size")},
        "steps": prepared.plan.grid.count,
        "signals": list(times.columns),
        **prepared.metadata["system"],
        "unconnected_inputs": unconnected,
        "recommendations": recommend(prepared.system),
        "warnings": list(map(str, warnings)),
    }


def _print_verdict(prepared: PreparedRun, warnings: Sequence[Problem]) -> None:
    """Print the warnings, and the times of the scenario in one line."""
    for problem in warnings:
        click.echo(f"WARNING {problem}", err=True)
    verdict = f"{count_noun(len(warnings), 'warning')}." if warnings else "No warnings."
    times, grid = prepared.plan.settings, prepared.plan.grid
    rest = grid.end - grid.start - grid.whole_steps * grid.step
    last = f", the last one of {float(rest):.6g} s" if rest else ""
    click.echo(
        f"\n{prepared.spec.name}: {float(grid.start):g} s ... {float(grid.end):g} s in "
        f"{count_noun(grid.count, 'step')} of "
        f"{float(times.step_size):g} s{last}, {count_noun(len(times.columns), 'signal')} "
        f"recorded. {verdict}"
    )


def _print_components(prepared: PreparedRun) -> None:
    click.echo("components")
    width, sources = max(map(len, prepared.system.components)), prepared.sources
    for name, component in prepared.system.components.items():
        counts = {"input": 0, "output": 0}
        for variable in component.variables:
            if variable.causality in counts:
                counts[variable.causality] += len(variable.scalar_names)
        period = prepared.system.periods.get(name)
        every = f", every {float(period):g} s" if period else ""
        sizes = ", ".join(count_noun(count, kind) for kind, count in counts.items())
        click.echo(f"  {name:{width}}  {sources[name]}, {sizes}{every}")


def _print_processes(prepared: PreparedRun, isolation: str, sandbox: str | None) -> None:
    from ...components.fmi.isolated import IsolatedFmu

    components = prepared.system.components
    isolated = {
        name: component.isolation
        for name, component in components.items()
        if isinstance(component, IsolatedFmu)
    }
    shared = [name for name in components if name not in isolated]
    click.echo("\nprocesses" + (", all in bubblewrap" if sandbox == "strict" else ""))
    if shared:
        process = "process of the command" if isolation == "none" else "supervised process"
        click.echo(f"  {process}: {', '.join(shared)}")
    for name, settings in isolated.items():
        click.echo(f"  {name}: its own process{', in a sandbox' if settings.sandbox else ''}")


def _print_stages(prepared: PreparedRun) -> None:
    given = prepared.spec.algorithm is not None and prepared.spec.algorithm.stages is not None
    reason = (
        'the "stages" of the scenario'
        if given
        else "the default: a component steps after those that feed it"
    )
    click.echo(f"\norder within a step: {reason}; components of one line may step in parallel")
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
        note = f"  ({notes})" if notes else ""
        click.echo(f"  {connection.source} -> {connection.target}{note}")


def _print_unconnected_inputs(prepared: PreparedRun) -> None:
    """Print the inputs that nothing feeds or sets, with the start values that they keep."""
    from ...scenario.plausibility import unconnected_inputs

    inputs: dict[str, dict[str, list[str]]] = {}
    for end, variable in unconnected_inputs(prepared).items():
        inputs.setdefault(end.component, {}).setdefault(_start_text(variable), []).append(
            end.scalar
        )
    for name, slots_of in inputs.items():
        click.echo(f"\ninputs of {name} that nothing feeds; they keep their start values")
        for value, slots in slots_of.items():
            click.echo(f"  {value}: {', '.join(slots)}")


def _start_text(variable: Variable) -> str:
    """Return the start value of a scalar input as text."""
    start = variable.start
    if isinstance(start, bool):
        return str(start).lower()
    if start is None:
        return "value of the component"
    return f"{start:g}" if isinstance(start, int | float) else str(start)
