"""Commands that analyse a scenario as a control loop: `cosim trim`, `linearize`, `margins`."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import InputError
from ...core.text import count_noun
from ...report.tables import print_table
from ..messages import print_json, print_log
from ..options import (
    Texts,
    flag_option,
    json_option,
    path_option,
    scenario_argument,
    settings_option,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...analysis.linear_model import LinearModel
    from ...analysis.loop_margins import LoopMargins
    from ...analysis.loop_response import LoopResponse
    from ...analysis.trimming import Trim


at_option = click.option("--at", help="Time (s) of the operating point; default: the start time.")
duration_option = click.option(
    "--duration",
    type=click.FloatRange(min=0, min_open=True),
    help="Duration (s) of the responses; default: 256 samples.",
)


@click.command()
@scenario_argument
@settings_option
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
@path_option(
    "--output",
    help="Scenario file to write; it extends SCENARIO by the found values.",
)
@json_option("an object with found, parameters, residuals and evaluations")
def trim(
    scenario: str,
    settings: Texts,
    free: Texts,
    steady: Texts,
    require: Texts,
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
        scenario, _split_names(free), _split_names(steady), _numbers(require), parameters=given
    )
    if output:
        from ...results.files import write_json
        from ...scenario.file_paths import find_scenario
        from ...scenario.nested_systems import extending_scenario

        description = f"{find_scenario(scenario).stem}, started at its operating point"
        output.parent.mkdir(parents=True, exist_ok=True)
        values = {**given, **found.parameters}
        started = extending_scenario(scenario, output.parent, output.stem, description, values)
        write_json(started, output)
    if as_json:
        values = {key: getattr(found, key) for key in ("parameters", "residuals", "evaluations")}
        print_json({"found": found.is_found, **values})
    else:
        _print_trim(found, output)
    return 0 if found.is_found else 3


def _numbers(texts: Texts) -> dict[str, float]:
    """Return the values of --require by name."""
    from ...scenario.settings import parse_settings

    values = parse_settings(texts)
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"--require {name}={value}: expected a number")
    return values


def _print_trim(found: Trim, output: Path | None) -> None:
    values: dict[str, float] = {}
    for name, value in found.parameters.items():
        if isinstance(value, list):
            values |= {f"{name}[{i}]": element for i, element in enumerate(value, 1)}
        else:
            values[name] = value
    print_table(["free", "value"], [[name, f"{value:.9g}"] for name, value in values.items()])
    click.echo()
    residuals = [[name, f"{value:.2g}"] for name, value in found.residuals.items()]
    print_table(["signal", "residual"], residuals)
    if not found.is_found:
        residual = f"the residual of {found.largest} is {found.residuals[found.largest]:.3g}"
        click.echo(f"no equilibrium: {residual}", err=True)
    _print_notes(f"{name} changes no residual" for name in found.without_effect)
    file = f"; values in {output}" if output else ""
    click.echo(f"\n{count_noun(found.evaluations, 'evaluation')}{file}")


@click.command()
@scenario_argument
@settings_option
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
@at_option
@duration_option
@click.option(
    "--component",
    "components",
    multiple=True,
    metavar="NAME",
    help="Component that steps; the others hold their outputs.",
)
@flag_option("--continuous", help="Convert the model to continuous time.")
@click.option(
    "--order",
    type=click.IntRange(min=0),
    help="Largest number of states; default: as many as the responses show.",
)
@path_option(
    "--output",
    "files",
    multiple=True,
    help="File for the model: .json, .csv or .mat.",
)
@path_option(
    "--figures",
    help="Folder for a Bode diagram, the poles and step responses.",
)
@json_option(
    "an object with time, step (s; null: continuous), inputs, outputs, states, notes, A, B, C, D "
    "and poles"
)
def linearize(
    scenario: str,
    settings: Texts,
    inputs: Texts,
    outputs: Texts,
    at: str | None,
    duration: float | None,
    components: Texts,
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
        _split_names(inputs),
        _split_names(outputs),
        at,
        parameters=parse_settings(settings),
        components=_split_names(components),
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
    _print_notes(model.notes)
    if figures:
        from ...analysis import figures as diagrams

        span = duration or 256 * (model.step or 0.01)
        _write_figures(
            figures,
            bode=lambda: diagrams.draw_bode(model),
            poles=lambda: diagrams.draw_poles(model),
            steps=lambda: diagrams.draw_steps(model, span),
        )


def _print_model(model: LinearModel) -> None:
    import numpy as np

    kind = "continuous" if model.step is None else f"step {model.step:g} s"
    sizes = [
        count_noun(len(model.states), "state"),
        count_noun(len(model.inputs), "input"),
        count_noun(len(model.outputs), "output"),
    ]
    click.echo(f"t = {model.time:g} s, {kind}: {', '.join(sizes)}\n")
    rows = []
    for pole in model.poles():
        rate = complex(pole)
        if model.step is not None:  # the continuous pole (1/s) of the discrete one
            rate = complex(np.log(rate) / model.step) if pole else complex(-math.inf)
        damping = f"{-rate.real / abs(rate):.3f}" if abs(rate) > 1e-9 else ""
        rows.append([f"{pole.real:.6f} {pole.imag:+.6f}i", f"{abs(rate):.4g}", damping])
    print_table(["pole", "natural frequency (rad/s)", "damping"], rows)


@click.command()
@scenario_argument
@settings_option
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
@at_option
@duration_option
@click.option(
    "--estimate",
    type=click.Choice(["sines", "chirp"]),
    help="Also estimate the response of one --loop, with --amplitude.",
)
@click.option(
    "--amplitude", type=float, help="Largest value that --estimate adds, in the unit of the signal."
)
@path_option("--figures", help="Folder for a Bode and a Nyquist diagram.")
@json_option(
    "an object with time, step, and loops: objects with the margins; phases in rad, gains as "
    "factors"
)
def margins(
    scenario: str,
    settings: Texts,
    components: Texts,
    loops: Texts,
    at: str | None,
    duration: float | None,
    estimate: str | None,
    amplitude: float | None,
    figures: Path | None,
    as_json: bool,
) -> int:
    """Print gain, phase, delay and disk margin at the inputs and outputs of a controller.

    SCENARIO is a JSON file or the name of a shipped scenario. Each connected input and output of
    the controller is one loop, which is broken there while all other loops remain closed.
    --estimate compares the linear model of one loop with the response of the nonlinear system. Exit
    code 0: all loops are stable; 3: a loop is unstable ("NO"), or its linear model is not valid
    ("?").
    """
    from ...analysis.loop_margins import loop_margins
    from ...analysis.loop_response import measure_loops
    from ...scenario.settings import parse_settings

    print_log()
    parameters, names = parse_settings(settings), _split_names(components)
    measured = measure_loops(
        scenario, names, at, loops=_split_names(loops), parameters=parameters, duration=duration
    )
    found = [loop_margins(each) for each in measured]
    if as_json:
        content: dict[str, Any] = {}
        if measured:
            content = {"time": measured[0].closed.time, "step": measured[0].closed.step}
        print_json({**content, "loops": [vars(each) for each in found]})
    elif found:
        rows = [_margins_row(each) for each in found]
        print_table(list(rows[0]), [list(row.values()) for row in rows])
    else:
        click.echo(f"no signal of {', '.join(names)} acts on itself through the other components")
    for each in found:
        _print_notes(f"{each.loop}: {note}" for note in each.notes)
    if estimate:
        if len(measured) != 1 or amplitude is None:
            raise InputError("--estimate: expected one --loop and an --amplitude")
        _print_estimate(measured[0], scenario, names, at, estimate, amplitude, parameters)
    if figures:
        from ...analysis import figures as diagrams

        _write_figures(
            figures,
            bode=lambda: diagrams.draw_loop_bode(measured),
            nyquist=lambda: diagrams.draw_nyquist(measured),
        )
    return 0 if all(each.stable and each.valid for each in found) else 3


def _decibels(factor: float) -> str:
    return f"{20 * math.log10(factor):.2f}" if 0 < factor < math.inf else "any"


def _finite(value: float, form: str) -> str:
    return format(value, form) if value < math.inf else "any"


def _margins_row(each: LoopMargins) -> dict[str, str]:
    """Return the cells of a loop by the names of their columns."""
    stable = "yes" if each.stable else "NO"
    return {
        "loop": each.loop,
        "gain up (dB)": _decibels(each.gain),
        "gain down (dB)": _decibels(each.gain_reduction),
        "phase (deg)": _finite(math.degrees(each.phase), ".2f"),
        "delay (s)": _finite(each.delay, ".4g"),
        "disk": f"{each.disk:.3f}",
        "crossover (rad/s)": "" if math.isnan(each.crossover) else f"{each.crossover:.4g}",
        "stable": stable if each.valid else "?",
    }


def _print_estimate(
    loop: LoopResponse,
    scenario: str,
    components: list[str],
    at: str | None,
    excitation: Any,
    amplitude: float,
    parameters: dict[str, Any],
) -> None:
    """Print the estimated and the linearised open loop around the crossover.

    The frequencies are a third of a decade apart.
    """
    import numpy as np

    from ...analysis.loop_margins import loop_margins
    from ...analysis.loop_response import estimate_loop

    crossover = loop_margins(loop).crossover
    if math.isnan(crossover):
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
    rows = []
    for frequency, value, expected in zip(
        frequencies.tolist(), estimated.tolist(), linear.tolist(), strict=True
    ):
        row = [f"{frequency:.4g}"]
        for response in (value, expected):
            row += [_decibels(abs(response)), f"{math.degrees(cmath.phase(response)):.2f}"]
        rows.append([*row, f"{abs(value / expected - 1):.2%}"])
    click.echo()
    print_table(
        ["frequency (rad/s)", "estimated (dB)", "(deg)", "linear (dB)", "(deg)", "difference"], rows
    )


def _split_names(texts: Iterable[str]) -> list[str]:
    """Return the names in texts such as "a,b".

    Commas in brackets, as in "gain[1,2]", separate no names.
    """
    names: list[str] = []
    for text in texts:
        depth, begin = 0, 0
        for i, character in enumerate(f"{text},"):
            depth += (character == "[") - (character == "]")
            if character == "," and not depth:
                names.append(text[begin:i].strip())
                begin = i + 1
    return [name for name in names if name]


def _print_notes(notes: Iterable[str]) -> None:
    """Print hints about the validity of a result to standard error."""
    for note in notes:
        click.echo(f"NOTE {note}", err=True)


def _write_figures(folder: Path, **figures: Callable[[], Figure]) -> None:
    """Draw figures in the common style, and write NAME.png and NAME.svg of each.

    Args:
        folder: The folder; it is created.
        **figures: Function that draws the figure with this name.
    """
    from ...report.figures import figure_style, save_figure

    folder.mkdir(parents=True, exist_ok=True)
    for name, draw in figures.items():
        with figure_style():
            figure = draw()
        for suffix in (".png", ".svg"):
            save_figure(figure, folder / f"{name}{suffix}")
            click.echo(folder / f"{name}{suffix}")
