"""`cosim new scenario`: a scenario that extends another one."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import click

from ...core.errors import InputError, Problem


@click.command()
@click.argument("name")
@click.option(
    "--from",
    "base",
    required=True,
    metavar="SCENARIO",
    help="Scenario file, or name of a shipped scenario.",
)
@click.option(
    "--directory",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Folder of the file; default: the working directory.",
)
@click.option("--force", is_flag=True, help="Overwrite an existing file.")
def command(name: str, base: str, directory: Path, force: bool) -> None:
    """Create NAME.json, a scenario that extends SCENARIO.

    It runs at once; add the keys that differ.

    A shipped scenario is extended by its name, so that the new file runs wherever cosim is
    installed.
    """
    from ...results.files import write_file
    from ...scenario.file_paths import find_scenario
    from ...scenario.nested_systems import extending_scenario, load_scenario
    from ...scenario.schema import SCENARIO_NAME

    if not re.match(SCENARIO_NAME, name):
        raise InputError(
            f'"{name}" is not a name of a scenario: expected letters, digits, "_", ".", "-" and '
            "spaces"
        )
    file, found = directory / f"{name}.json", find_scenario(base)
    if file.exists() and not force:
        raise InputError([Problem("exists; --force overwrites it", str(file))])
    if problems := load_scenario(found).problems:
        raise InputError(problems)
    content = extending_scenario(base, directory, name, f"{found.stem} with changes")
    write_file(file, json.dumps(content, indent=1) + "\n")
    path = shlex.quote(str(file))
    click.echo(
        f"{file}\n\nPrint all keys that it can change:\n  cosim check {path} --expanded\nRun it:\n "
        f" cosim run {path}"
    )
