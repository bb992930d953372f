"""Open-loop frequency responses at the inputs and outputs of components in a closed loop.

A value d is added to one signal. The value v before the addition is V = -L (V + D). L is the
transfer function of the loop that is broken at this signal while all others remain closed, with the
sign of negative feedback.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..core.errors import InputError, did_you_mean
from ..engine.perturbation import PerturbationTarget
from .experiment import Experiment, Scenario
from .impulse_response import (
    MAX_MISFIT,
    measure_impulse_responses,
    misfit,
    realize,
    validity_notes,
)
from .linear_model import LinearModel

#: signal of an estimated frequency response
Excitation = Literal["sines", "chirp"]

#: error of a model, as a fraction of the peak of the response, from which its margins mean nothing
_INVALID = 0.05
#: the same for an unstable model: a slightly unstable mode may be fitted to what is no linear
#: response
_UNCERTAIN = 1e-3
#: factor by which a response is made longer whose slowest mode it does not show, and how often
_LONGER, _MAX_EXTENSIONS = 4, 3


@dataclass(frozen=True, eq=False)
class LoopResponse:
    """Linear model of a loop that is broken at one signal.

    Attributes:
        name: Name of the signal.
        closed: Discrete model from the added value d to the value v before the addition, in the
            closed loop.
        error: Error of its impulse response, as a fraction of the peak of the measured one.
    """

    name: str
    closed: LinearModel
    error: float

    def open_loop(self, frequencies: np.ndarray) -> np.ndarray:
        """Return L at angular frequencies (rad/s), with the sign of negative feedback."""
        closed = self.closed.frequency_response(frequencies)[:, 0, 0]
        return np.asarray(-closed / (1 + closed))

    @property
    def is_stable(self) -> bool:
        """True if no pole of the closed loop lies outside the unit circle."""
        return bool(self._largest_pole < 1 + 1e-6)

    @property
    def is_valid(self) -> bool:
        """False if the model is too far from the measured response for its margins.

        A model with a pole outside the unit circle must be closer than a stable one.
        """
        return self.error < (_INVALID if self.is_stable else _UNCERTAIN)

    @property
    def _largest_pole(self) -> float:
        return float(np.max(np.abs(self.closed.poles()), initial=0))

    def is_covered(self, sample_count: int) -> bool:
        """Return whether the slowest mode decays to 1/e within half of so many samples."""
        return bool(self._largest_pole ** (sample_count / 2) < np.exp(-1))


def find_loops(
    experiment: Experiment, components: Sequence[str]
) -> dict[str, list[PerturbationTarget]]:
    """Return the connected inputs and outputs of components as channels.

    Args:
        experiment: The scenario.
        components: Names of components or nested systems. Connections between them are not
            included.

    Returns:
        The channels by the names of the connected outputs: first what the components read, then
        what they publish.
    """
    inside, system = experiment.find_components(components), experiment.prepared.system
    names = {endpoint: name for name, endpoint in system.aliases.items()}
    read: dict[str, list[PerturbationTarget]] = {}
    published: dict[str, list[PerturbationTarget]] = {}
    for connection in system.connections:
        source, target = connection.source, connection.target
        is_real = all(
            system.find_element(end).variable.dtype.kind == "f" for end in (source, target)
        )
        if is_real and (source.component in inside) != (target.component in inside):
            channels = published if source.component in inside else read
            name = names.get(source, str(source))
            channels.setdefault(name, []).append(experiment.target_of(connection))
    return {**read, **published}


def choose_loops(
    experiment: Experiment, components: Sequence[str], loops: Sequence[str]
) -> dict[str, list[PerturbationTarget]]:
    """Return the loops of components that names select; all without names.

    Raises:
        InputError: A name stands for no loop.
    """
    found = find_loops(experiment, components)
    chosen: dict[str, list[PerturbationTarget]] = {}
    for text in loops:
        matching = {
            each: found[each]
            for each in found
            if each == text or each.startswith((f"{text}.", f"{text}["))
        }
        if not matching:
            raise InputError(
                f'loops: no connected signal "{text}" of '
                f"{', '.join(components)}{did_you_mean(text, found)}"
            )
        chosen |= matching
    return chosen if loops else found


def measure_loops(
    scenario: Scenario,
    components: Sequence[str],
    at: float | str | None = None,
    *,
    loops: Sequence[str] = (),
    parameters: Mapping[str, Any] | None = None,
    duration: float | None = None,
) -> list[LoopResponse]:
    """Linearise each loop that is broken at one input or output of components.

    All other loops remain closed.

    Args:
        scenario: Path, name or content of a scenario.
        components: Names of components or nested systems, usually a controller.
        at: Point in time (s); None: the start time.
        loops: Names of signals; empty: all connected inputs and outputs.
        parameters: Values that replace those of the scenario.
        duration: Duration of the impulse responses (s); None: 256 samples, and up to 64 times more
            for slow modes.

    Returns:
        The loops. A signal that does not act on itself belongs to no loop and is left out.

    Raises:
        InputError: The scenario cannot be run, or a name is unknown.
        ComponentError: A component failed.
    """
    with Experiment(scenario, parameters, at, duration) as experiment:
        responses = []
        for name, targets in choose_loops(experiment, components, loops).items():
            experiment.choose({name: targets}, [])
            if found := _measure_long_enough(name, experiment):
                responses.append(found)
    return responses


def _measure_long_enough(name: str, experiment: Experiment) -> LoopResponse | None:
    """Measure a loop, and again with a longer response while it does not show the slowest mode.

    None: the signal is in no loop.

    A longer response counts only if its model is about as good: later the mode of a controller may
    change.
    """
    count = experiment.sample_count
    try:
        found = _measure(name, experiment)
        for _ in range(_MAX_EXTENSIONS):
            if (
                not found
                or found.is_covered(experiment.sample_count)
                or experiment.sample_count == experiment.max_sample_count
            ):
                break
            experiment.sample_count = min(
                _LONGER * experiment.sample_count, experiment.max_sample_count
            )
            longer = _measure(name, experiment)
            if longer is None or longer.error > max(found.error, MAX_MISFIT):
                break
            found = longer
    finally:
        experiment.sample_count = count
    return found


def _measure(name: str, experiment: Experiment) -> LoopResponse | None:
    measured = measure_impulse_responses(experiment, 1)
    if not measured.observed.any():
        return None
    realization = realize(measured.observed)
    error = misfit(realization, measured.observed)
    states = [f"x{i + 1}" for i in range(len(realization.a))]
    closed = LinearModel(*realization, [name], [name], states, experiment.step, experiment.time)
    loop = LoopResponse(name, closed, error)
    text = f"the model reproduces the measured response only to {error:.2g} of its peak"
    if not loop.is_valid:
        text += ", so its margins mean nothing"
    notes = validity_notes(measured.nonlinearity, error, text)
    return replace(loop, closed=replace(closed, notes=notes))


def estimate_loop(
    scenario: Scenario,
    components: Sequence[str],
    loop: str,
    frequencies: Sequence[float] | np.ndarray,
    at: float | str | None = None,
    *,
    amplitude: float,
    excitation: Excitation = "sines",
    parameters: Mapping[str, Any] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Estimate the open-loop frequency response from that to a finite excitation.

    The system remains nonlinear.

    A run without excitation is subtracted. With sines, all frequencies act together; the response
    is measured over one period of the lowest frequency after four periods. A chirp sweeps from the
    lowest to the highest frequency in eight periods of the lowest one, followed by four periods in
    which the response decays.

    Args:
        scenario: Path, name or content of a scenario.
        components: Names of components or nested systems.
        loop: Name of the signal.
        frequencies: Angular frequencies (rad/s).
        at: Point in time (s); None: the start time.
        amplitude: Largest added value, in the unit of the signal.
        excitation: Kind of the excitation.
        parameters: Values that replace those of the scenario.

    Returns:
        The used frequencies (rad/s), of sines rounded to multiples of the lowest one, and L, both
        of shape (frequencies,).

    Raises:
        InputError: The scenario cannot be run, or a name is unknown.
        ComponentError: A component failed.
    """
    wanted = np.unique(np.asarray(frequencies, float))
    if not wanted.size or wanted[0] <= 0:
        raise InputError("frequencies: expected positive numbers (rad/s)")
    period = 2 * np.pi / float(wanted[0])
    with Experiment(scenario, parameters, at, 13 * period) as experiment:
        chosen = choose_loops(experiment, components, [loop])
        if len(chosen) != 1:
            raise InputError(f'loops: "{loop}" names {len(chosen)} signals, expected one')
        experiment.choose(chosen, [])
        samples = round(period / experiment.step)
        make = _sines if excitation == "sines" else _chirp
        used, added, window = make(wanted, samples, experiment.step, amplitude)
        excited, free = (
            experiment.respond(values[:, None]).observed[:, 0]
            for values in (added, np.zeros(len(added)))
        )
    times = np.arange(len(added)) * experiment.step
    before = excited - free
    kernel = np.exp(-1j * used[:, None] * times[window])
    value, sum_ = kernel @ before[window], kernel @ (before + added)[window]
    return used, -value / sum_


def _sines(
    frequencies: np.ndarray, samples: int, step: float, amplitude: float
) -> tuple[np.ndarray, np.ndarray, slice]:
    """Return the used frequencies, the added values, and the samples that are evaluated.

    The phases are those of M. R. Schroeder (IEEE Trans. Inf. Theory 16 (1970), 85-89), which keep
    the peak low.
    """
    base = 2 * np.pi / (samples * step)
    harmonics = np.unique(np.clip(np.round(frequencies / base), 1, (samples - 1) // 2)).astype(int)
    count, times = len(harmonics), np.arange(5 * samples)
    number = np.arange(count)
    phases = -np.pi * number * (number + 1) / count
    values = np.cos(2 * np.pi * harmonics[:, None] * times / samples + phases[:, None]).sum(0)
    return (
        harmonics * base,
        amplitude * values / np.abs(values).max(),
        slice(4 * samples, 5 * samples),
    )


def _chirp(
    frequencies: np.ndarray, samples: int, step: float, amplitude: float
) -> tuple[np.ndarray, np.ndarray, slice]:
    """Return the used frequencies, the added values, and the samples that are evaluated."""
    times, duration = np.arange(8 * samples) * step, 8 * samples * step
    first, last = frequencies[0] / 2, min(1.5 * frequencies[-1], np.pi / step)
    growth = np.log(last / first) / duration
    values = amplitude * np.sin(first / growth * np.expm1(growth * times))
    return frequencies, np.concatenate([values, np.zeros(4 * samples)]), slice(None)
