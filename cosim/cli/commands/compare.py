"""`cosim compare`: does a result stay in the tubes around its reference?"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from ...results import Result
    from ...results.comparison import Comparison, Tolerance


@click.command()
@click.argument("result", type=click.Path(path_type=Path))
@click.argument("reference", type=click.Path(path_type=Path))
@click.option("--absolute", default=0.0, help="Tolerance in the unit of each signal.")
@click.option("--relative", default=0.0, help="Tolerance relative to the range of each signal of the reference.")
@click.option("--time", default=0.0, help="Tolerance in time, in s.")
@click.option("--signals", multiple=True, metavar="PATTERN", help='Only these signals of the reference; "*" matches anything.')
@click.option(
    "--plot", type=click.Path(path_type=Path), metavar="FILE", help="Draw the worst signals in their tubes (PNG or SVG)."
)
def command(
    result: Path, reference: Path, absolute: float, relative: float, time: float, signals: tuple[str, ...], plot: Path | None
) -> int:
    """Compare RESULT with REFERENCE, each of them a CSV file or a folder that `cosim run` wrote.

    Every signal of the reference has to stay within the larger of the absolute and the relative tolerance in value, and
    within the one in time; without any it has to be equal. REFERENCE may also be a scenario, a file or the name of a shipped
    one: then its reference and its tolerances count. Ends with 3 when a signal leaves its tube, is missing, ends early, or is
    not finite.
    """
    from ...results.comparison import Tolerance, compare

    if plot and plot.suffix not in (".png", ".svg"):
        raise click.BadParameter(f'"{plot}" is neither .png nor .svg', param_hint="--plot")
    if _is_scenario(reference):
        file, tolerances = _scenario_reference(reference)
    else:
        file, tolerances = reference, dict.fromkeys(signals or ("*",), Tolerance(absolute, relative, time))
    found, expected = _read_result(result), _read_result(file)
    comparison = compare(found, expected, tolerances)
    if plot:
        _draw_tubes(found, expected, tolerances, comparison, plot)
    click.echo(str(comparison), err=not comparison.passed)
    return 0 if comparison.passed else 3


def _read_result(path: Path) -> Result:
    from ...results import Result

    return Result.from_csv(path / "result.csv" if path.is_dir() else path)


def _is_scenario(path: Path) -> bool:
    """A JSON file, or a name alone that nothing here has: that of a shipped scenario."""
    return path.suffix == ".json" or (path.name == str(path) and not path.suffix and not path.exists())


def _scenario_reference(scenario: Path) -> tuple[Path, Mapping[str, Tolerance]]:
    """Where the reference of a scenario lies, and its tolerances."""
    from ...core.errors import InputError
    from ...results.comparison import Tolerance
    from ...scenario.nested_systems import find_scenario, load_scenario

    path = find_scenario(scenario)
    spec = load_scenario(path).spec.reference
    if spec is None:
        raise InputError(f'{path} names no "reference"')
    return path.parent / spec.file, {name: Tolerance(**vars(part)) for name, part in spec.tolerances.items()}


def _draw_tubes(
    result: Result, reference: Result, tolerances: Mapping[str, Tolerance], comparison: Comparison, path: Path
) -> None:
    from ...report.comparison_figure import draw_tubes
    from ...report.figures import draw_figure, save_figure

    arguments = {"reference": reference, "tolerances": tolerances, "comparison": comparison}
    save_figure(draw_figure(result, "tubes", draw_tubes, arguments), path)
