"""Stability margins of a loop: gain, phase, delay and disk margin."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan, pi
from typing import Any

import numpy as np

from .experiment import Scenario
from .loop_response import LoopResponse, measure_loops

#: lowest frequency (rad/s) and number of frequencies per decade at which crossings are searched
_LOWEST, _PER_DECADE = 1e-3, 400


@dataclass(frozen=True)
class LoopMargins:
    """Margins of the loop that is broken at one signal, while all other loops remain closed.

    Attributes:
        loop: Name of the signal.
        stable: The closed loop is stable at the operating point; margins of an unstable loop mean
            nothing.
        valid: The linear model is close to the measured response; else stability and margins mean
            nothing.
        gain: Factor (1) by which the gain may grow; infinity if it may grow without limit.
        gain_reduction: Factor (1) by which the gain may fall; 0 if it may vanish.
        phase: Phase (rad) that may be lost or gained; infinity if the gain is 1 at no frequency.
        delay: Delay (s) that may be added.
        disk: Disk margin (1), see P. Seiler, A. Packard and P. Gahinet, IEEE Control Systems
            Magazine 40 (2020), 78-95. The gain may vary between (2 - disk) / (2 + disk) and its
            inverse, or the phase by 2 atan(disk / 2).
        gain_frequency: Frequency (rad/s) of the gain margin; NaN if it is infinite.
        crossover: Lowest frequency (rad/s) of the phase margin; NaN if it is infinite.
        disk_frequency: Frequency (rad/s) of the disk margin.
        notes: Hints about the validity of the linear model.
    """

    loop: str
    stable: bool
    valid: bool
    gain: float
    gain_reduction: float
    phase: float
    delay: float
    disk: float
    gain_frequency: float
    crossover: float
    disk_frequency: float
    notes: Sequence[str] = ()


def margins(
    scenario: Scenario,
    components: str | Sequence[str],
    at: float | str | None = None,
    *,
    loops: Sequence[str] = (),
    parameters: Mapping[str, Any] | None = None,
    duration: float | None = None,
) -> list[LoopMargins]:
    """Return the margins at every connected input and output of components in the loop.

    Args:
        scenario: Path of a scenario file, name of a shipped scenario, or the content of a scenario
            file as a dict.
        components: Name of a component or nested system, usually a controller, or several.
        at: Point in time (s) at which the loop is linearised; None: the start time.
        loops: Names of signals; empty: all connected inputs and outputs.
        parameters: Values that replace those of the scenario, see `cosim.load`.
        duration: Duration of the impulse responses (s); None: 256 samples, and up to 64 times more
            for slow modes.

    Returns:
        The margins of each loop. A signal that does not act on itself belongs to no loop and is
        left out.

    Raises:
        InputError: The scenario cannot be run, a name is unknown, or a component cannot return to a
            state.
        ComponentError: A component failed.
    """
    names = [components] if isinstance(components, str) else components
    measured = measure_loops(
        scenario, names, at, loops=loops, parameters=parameters, duration=duration
    )
    return [loop_margins(each) for each in measured]


def loop_margins(loop: LoopResponse) -> LoopMargins:
    """Return the margins of a loop."""
    step = loop.closed.step
    assert step is not None
    highest = pi / step
    count = max(2, round(_PER_DECADE * np.log10(highest / _LOWEST)))
    frequencies = np.geomspace(_LOWEST, highest, count)
    values = loop.open_loop(frequencies)

    def at(frequency: float) -> complex:
        return complex(loop.open_loop(np.array([frequency]))[0])

    gain, reduction, gain_frequency = _gain_margins(frequencies, values, at)
    phase, delay, crossover = _phase_margins(frequencies, values, at)
    disk, disk_frequency = _disk_margin(loop, frequencies)
    return LoopMargins(
        loop.name,
        loop.is_stable,
        loop.is_valid,
        gain,
        reduction,
        phase,
        delay,
        disk,
        gain_frequency,
        crossover,
        disk_frequency,
        loop.closed.notes,
    )


#: number of halvings of an interval that contains a crossing, and of narrower grids around a
#: minimum
_HALVINGS, _ZOOMS = 50, 5

#: response at a frequency (rad/s)
Response = Callable[[float], complex]


def _crossings(
    frequencies: np.ndarray, values: np.ndarray, function: Callable[[float], float]
) -> Iterator[float]:
    """Yield the frequencies at which a function changes its sign.

    The function is also given by its values at `frequencies`.
    """
    for i in np.flatnonzero(values[:-1] * values[1:] < 0).tolist():
        low, high, rises = float(frequencies[i]), float(frequencies[i + 1]), values[i] < 0
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if (function(middle) < 0) == rises else (low, middle)
        yield (low + high) / 2


def _gain_margins(
    frequencies: np.ndarray, values: np.ndarray, at: Response
) -> tuple[float, float, float]:
    """Return the factors by which the gain may grow and fall, and the frequency of the first."""
    gain, reduction, found = inf, 0.0, nan
    points = [
        *_crossings(frequencies, values.imag, lambda frequency: at(frequency).imag),
        float(frequencies[-1]),
    ]
    # at the last frequency, half of the sampling rate, the response is real
    for frequency in points:
        real = at(frequency).real
        if -1 < real < 0 and -1 / real < gain:
            gain, found = -1 / real, frequency
        elif real < -1:
            reduction = max(reduction, -1 / real)
    return gain, reduction, found


def _phase_margins(
    frequencies: np.ndarray, values: np.ndarray, at: Response
) -> tuple[float, float, float]:
    """Return phase (rad) and delay (s) that may be added.

    Also return the frequency (rad/s) of the phase margin.
    """
    phase, delay, found = inf, inf, nan
    for frequency in _crossings(
        frequencies, np.abs(values) - 1, lambda frequency: abs(at(frequency)) - 1
    ):
        lag = float(np.angle(-at(frequency))) % (2 * pi)
        delay = min(delay, lag / frequency)
        if (least := min(lag, 2 * pi - lag)) < phase:
            phase, found = least, frequency
    return phase, delay, found


def _disk_margin(loop: LoopResponse, frequencies: np.ndarray) -> tuple[float, float]:
    """Return the disk margin and its frequency (rad/s)."""
    # The margin is the smallest distance 2 |1 + L| / |1 - L| (Seiler et al., see `LoopMargins`).
    # Each round searches between the neighbours of the best frequency so far.
    for _ in range(_ZOOMS):
        values = loop.open_loop(frequencies)
        distances = np.abs(2 * (1 + values) / (1 - values))
        i = int(np.argmin(distances))
        best = float(distances[i]), float(frequencies[i])
        frequencies = np.linspace(
            frequencies[max(0, i - 1)], frequencies[min(len(frequencies) - 1, i + 1)], 41
        )
    return best
