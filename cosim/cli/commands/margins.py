"""`cosim margins`: stability margins at the inputs and outputs of a controller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import InputError
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
    from ...analysis.loop_margins import LoopMargins
    from ...analysis.loop_response import LoopResponse


@click.command()
@scenario_options
@click.option(
    "--component",
    "components",
    multiple=True,
    required=True,
    metavar="NAME",
    help="Controller; repeat for several.",
)
@click.option(
    "--loop",
    "loops",
    multiple=True,
    metavar="NAME,...",
    help="Signal to break the loop at; default: all.",
)
@time_options
@click.option(
    "--estimate",
    type=click.Choice(["sines", "chirp"]),
    help="Also estimate the response of one --loop, with --amplitude.",
)
@click.option(
    "--amplitude", type=float, help="Largest value that --estimate adds, in the unit of the signal."
)
@click.option(
    "--figures", type=click.Path(path_type=Path), help="Folder for a Bode and a Nyquist diagram."
)
@json_option(
    "an object with time, step, and loops: objects with the margins; phases in rad, gains as "
    "factors"
)
def command(
    scenario: str,
    settings: tuple[str, ...],
    components: tuple[str, ...],
    loops: tuple[str, ...],
    at: str | None,
    duration: float | None,
    estimate: str | None,
    amplitude: float | None,
    figures: Path | None,
    as_json: bool,
) -> int:
    """Print gain, phase, delay and disk margin at every connected input and output of a controller in SCENARIO.

    SCENARIO is a JSON file or the name of a shipped scenario. Each loop is broken at one signal while all other loops remain
    closed. --estimate compares the linear model of one loop with the response of the nonlinear system. Exit code 0: all loops are
    stable; 3: a loop is unstable ("NO"), or its linear model is not valid ("?").
    """
    from ...analysis.loop_margins import loop_margins
    from ...analysis.loop_response import measure_loops
    from ...scenario.settings import parse_settings

    print_log()
    parameters, names, chosen = (
        parse_settings(settings),
        split_names(components),
        split_names(loops),
    )
    measured = measure_loops(
        scenario, names, at, loops=chosen, parameters=parameters, duration=duration
    )
    found = [loop_margins(each) for each in measured]
    if as_json:
        times = (
            {"time": measured[0].closed.time, "step": measured[0].closed.step} if measured else {}
        )
        print_json({**times, "loops": [vars(each) for each in found]})
    elif found:
        _print_margins(found)
    else:
        click.echo(f"no signal of {', '.join(names)} acts on itself through the other components")
    print_notes([f"{each.loop}: {note}" for each in found for note in each.notes])
    if estimate:
        if len(measured) != 1 or amplitude is None:
            raise InputError("--estimate: expected one --loop and an --amplitude")
        _print_estimate(measured[0], scenario, names, at, estimate, amplitude, parameters)
    if figures:
        _draw(measured, figures)
    return 0 if all(each.stable and each.valid for each in found) else 3


def _decibels(factor: float) -> str:
    return f"{20 * math.log10(factor):.2f}" if 0 < factor < math.inf else "any"


def _print_margins(found: Sequence[LoopMargins]) -> None:
    header = [
        "loop",
        "gain up (dB)",
        "gain down (dB)",
        "phase (deg)",
        "delay (s)",
        "disk",
        "crossover (rad/s)",
        "stable",
    ]
    rows = [
        [
            each.loop,
            _decibels(each.gain),
            _decibels(each.gain_reduction),
            f"{math.degrees(each.phase):.2f}" if each.phase < math.inf else "any",
            f"{each.delay:.4g}" if each.delay < math.inf else "any",
            f"{each.disk:.3f}",
            f"{each.crossover:.4g}" if each.crossover == each.crossover else "",
            "?" if not each.valid else "yes" if each.stable else "NO",
        ]
        for each in found
    ]
    print_table(header, rows)


def _print_estimate(
    loop: LoopResponse,
    scenario: str,
    components: list[str],
    at: str | None,
    excitation: Any,
    amplitude: float,
    parameters: dict[str, Any],
) -> None:
    """Print the estimated and the linearised open loop around the crossover, in steps of a third of a decade."""
    import numpy as np

    from ...analysis.loop_margins import loop_margins
    from ...analysis.loop_response import estimate_loop

    crossover = loop_margins(loop).crossover
    if not crossover == crossover:
        raise InputError(
            "--estimate: the gain of the loop is 1 at no frequency, expected a loop with a "
            "crossover"
        )
    wanted = crossover * 10 ** (np.arange(-3, 2) / 3)
    frequencies, estimated = estimate_loop(
        scenario,
        components,
        loop.name,
        wanted,
        at,
        amplitude=amplitude,
        excitation=excitation,
        parameters=parameters,
    )
    linear = loop.open_loop(frequencies)
    click.echo()
    rows = [
        [
            f"{w:.4g}",
            *(
                text
                for value in (a, b)
                for text in (_decibels(abs(value)), f"{np.degrees(np.angle(value)):.2f}")
            ),
            f"{abs(a / b - 1):.2%}",
        ]
        for w, a, b in zip(frequencies.tolist(), estimated.tolist(), linear.tolist(), strict=True)
    ]
    print_table(
        ["frequency (rad/s)", "estimated (dB)", "(deg)", "linear (dB)", "(deg)", "difference"], rows
    )


def _draw(loops: Sequence[LoopResponse], folder: Path) -> None:
    from ...analysis import figures

    draw = {
        "bode": lambda: figures.draw_loop_bode(loops),
        "nyquist": lambda: figures.draw_nyquist(loops),
    }
    write_figures(draw.items(), folder)
