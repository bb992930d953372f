"""`cosim schema`."""

from __future__ import annotations

import json
from typing import Any

import click


@click.command()
@click.option("--nested", "kind", flag_value="nested", help="The schema of nested systems instead.")
@click.option("--sweep", "kind", flag_value="sweep", help="The schema of sweeps instead.")
@click.option("--tune", "kind", flag_value="tune", help="The schema of tunings instead.")
def command(kind: str | None) -> None:
    """Print the JSON Schema of scenario files.

    Editors complete and check a scenario that names it: "$schema": "scenario.schema.json".
    """
    click.echo(json.dumps(_schema(kind), indent=2))


def _schema(kind: str | None) -> dict[str, Any]:
    if kind in ("sweep", "tune"):
        from ...studies.schema import SweepSpec, TuneSpec, study_json_schema

        return study_json_schema(SweepSpec if kind == "sweep" else TuneSpec)
    from ... import scenario

    return scenario.json_schema(kind == "nested")
