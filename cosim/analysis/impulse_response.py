"""Impulse responses at an operating point, and minimal state-space realizations of them.

Responses are central differences of fourth order from a saved state. The method of realization is
the eigensystem realization algorithm (J.-N. Juang and R. S. Pappa, J. Guidance 8
(1985), 620-627). The lags of the rows and columns of the Hankel matrix grow geometrically, so that
a small matrix covers fast and slow modes.
"""

from typing import NamedTuple

import numpy as np

from .experiment import Experiment, Response

#: fractions of the largest singular value below which the others may be noise of the measured
#: responses
_TOLERANCES = 10.0 ** -np.arange(8, 2, -1)
#: factor by which the misfit of a lower order may exceed the smallest misfit
_MISFIT_FACTOR = 3.0
#: largest tolerance
_MAX_TOLERANCE = 1e-3


class Realization(NamedTuple):
    """Matrices of x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k]."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray

    def impulse_response(self, count: int) -> np.ndarray:
        """Return D, C B, C A B, ..., shape (count, outputs, inputs)."""
        response, state = [self.d], self.b
        for _ in range(count - 1):
            response.append(self.c @ state)
            state = self.a @ state
        return np.array(response)


def realize(
    response: np.ndarray, max_order: int | None = None, tolerance: float = 0.0
) -> Realization:
    """Return a balanced realization of the lowest order that reproduces a response well enough.

    Args:
        response: Impulse response D, C B, C A B, ..., shape (steps, outputs, inputs).
        max_order: Largest order; None: no limit.
        tolerance: Misfit of about this size is good enough, because the response itself varies as
            much; at most 0.001 counts.
    """
    # The Hankel matrix of a linear system is the product of what the outputs show of a state and of
    # how the inputs reach it. A singular value decomposition splits it into both factors; the
    # number of kept singular values is the order. The matrix shifted by one sample gives A.
    # The largest scaled responses of outputs and inputs are about 1.
    peaks = np.abs(response).max(0)
    rows = peaks.max(1)
    rows[rows == 0] = 1
    columns = (peaks / rows[:, None]).max(0)
    columns[columns == 0] = 1
    scaled = response / rows[:, None] / columns
    # Two lags together and 2 more are less than the number of samples.
    lags = np.unique(np.round(1.35 ** np.arange(0, 60)).astype(int) - 1)
    lags = lags[lags <= max(0, (len(response) - 3) // 2)]
    now, later = _hankel(scaled[1:], lags), _hankel(scaled[2:], lags)
    left, singular, right = np.linalg.svd(now, full_matrices=False)
    outputs, inputs = response.shape[1:]

    def realization(order: int) -> Realization:
        root = np.sqrt(singular[:order])
        reach, show = root[:, None] * right[:order], left[:, :order] * root
        a = (left[:, :order] / root).T @ later @ (right[:order].T / root)
        return Realization(
            a, reach[:, :inputs] * columns, show[:outputs] * rows[:, None], response[0]
        )

    orders = {
        int(np.sum(singular > tolerance * singular[0])) if singular[0] > 0 else 0
        for tolerance in _TOLERANCES
    }
    if max_order is not None:
        orders = {min(order, max_order) for order in orders}
    found = [realization(order) for order in sorted(orders)]
    misfits = [misfit(each, response) for each in found]
    enough = _MISFIT_FACTOR * max(min(misfits), min(tolerance, _MAX_TOLERANCE))
    return next(each for each, value in zip(found, misfits, strict=True) if value <= enough)


def misfit(realization: Realization, response: np.ndarray) -> float:
    """Return the largest error of the impulse response of a realization.

    It is a fraction of the peak of each response.
    """
    peaks = np.abs(response).max(0)
    peaks[peaks == 0] = 1
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.abs(realization.impulse_response(len(response)) - response) / peaks
    return float(np.max(np.nan_to_num(errors, nan=np.inf), initial=0))


def _hankel(response: np.ndarray, lags: np.ndarray) -> np.ndarray:
    """Return the matrix of the blocks response[i + j] for all lags i and j."""
    blocks = response[lags[:, None] + lags[None, :]]
    count, _, outputs, inputs = blocks.shape
    return np.asarray(blocks.transpose(0, 2, 1, 3).reshape(count * outputs, count * inputs))


#: largest change of inputs and outputs, relative to their magnitudes or 1; a power of two, so that
#: sums of values are exact
_CHANGE = 2.0**-12
#: difference of the responses to two perturbations, as a fraction of the response, from which it is
#: no linear one
_NONLINEAR = 1e-3
#: largest error of the realized impulse responses, as a fraction of their peaks, without a hint
MAX_MISFIT = 1e-4
#: hint at the causes of a larger error
_NO_EQUILIBRIUM = (
    "the operating point is no equilibrium (see cosim trim), or a mode changes during the "
    "response (choose another --at or a "
    "shorter --duration)"
)
#: part of the response after which a second perturbation begins
_LATER = 8
#: strength, as a fraction of the largest one, below which a response may be rounding
_WEAK = 1e-6


def validity_notes(nonlinearity: float, error: float, misfit_text: str) -> list[str]:
    """Return hints about the validity of a linear model.

    Args:
        nonlinearity: See `ImpulseResponses`.
        error: Largest error of the responses of the model, as a fraction of their peaks.
        misfit_text: Hint at an error that is too large.
    """
    notes = []
    if nonlinearity > _NONLINEAR:
        notes.append(
            f"the responses to two perturbations differ by {nonlinearity:.2g} of their peak: a "
            "limit, a mode or contact acts"
        )
    if error > MAX_MISFIT:
        notes.append(f"{misfit_text}: {_NO_EQUILIBRIUM}")
    return notes


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

    # A trial finds the size of a perturbation that changes no signal by more than `_CHANGE` of its
    # magnitude. The differences for this size and twice of it cancel the error of second order
    # (Richardson extrapolation), and their own difference measures the nonlinearity.
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
    """Return the largest difference from the response to a later perturbation.

    The perturbation is `shift` samples later. The difference is a fraction of the peaks.

    Signals with a response far below that of the others are left out, because rounding may
    dominate them.
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
