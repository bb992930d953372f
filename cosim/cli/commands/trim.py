"""`cosim trim`: values with which a scenario starts in equilibrium."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import InputError
from ...core.text import count_noun
from ...report.tables import print_table
from ..analysis_options import scenario_options, split_names
from ..messages import print_json, print_log
from ..output_options import json_option

if TYPE_CHECKING:
    from ...analysis.trimming import Trim


@click.command()
@scenario_options
@click.option(
    "--free",
    multiple=True,
    required=True,
    metavar="NAME,...",
    help="Input, parameter, initial state or JSON pointer to be found.",
)
@click.option(
    "--steady",
    multiple=True,
    metavar="NAME,...",
    help="Signal that does not change during the first macro step.",
)
@click.option(
    "--require", multiple=True, metavar="NAME=value", help="Value of a signal at the start time."
)
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    help="Scenario file to write; it extends SCENARIO by the found values.",
)
@json_option("an object with found, parameters, residuals and evaluations")
def command(
    scenario: str,
    settings: tuple[str, ...],
    free: tuple[str, ...],
    steady: tuple[str, ...],
    require: tuple[str, ...],
    output: Path | None,
    as_json: bool,
) -> int:
    """Find values with which SCENARIO starts in equilibrium.

    SCENARIO is a JSON file or the name of a shipped scenario. It is started again and again with
    changed values of the --free names, and makes one macro step, until the --steady signals do not
    change and the --require signals have their values. Exit code 0: an equilibrium was found; 2:
    the scenario was refused; 3: the best values are no equilibrium.
    """
    from ...analysis.trimming import trim
    from ...scenario.settings import parse_settings

    print_log()
    given = parse_settings(settings)
    found = trim(
        scenario, split_names(free), split_names(steady), _numbers(require), parameters=given
    )
    if output:
        _write_scenario(output, scenario, {**given, **found.parameters})
    if as_json:
        about = {
            "found": found.is_found,
            "parameters": found.parameters,
            "residuals": found.residuals,
        }
        print_json({**about, "evaluations": found.evaluations})
    else:
        _print_trim(found, output)
    return 0 if found.is_found else 3


def _numbers(texts: tuple[str, ...]) -> dict[str, float]:
    from ...scenario.settings import parse_settings

    values = parse_settings(texts)
    if wrong := [
        name
        for name, value in values.items()
        if isinstance(value, bool) or not isinstance(value, int | float)
    ]:
        raise InputError(f"--require {wrong[0]}={values[wrong[0]]}: expected a number")
    return values


def _write_scenario(file: Path, scenario: str, settings: dict[str, Any]) -> None:
    from ...results.files import write_json
    from ...scenario.file_paths import find_scenario
    from ...scenario.nested_systems import extending_scenario

    description = f"{find_scenario(scenario).stem}, started at its operating point"
    file.parent.mkdir(parents=True, exist_ok=True)
    write_json(extending_scenario(scenario, file.parent, file.stem, description, settings), file)


def _print_trim(found: Trim, output: Path | None) -> None:
    values = {
        f"{name}[{i}]" if isinstance(value, list) else name: each
        for name, value in found.parameters.items()
        for i, each in enumerate(value if isinstance(value, list) else [value], 1)
    }
    print_table(["free", "value"], [[name, f"{value:.9g}"] for name, value in values.items()])
    click.echo()
    print_table(
        ["signal", "residual"], [[name, f"{value:.2g}"] for name, value in found.residuals.items()]
    )
    if not found.is_found:
        click.echo(
            (
                f"no equilibrium: the residual of {found.largest} is "
                f"{found.residuals[found.largest]:.3g}"
            ),
            err=True,
        )
    for name in found.without_effect:
        click.echo(f"NOTE {name} changes no residual", err=True)
    click.echo(
        f"\n{count_noun(found.evaluations, 'evaluation')}"
        + (f"; values in {output}" if output else "")
    )
