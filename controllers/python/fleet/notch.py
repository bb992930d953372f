"""Sampled notch filter of second order."""

from __future__ import annotations

import math

from . import SAMPLE_PERIOD


class Notch:
    """Notch (s^2 + 2 depth w s + w^2) / (s^2 + 2 width w s + w^2) by the bilinear transform.

    It is computed in transposed direct form II.
    """

    def __init__(self) -> None:
        self.running, self.near, self.far = False, 0.0, 0.0

    def __call__(self, u: float, period: float, depth: float, width: float) -> float:
        """Compute the output of one sample.

        Args:
            u: Input.
            period: Period of the oscillation that is removed (s).
            depth: Damping ratio of the zeros.
            width: Damping ratio of the poles.

        Returns:
            Output; the first one equals the input.
        """
        K = math.tan(math.pi * SAMPLE_PERIOD / period)
        a0 = 1 + 2 * width * K + K * K
        b0, b1, b2 = (
            (1 + 2 * depth * K + K * K) / a0,
            2 * (K * K - 1) / a0,
            (1 - 2 * depth * K + K * K) / a0,
        )
        a2 = (1 - 2 * width * K + K * K) / a0
        if not self.running:
            self.near, self.far, self.running = (1 - b0) * u, (b2 - a2) * u, True
        y = b0 * u + self.near
        self.near, self.far = b1 * u - b1 * y + self.far, b2 * u - a2 * y
        return y
