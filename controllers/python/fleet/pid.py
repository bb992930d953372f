"""Sampled PID controller: parallel form, filtered derivative, output limits, anti-windup, reset."""

from __future__ import annotations

from . import SAMPLE_PERIOD, limit


class Pid:
    """PID controller u = P e + I integral(e) + D N/(1 + N/s) e with output limits.

    The integral is held while it would drive u further beyond a limit. The derivative filter is
    integrated with one third-order Runge-Kutta step per sample, as in the published simulator.
    """

    def __init__(self) -> None:
        self.running, self.integral, self.filtered = False, 0.0, 0.0

    def __call__(
        self,
        error: float,
        feed_forward: float = 0.0,
        reset: bool = False,
        *,
        P: float = 0.0,
        I: float = 0.0,  # noqa: E741 - name of the gain in the equation
        D: float = 0.0,
        N: float = 100.0,
        limits: tuple[float, float] = (-1e9, 1e9),
        start: float = 0.0,
    ) -> float:
        """Compute the output of one sample.

        Args:
            error: Command minus measurement.
            feed_forward: Value added before the limits.
            reset: True holds the start state and ignores the error.
            P: Proportional gain.
            I: Integral gain (1/s).
            D: Derivative gain (s).
            N: Bandwidth of the derivative filter (rad/s).
            limits: Lower and upper limit of the output.
            start: Integral in the start state.

        Returns:
            Limited output.
        """
        e = 0.0 if reset else error
        if reset or not self.running:
            self.integral, self.filtered = start, D * e
        self.running = not reset
        unlimited = feed_forward + P * e + self.integral + N * (D * e - self.filtered)
        u = limit(unlimited, *limits)
        if I * e * (unlimited - u) <= 0:
            self.integral = self.integral + SAMPLE_PERIOD * I * e
        self.filtered = D * e + _filter_decay(N) * (self.filtered - D * e)
        return u


def _filter_decay(N: float) -> float:
    """Return the factor of a state of the derivative filter over one sample period."""
    h = N * SAMPLE_PERIOD
    return 1 - h + h * h / 2 - h**3 / 6
