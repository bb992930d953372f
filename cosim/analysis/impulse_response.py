"""Impulse responses at an operating point, by central differences of fourth order from a saved state."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .experiment import Experiment, Response

#: largest change of inputs and outputs, relative to their magnitudes or 1; a power of two, so that sums of values are exact
_CHANGE = 2.0**-12
#: difference of the responses to two perturbations, as a fraction of the response, from which it is no linear one
NONLINEAR = 1e-3


class ImpulseResponses(NamedTuple):
    """Responses per unit of a perturbation that lasts one sample.

    Attributes:
        outputs: Shape (samples + 1, outputs, channels); the perturbation acts from sample 0 to sample 1.
        observed: Channels before the addition, shape (samples, channels, channels).
        nonlinearity: Largest difference of the responses to two perturbations of a channel, as a fraction of the response.
    """

    outputs: np.ndarray
    observed: np.ndarray
    nonlinearity: float


def measure_impulse_responses(experiment: Experiment, channel_count: int) -> ImpulseResponses:
    """Return the impulse responses of the chosen channels.

    Args:
        experiment: Its channels and outputs must have been chosen.
        channel_count: Number of chosen channels.
    """
    base = experiment.respond(np.zeros((experiment.sample_count, channel_count)))
    magnitudes = Response(*(np.maximum(1, np.abs(part).max(0)) for part in base))
    parts = [_measure_channel(experiment, channel, channel_count, magnitudes) for channel in range(channel_count)]
    return ImpulseResponses(
        np.stack([part.outputs for part, _ in parts], 2),
        np.stack([part.observed for part, _ in parts], 2),
        max((nonlinearity for _, nonlinearity in parts), default=0.0),
    )


def _measure_channel(experiment: Experiment, channel: int, count: int, magnitudes: Response) -> tuple[Response, float]:
    """Return the response of one channel, and its nonlinearity."""

    def difference(size: float) -> Response:
        values = np.zeros((experiment.sample_count, count))
        values[0, channel] = size
        plus, minus = experiment.respond(values), experiment.respond(-values)
        return Response(*((a - b) / (2 * size) for a, b in zip(plus, minus, strict=True)))

    def peak(response: Response) -> float:
        return max(float(np.max(np.abs(a) / b, initial=0)) for a, b in zip(response, magnitudes, strict=True))

    trial = difference(_CHANGE)
    largest = peak(trial)
    if not largest:
        return trial, 0.0
    size = _CHANGE * 2.0 ** np.floor(np.log2(min(magnitudes.observed[channel], 1 / largest)))
    narrow, wide = difference(size), difference(2 * size)
    nonlinearity = peak(Response(*(a - b for a, b in zip(narrow, wide, strict=True)))) / largest
    return Response(*((4 * a - b) / 3 for a, b in zip(narrow, wide, strict=True))), nonlinearity
