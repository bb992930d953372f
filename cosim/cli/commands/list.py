"""`cosim list` and `cosim schema`: what cosim ships, and the JSON Schemas of its files."""

import json
from dataclasses import asdict
from typing import Any

import click

from .. import current_command_line
from ..messages import print_json
from ..options import json_option
from ..shipped import CATALOGUE, group_scenarios


@click.command()
@click.argument("kinds", metavar="[KIND...]", nargs=-1, type=click.Choice(list(CATALOGUE)))
@json_option("an object with a list of entries (name, description, file, arguments) for each KIND")
def list_shipped(kinds: tuple[str, ...], as_json: bool) -> None:
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
        print_json({kind: list(map(asdict, found)) for kind, found in entries.items()})
        return
    for i, (kind, found) in enumerate(entries.items()):
        if len(entries) > 1:
            click.echo(f"{chr(10) if i else ''}{kind}")
        groups = group_scenarios(found) if kind == "scenarios" else {"": found}
        width = max(len(entry.name) for entry in found)
        for heading, group in groups.items():
            if heading:
                click.echo(f"{heading}:")
            for entry in group:
                click.echo(f"  {entry.name:{width}}  {entry.description}")
                if entry.arguments and current_command_line().verbosity > 0:
                    click.echo(f"  {'':{width}}    arguments: {entry.arguments}")


@click.command()
@click.option("--nested", "kind", flag_value="nested", help="Print the schema of nested systems.")
@click.option("--sweep", "kind", flag_value="sweep", help="Print the schema of sweeps.")
@click.option("--tune", "kind", flag_value="tune", help="Print the schema of tunings.")
@click.option(
    "--worst", "kind", flag_value="worst", help="Print the schema of searches for the worst case."
)
@click.option("--vehicle", "kind", flag_value="vehicle", help="Print the schema of vehicle files.")
def schema(kind: str | None) -> None:
    """Print the JSON Schema of scenarios, sweeps, tunings or vehicle files.

    An editor completes and checks a file that names its schema: "$schema": "scenario.schema.json".
    """
    click.echo(json.dumps(_schema(kind), indent=2))


def _schema(kind: str | None) -> dict[str, Any]:
    if kind in ("sweep", "tune", "worst"):
        from ...scenario.schema_types import schema_of
        from ...studies.schema import StudySpec, SweepSpec, TuneSpec, WorstCaseSpec

        kinds: dict[str, type[StudySpec]]
        kinds = {"sweep": SweepSpec, "tune": TuneSpec, "worst": WorstCaseSpec}
        return schema_of(kinds[kind])
    if kind == "vehicle":
        from ...export.plant import vehicle_file_schema

        return vehicle_file_schema()
    from ...export.plant import WORLD, world_schema
    from ...scenario.extension_schema import editor_schema, with_arguments

    return with_arguments(editor_schema(kind == "nested"), WORLD, world_schema())
