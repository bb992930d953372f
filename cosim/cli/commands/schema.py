"""`cosim schema`: JSON Schema of scenarios, sweeps and tunings."""

from __future__ import annotations

import json
from typing import Any

import click


@click.command()
@click.option("--nested", "kind", flag_value="nested", help="Print the schema of nested systems.")
@click.option("--sweep", "kind", flag_value="sweep", help="Print the schema of sweeps.")
@click.option("--tune", "kind", flag_value="tune", help="Print the schema of tunings.")
def command(kind: str | None) -> None:
    """Print the JSON Schema of scenarios, sweeps or tunings.

    An editor completes and checks a file that names its schema: "$schema": "scenario.schema.json".
    """
    click.echo(json.dumps(_schema(kind), indent=2))


def _schema(kind: str | None) -> dict[str, Any]:
    if kind in ("sweep", "tune"):
        from ...studies.schema import SweepSpec, TuneSpec, study_json_schema

        return study_json_schema(SweepSpec if kind == "sweep" else TuneSpec)
    from ...scenario.extension_schema import editor_schema

    return editor_schema(kind == "nested")
