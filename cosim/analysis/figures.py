"""Bode and Nyquist diagrams, poles and step responses, also for the report of a scenario.

{"name": "bode", "python": "cosim.analysis.figures:bode",
 "arguments": {"components": "uav", "at": 15}}
"""

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..results import Result
from .kpis import recorded_scenario
from .linear_model import LinearModel
from .linearization import linearize
from .loop_margins import loop_margins
from .loop_response import LoopResponse, measure_loops

#: width of a column of a two-column paper, and of the page (in)
_COLUMN, _PAGE = 3.5, 7.16
#: line styles, each with the six colours of the common style; together the largest number of curves
#: in a diagram
_LINE_STYLES = ("-", "--")
_MAX_CURVES = 6 * len(_LINE_STYLES)
#: smallest gain (1) in a Bode diagram
_LEAST_GAIN = 1e-6
#: decades below half of the sampling rate that Bode diagrams show
_DECADES = 4


def bode(
    result: Result,
    components: str,
    at: float,
    loops: list[str] | None = None,
    duration: float | None = None,
) -> Figure:
    """Draw the open loops at the inputs and outputs of a controller in a Bode diagram.

    Args:
        result: Recorded run, whose scenario runs again until `at`.
        components: Name of a component or nested system.
        at: Time at which the loop is linearised (s).
        loops: Names of signals; None: all connected inputs and outputs.
        duration: Duration of the impulse responses (s); None: 256 samples.
    """
    return draw_loop_bode(
        measure_loops(
            recorded_scenario(result), [components], at, loops=loops or (), duration=duration
        )
    )


def nyquist(
    result: Result,
    components: str,
    at: float,
    loops: list[str] | None = None,
    duration: float | None = None,
) -> Figure:
    """Draw the open loops at the inputs and outputs of a controller in a Nyquist diagram.

    Arguments as for `bode`.
    """
    return draw_nyquist(
        measure_loops(
            recorded_scenario(result), [components], at, loops=loops or (), duration=duration
        )
    )


def poles(
    result: Result, inputs: list[str], outputs: list[str], at: float, duration: float | None = None
) -> Figure:
    """Draw the poles of the linearised closed loop.

    Args:
        result: Recorded run, whose scenario runs again until `at`.
        inputs: Names of inputs.
        outputs: Names of outputs.
        at: Time at which the scenario is linearised (s).
        duration: Duration of the impulse responses (s); None: 256 samples.
    """
    return draw_poles(linearize(recorded_scenario(result), inputs, outputs, at, duration=duration))


def steps(
    result: Result, inputs: list[str], outputs: list[str], at: float, duration: float | None = None
) -> Figure:
    """Draw the step responses of the linearised closed loop; arguments as for `poles`."""
    model = linearize(recorded_scenario(result), inputs, outputs, at, duration=duration)
    return draw_steps(model, duration or 256 * (model.step or 0.0))


# -- drawing
# ---------------------------------------------------------------------------------------


def draw_loop_bode(loops: Sequence[LoopResponse]) -> Figure:
    """Draw gain and phase of open loops.

    Dots mark the crossover, where the phase margin is read.
    """
    figure = Figure(figsize=(_PAGE, 4.2), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for loop in loops[:_MAX_CURVES]:
        assert loop.closed.step is not None
        frequencies = _frequencies(loop.closed.step)
        values = loop.open_loop(frequencies)
        line, angles = _draw_bode_curve(gain, phase, frequencies, values, loop.name)
        crossover = loop_margins(loop).crossover
        if np.isfinite(crossover):
            phase.plot(
                crossover,
                np.interp(crossover, frequencies, angles),
                "o",
                color=line.get_color(),
                markersize=3,
            )
    _label_bode(gain, phase)
    phase.axhline(-180, color="#444444", linewidth=0.6)
    return figure


def draw_bode(model: LinearModel) -> Figure:
    """Draw gain and phase from each input to each output, at most 12 curves."""
    figure = Figure(figsize=(_PAGE, 4.2), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    step = model.step or pi / max(1.0, 100 * float(np.max(np.abs(model.poles()), initial=0)))
    frequencies = _frequencies(step)
    response = model.frequency_response(frequencies)
    for i, j in _curves(response):
        _draw_bode_curve(
            gain,
            phase,
            frequencies,
            response[:, i, j],
            f"{model.inputs[j]} \u2192 {model.outputs[i]}",
        )
    _label_bode(gain, phase)
    return figure


def draw_nyquist(loops: Sequence[LoopResponse]) -> Figure:
    """Draw open loops in the complex plane around the point -1.

    A circle shows the disk margin of the worst one.
    """
    figure = Figure(figsize=(1.35 * _COLUMN, _COLUMN), layout="constrained")
    axes = figure.subplots()
    for loop in loops[:_MAX_CURVES]:
        assert loop.closed.step is not None
        values = loop.open_loop(_frequencies(loop.closed.step))
        values = np.where(np.abs(values) < 100, values, np.nan)
        axes.plot(values.real, values.imag, label=loop.name, **_style(axes))
    if loops:
        disk = min(loop_margins(loop).disk for loop in loops)
        left, right = -(2 + disk) / max(2 - disk, 1e-6), -(2 - disk) / (2 + disk)
        angles = np.linspace(0, 2 * pi, 200)
        centre, radius = (left + right) / 2, (right - left) / 2
        axes.plot(
            centre + radius * np.cos(angles),
            radius * np.sin(angles),
            "--",
            color="#444444",
            linewidth=0.6,
        )
    axes.plot(-1, 0, "+", color="#444444")
    axes.set(
        xlim=(-3, 1), ylim=(-2, 2), xlabel="real part", ylabel="imaginary part", aspect="equal"
    )
    figure.legend(loc="outside right upper", fontsize=5)
    return figure


def draw_poles(model: LinearModel) -> Figure:
    """Draw the poles of a model, of a discrete one with the unit circle."""
    figure = Figure(figsize=(_COLUMN, _COLUMN), layout="constrained")
    axes = figure.subplots()
    values = model.poles()
    if model.step is None:
        axes.axvline(0, color="#444444", linewidth=0.6)
        axes.set(xlabel="real part (1/s)", ylabel="imaginary part (rad/s)")
    else:
        angles = np.linspace(0, 2 * pi, 200)
        axes.plot(np.cos(angles), np.sin(angles), color="#444444", linewidth=0.6)
        axes.set(xlabel="real part", ylabel="imaginary part", aspect="equal")
    axes.plot(values.real, values.imag, "x", markersize=5)
    return figure


def draw_steps(model: LinearModel, duration: float) -> Figure:
    """Draw the responses of all outputs to a unit step of each input, at most 12 curves.

    Args:
        model: The model.
        duration: Duration (s).
    """
    figure = Figure(figsize=(_PAGE, 2.6), layout="constrained")
    axes = figure.subplots()
    times, responses = model.step_response(duration)
    for i, j in _curves(responses):
        axes.plot(
            times,
            responses[:, i, j],
            label=f"{model.inputs[j]} \u2192 {model.outputs[i]}",
            **_style(axes),
        )
    axes.set(xlabel="time (s)", ylabel="response to a unit step")
    axes.legend(fontsize=5)
    return figure


def _frequencies(step: float) -> np.ndarray:
    """Return angular frequencies (rad/s) up to half of the sampling rate."""
    return np.geomspace(pi / step * 10.0**-_DECADES, pi / step, 1000)


def _curves(responses: np.ndarray) -> list[tuple[int, int]]:
    """Return output and input of the responses that are not zero, at most `_MAX_CURVES`."""
    return [(int(i), int(j)) for i, j in np.argwhere(np.abs(responses).max(0) > 0)[:_MAX_CURVES]]


def _style(axes: Axes) -> dict[str, Any]:
    """Return the style of the next curve."""
    number = len([line for line in axes.lines if not str(line.get_label()).startswith("_")])
    return {
        "color": f"C{number % 6}",
        "linestyle": _LINE_STYLES[number // 6 % len(_LINE_STYLES)],
        "linewidth": 0.9,
    }


def _draw_bode_curve(
    gain: Axes, phase: Axes, frequencies: np.ndarray, values: np.ndarray, label: str
) -> tuple[Line2D, np.ndarray]:
    """Draw gain and phase of one curve, and return its line and its phase (deg)."""
    style = _style(gain)
    (line,) = gain.semilogx(
        frequencies, 20 * np.log10(np.maximum(np.abs(values), _LEAST_GAIN)), label=label, **style
    )
    angles = np.degrees(np.unwrap(np.angle(values)))
    angles -= 360 * np.ceil((angles[0] - 90) / 360)
    phase.semilogx(frequencies, angles, **style)
    return line, angles


def _label_bode(gain: Axes, phase: Axes) -> None:
    gain.axhline(0, color="#444444", linewidth=0.6)
    gain.set_ylabel("gain (dB)")
    gain.legend(fontsize=5, ncols=2)
    phase.set(xlabel="frequency (rad/s)", ylabel="phase (deg)")
