"""Sampled Butterworth low-pass of order 15 by the bilinear transform.

Seven second-order sections and one of first order.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from . import SAMPLE_PERIOD

ORDER, SECTION_COUNT = 15, 7


class Butterworth:
    """Low-pass with a gain of exactly -3 dB at the cut-off frequency.

    Sections in transposed direct form II.
    """

    def __init__(self) -> None:
        self.running = False
        self.near, self.far, self.last = [0.0] * SECTION_COUNT, [0.0] * SECTION_COUNT, 0.0

    def __call__(self, u: float, reset: bool, frequency: float, start: float) -> float:
        """Compute the output of one sample.

        Args:
            u: Input.
            reset: True holds the start state and ignores the input.
            frequency: Cut-off frequency (Hz), below 50.
            start: Steady input before the start and during a reset.

        Returns:
            Output.
        """
        K = math.tan(math.pi * frequency * SAMPLE_PERIOD)
        if reset or not self.running:
            self._set_steady_state(K, start)
        self.running = not reset
        x = start if reset else u
        for i, (b, a1, a2) in enumerate(_section_coefficients(K)):
            w = b * x + self.near[i]
            self.near[i] = 2 * b * x - a1 * w + self.far[i]
            self.far[i] = b * x - a2 * w
            x = w
        return self._first_order_section(K, x)

    def _first_order_section(self, K: float, x: float) -> float:
        a1, b = (K - 1) / (K + 1), K / (K + 1)
        y = b * x + self.last
        self.last = b * x - a1 * y
        return y

    def _set_steady_state(self, K: float, u: float) -> None:
        for i, (b, _, a2) in enumerate(_section_coefficients(K)):
            self.near[i], self.far[i] = (1 - b) * u, (b - a2) * u
        self.last = (1 - K / (K + 1)) * u


def _section_coefficients(K: float) -> Iterator[tuple[float, float, float]]:
    """Yield b, a1, a2 of b (1 + 1/z)^2 / (1 + a1/z + a2/z^2).

    There is one section for each pair of complex poles.
    """
    for i in range(1, SECTION_COUNT + 1):
        damping = 2 * math.cos(math.pi * i / ORDER)
        a0 = 1 + damping * K + K * K
        yield K * K / a0, 2 * (K * K - 1) / a0, (1 - damping * K + K * K) / a0
