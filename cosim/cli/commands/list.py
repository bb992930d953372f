"""`cosim list`: what cosim ships."""

from __future__ import annotations

from dataclasses import asdict

import click

from .. import current_command_line
from ..messages import print_json
from ..output_options import json_option
from ..shipped import CATALOGUE


@click.command()
@click.argument("kinds", metavar="[KIND...]", nargs=-1, type=click.Choice(list(CATALOGUE)))
@json_option("an object with a list of entries (name, description, file, arguments) for each KIND")
def command(kinds: tuple[str, ...], as_json: bool) -> None:
    """List what cosim ships, with one line each; KIND: scenarios, sweeps, models, controllers, roles, kpis.

    Scenarios, sweeps, tunings and roles are given to commands by name: `cosim run NAME`, `cosim sweep NAME`, `cosim tune NAME`,
    `cosim bench-controller --role NAME`. Models are the vehicles of the plant. Controllers are FMUs, which
    `cosim info NAME` describes. KPIs are functions for the key "kpis" of scenarios; -v also prints their arguments. The JSON
    output also contains the file of each entry.
    """
    entries = {kind: list(CATALOGUE[kind]()) for kind in kinds or CATALOGUE}
    if as_json:
        print_json({kind: [asdict(entry) for entry in found] for kind, found in entries.items()})
        return
    for i, (kind, found) in enumerate(entries.items()):
        if len(entries) > 1:
            click.echo(f"{chr(10) if i else ''}{kind}")
        width = max(len(entry.name) for entry in found)
        for entry in found:
            click.echo(f"  {entry.name:{width}}  {entry.description}")
            if entry.arguments and current_command_line().verbosity > 0:
                click.echo(f"  {'':{width}}    arguments: {entry.arguments}")
