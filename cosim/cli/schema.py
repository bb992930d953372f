"""`cosim schema`."""

from __future__ import annotations

import json

import click


@click.command()
@click.option("--nested", is_flag=True, help="The schema of nested systems instead.")
def command(nested: bool) -> None:
    """Print the JSON Schema of scenario files.

    Editors complete and check a scenario that names it: "$schema": "scenario.schema.json".
    """
    from ..scenario import json_schema

    click.echo(json.dumps(json_schema(nested), indent=2))
