"""`cosim schema`."""

from __future__ import annotations

import json

import click


@click.command()
def command() -> None:
    """Print the JSON Schema of scenario files.

    Editors complete and check a scenario that names it: "$schema": "scenario.schema.json".
    """
    from ..scenario import json_schema

    click.echo(json.dumps(json_schema(), indent=2))
