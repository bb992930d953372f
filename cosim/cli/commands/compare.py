"""`cosim compare`: comparison of a result with the tubes around its reference."""

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
@click.option("--absolute", default=0.0, help="Tolerance of values, in the unit of each signal.")
@click.option("--relative", default=0.0, help="Tolerance of values, relative to the range of each signal in the reference.")
@click.option("--time", default=0.0, help="Tolerance of time (s).")
@click.option(
    "--signals", multiple=True, metavar="PATTERN", help='Compare only these signals of the reference; "*" matches any text.'
)
@click.option(
    "--plot", type=click.Path(path_type=Path), metavar="FILE", help="Draw the worst signals in their tubes (PNG or SVG)."
)
def command(
    result: Path, reference: Path, absolute: float, relative: float, time: float, signals: tuple[str, ...], plot: Path | None
) -> int:
    """Compare RESULT with REFERENCE, signal by signal.

    Each is a CSV file or a folder written by `cosim run`. Every signal of the reference must stay within the larger of the
    absolute and the relative tolerance, and within the tolerance of time; without tolerances it must be equal. If REFERENCE is
    a scenario file or the name of a shipped scenario, its reference and its tolerances are used. Exit code 0: all signals
    agree; 3: a signal leaves its tube, is missing, ends early, or is not finite.
    """
    from ...results.comparison import Tolerance, compare

    if plot and plot.suffix not in (".png", ".svg"):
        raise click.BadParameter(f'"{plot}" has neither the suffix .png nor .svg', param_hint="--plot")
    if _is_scenario(reference):
        file, tolerances = _scenario_reference(reference)
    else:
        file, tolerances = reference, dict.fromkeys(signals or ("*",), Tolerance(absolute, relative, time))
    actual, expected = _read_result(result), _read_result(file)
    comparison = compare(actual, expected, tolerances)
    if plot:
        _draw_tubes(actual, expected, tolerances, comparison, plot)
    click.echo(str(comparison), err=not comparison.passed)
    return 0 if comparison.passed else 3


def _read_result(path: Path) -> Result:
    from ...results import Result

    return Result.from_csv(path / "result.csv" if path.is_dir() else path)


def _is_scenario(path: Path) -> bool:
    """Return whether a path is a JSON file, or a name without a folder that is no existing file (a shipped scenario)."""
    return path.suffix == ".json" or (path.name == str(path) and not path.suffix and not path.exists())


def _scenario_reference(scenario: Path) -> tuple[Path, Mapping[str, Tolerance]]:
    """Return the path of a scenario's reference, and its tolerances."""
    from ...core.errors import InputError
    from ...results.comparison import Tolerance
    from ...scenario import find_scenario, load_scenario

    path = find_scenario(scenario)
    spec = load_scenario(path).spec.reference
    if spec is None:
        raise InputError(f'{path} has no "reference"')
    return path.parent / spec.file, {name: Tolerance(**vars(part)) for name, part in spec.tolerances.items()}


def _draw_tubes(
    result: Result, reference: Result, tolerances: Mapping[str, Tolerance], comparison: Comparison, path: Path
) -> None:
    from ...report.comparison_figure import draw_tubes
    from ...report.figures import draw_figure, save_figure

    arguments = {"reference": reference, "tolerances": tolerances, "comparison": comparison}
    save_figure(draw_figure(result, "tubes", draw_tubes, arguments), path)
