"""`cosim schema`: JSON Schema of scenarios, sweeps, tunings and vehicle files."""

from __future__ import annotations

import json
from typing import Any

import click


@click.command()
@click.option("--nested", "kind", flag_value="nested", help="Print the schema of nested systems.")
@click.option("--sweep", "kind", flag_value="sweep", help="Print the schema of sweeps.")
@click.option("--tune", "kind", flag_value="tune", help="Print the schema of tunings.")
@click.option(
    "--worst", "kind", flag_value="worst", help="Print the schema of searches for the worst case."
)
@click.option("--vehicle", "kind", flag_value="vehicle", help="Print the schema of vehicle files.")
def command(kind: str | None) -> None:
    """Print the JSON Schema of scenarios, sweeps, tunings or vehicle files.

    An editor completes and checks a file that names its schema: "$schema": "scenario.schema.json".
    """
    click.echo(json.dumps(_schema(kind), indent=2))


def _schema(kind: str | None) -> dict[str, Any]:
    if kind in ("sweep", "tune", "worst"):
        from ...studies.schema import SweepSpec, TuneSpec, WorstCaseSpec, study_json_schema

        if kind == "worst":
            return study_json_schema(WorstCaseSpec)
        return study_json_schema(SweepSpec if kind == "sweep" else TuneSpec)
    if kind == "vehicle":
        from ...export.plant import vehicle_file_schema

        return vehicle_file_schema()
    from ...export.plant import WORLD, world_schema
    from ...scenario.extension_schema import editor_schema, with_arguments

    return with_arguments(editor_schema(kind == "nested"), WORLD, world_schema())
