"""`cosim linearize`: state-space model of a scenario or of some of its components."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...core.text import count_noun
from ...report.tables import print_table
from ..analysis_options import (
    print_notes,
    scenario_options,
    split_names,
    time_options,
    write_figures,
)
from ..messages import print_json, print_log
from ..output_options import json_option

if TYPE_CHECKING:
    from ...analysis.linear_model import LinearModel


@click.command()
@scenario_options
@click.option(
    "--inputs",
    multiple=True,
    required=True,
    metavar="NAME,...",
    help="Input, tunable parameter or connected output.",
)
@click.option(
    "--outputs",
    multiple=True,
    required=True,
    metavar="NAME,...",
    help="Output, vector or pattern of outputs.",
)
@time_options
@click.option(
    "--component",
    "components",
    multiple=True,
    metavar="NAME",
    help="Component that steps; the others hold their outputs.",
)
@click.option("--continuous", is_flag=True, help="Convert the model to continuous time.")
@click.option(
    "--order",
    type=click.IntRange(min=0),
    help="Largest number of states; default: as many as the responses show.",
)
@click.option(
    "--output",
    "files",
    multiple=True,
    type=click.Path(path_type=Path),
    help="File for the model: .json, .csv or .mat.",
)
@click.option(
    "--figures",
    type=click.Path(path_type=Path),
    help="Folder for a Bode diagram, the poles and step responses.",
)
@json_option(
    "an object with time, step (s; null: continuous), inputs, outputs, states, notes, A, B, C, D "
    "and poles"
)
def command(
    scenario: str,
    settings: tuple[str, ...],
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    at: str | None,
    duration: float | None,
    components: tuple[str, ...],
    continuous: bool,
    order: int | None,
    files: tuple[Path, ...],
    figures: Path | None,
    as_json: bool,
) -> None:
    """Linearise SCENARIO, or some of its components, at a point in time.

    SCENARIO is a JSON file or the name of a shipped scenario. The model is discrete with the common
    step of all components, or continuous. If the outputs are enough, its states are outputs in the
    given order. A component that cannot return to a saved state (FMI: canGetAndSetFMUState) is
    refused.
    """
    from ...analysis.linear_model import check_suffix
    from ...analysis.linearization import linearize
    from ...scenario.settings import parse_settings

    print_log()
    for file in files:
        check_suffix(file)
    model = linearize(
        scenario,
        split_names(inputs),
        split_names(outputs),
        at,
        parameters=parse_settings(settings),
        components=split_names(components),
        continuous=continuous,
        duration=duration,
        order=order,
    )
    for file in files:
        model.write(file)
    if as_json:
        print_json(model.to_dict())
    else:
        _print_model(model)
        for file in files:
            click.echo(file)
    print_notes(model.notes)
    if figures:
        _draw(model, figures, duration)


def _print_model(model: LinearModel) -> None:
    kind = "continuous" if model.step is None else f"step {model.step:g} s"
    sizes = [
        count_noun(len(names), noun)
        for names, noun in (
            (model.states, "state"),
            (model.inputs, "input"),
            (model.outputs, "output"),
        )
    ]
    click.echo(f"t = {model.time:g} s, {kind}: {', '.join(sizes)}\n")
    rows = []
    for pole in model.poles():
        rate = pole if model.step is None else _rate(pole, model.step)
        magnitude = abs(rate)
        damping = f"{-rate.real / magnitude:.3f}" if magnitude > 1e-9 else ""
        rows.append([f"{pole.real:.6f} {pole.imag:+.6f}i", f"{magnitude:.4g}", damping])
    print_table(["pole", "natural frequency (rad/s)", "damping"], rows)


def _rate(pole: complex, step: float) -> complex:
    """Return the continuous pole (1/s) of a discrete one."""
    import numpy as np

    return complex(np.log(complex(pole)) / step) if pole else complex(-np.inf)


def _draw(model: LinearModel, folder: Path, duration: float | None) -> None:
    from ...analysis import figures

    span = duration or 256 * (model.step or 0.01)
    draw = {
        "bode": lambda: figures.draw_bode(model),
        "poles": lambda: figures.draw_poles(model),
        "steps": lambda: figures.draw_steps(model, span),
    }
    write_figures(draw.items(), folder)
