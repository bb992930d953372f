"""`cosim list`: what cosim ships."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import click

from .. import current_command_line
from ..messages import print_json
from ..output_options import json_option
from ..scenario_groups import group_scenarios
from ..shipped import CATALOGUE, Entry


@click.command()
@click.argument("kinds", metavar="[KIND...]", nargs=-1, type=click.Choice(list(CATALOGUE)))
@json_option("an object with a list of entries (name, description, file, arguments) for each KIND")
def command(kinds: tuple[str, ...], as_json: bool) -> None:
    """List what cosim ships, with one line each, scenarios in groups.

    KIND: scenarios, sweeps, models, controllers, roles, kpis.

    Scenarios, sweeps, tunings and roles are given to commands by name: `cosim run NAME`, `cosim
    sweep NAME`, `cosim tune NAME`, `cosim bench-controller --role NAME`. Models are the vehicles of
    the plant. Controllers are FMUs, which `cosim info NAME` describes. KPIs are functions for the
    key "kpis" of scenarios; -v also prints their arguments. The JSON output also contains the file
    of each entry.
    """
    entries = {kind: list(CATALOGUE[kind]()) for kind in kinds or CATALOGUE}
    if as_json:
        print_json({kind: [asdict(entry) for entry in found] for kind, found in entries.items()})
        return
    for i, (kind, found) in enumerate(entries.items()):
        if len(entries) > 1:
            click.echo(f"{chr(10) if i else ''}{kind}")
        groups = group_scenarios(found) if kind == "scenarios" else {"": found}
        _print_groups(groups, width=max(len(entry.name) for entry in found))


def _print_groups(groups: Mapping[str, Sequence[Entry]], width: int) -> None:
    """Print the entries of each group below its heading ("": none), with names in a column of `width`."""
    for heading, entries in groups.items():
        if heading:
            click.echo(f"{heading}:")
        for entry in entries:
            click.echo(f"  {entry.name:{width}}  {entry.description}")
            if entry.arguments and current_command_line().verbosity > 0:
                click.echo(f"  {'':{width}}    arguments: {entry.arguments}")
