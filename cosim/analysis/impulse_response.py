"""Impulse responses at an operating point, by central differences of fourth order from a saved state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .experiment import Experiment, Response

#: largest change of inputs and outputs, relative to their magnitudes or 1; a power of two, so that
#: sums of values are exact
_CHANGE = 2.0**-12
#: difference of the responses to two perturbations, as a fraction of the response, from which it is
#: no linear one
NONLINEAR = 1e-3
#: part of the response after which a second perturbation begins
_LATER = 8
#: strength, as a fraction of the largest one, below which a response may be rounding
_WEAK = 1e-6


class ImpulseResponses(NamedTuple):
    """Responses per unit of a perturbation that lasts one sample.

    Attributes:
        outputs: Shape (samples + 1, outputs, channels); the perturbation acts from sample 0 to
            sample 1.
        observed: Channels before the addition, shape (samples, channels, channels).
        nonlinearity: Largest difference of the responses to two perturbations of a channel, as a
            fraction of the response.
        variation: Largest difference of the responses to perturbations at two instants, as a
            fraction of their peaks.
    """

    outputs: np.ndarray
    observed: np.ndarray
    nonlinearity: float
    variation: float


def measure_impulse_responses(experiment: Experiment, channel_count: int) -> ImpulseResponses:
    """Return the impulse responses of the chosen channels.

    Args:
        experiment: Its channels and outputs must have been chosen.
        channel_count: Number of chosen channels.
    """
    base = experiment.respond(np.zeros((experiment.sample_count, channel_count)))
    magnitudes = Response(*(np.maximum(1, np.abs(part).max(0)) for part in base))
    parts = [
        _measure_channel(experiment, channel, channel_count, magnitudes)
        for channel in range(channel_count)
    ]
    return ImpulseResponses(
        np.stack([response.outputs for response, _, _ in parts], 2),
        np.stack([response.observed for response, _, _ in parts], 2),
        max((nonlinearity for _, nonlinearity, _ in parts), default=0.0),
        max((variation for _, _, variation in parts), default=0.0),
    )


def _measure_channel(
    experiment: Experiment, channel: int, count: int, magnitudes: Response
) -> tuple[Response, float, float]:
    """Return the response of one channel, its nonlinearity and its variation."""

    def difference(size: float, instant: int = 0) -> Response:
        values = np.zeros((experiment.sample_count, count))
        values[instant, channel] = size
        plus, minus = experiment.respond(values), experiment.respond(-values)
        return Response(*((a - b) / (2 * size) for a, b in zip(plus, minus, strict=True)))

    def peak(response: Response) -> float:
        return max(
            float(np.max(np.abs(a) / b, initial=0))
            for a, b in zip(response, magnitudes, strict=True)
        )

    trial = difference(_CHANGE)
    largest = peak(trial)
    if not largest:
        return trial, 0.0, 0.0
    size = _CHANGE * 2.0 ** np.floor(np.log2(min(magnitudes.observed[channel], 1 / largest)))
    narrow, wide = difference(size), difference(2 * size)
    nonlinearity = peak(Response(*(a - b for a, b in zip(narrow, wide, strict=True)))) / largest
    shift = experiment.sample_count // _LATER
    variation = _variation(narrow, difference(size, shift), shift, magnitudes)
    return (
        Response(*((4 * a - b) / 3 for a, b in zip(narrow, wide, strict=True))),
        nonlinearity,
        variation,
    )


def _variation(response: Response, later: Response, shift: int, magnitudes: Response) -> float:
    """Return the largest difference from the response to a perturbation `shift` samples later, as a fraction of the peaks.

    Signals with a response far below that of the others are left out, because rounding may dominate them.
    """
    peaks = [np.abs(part).max(0) for part in response]
    strengths = [peak / magnitude for peak, magnitude in zip(peaks, magnitudes, strict=True)]
    least = _WEAK * max(float(np.max(strength, initial=0)) for strength in strengths)
    largest = 0.0
    for first, second, peak, strength in zip(response, later, peaks, strengths, strict=True):
        strong = strength > least
        errors = np.abs(second[shift:, strong] - first[:-shift, strong]) / peak[strong]
        largest = max(largest, float(np.max(errors, initial=0)))
    return largest
