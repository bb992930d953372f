"""Options of `cosim.load` and `cosim.run` in Python: other numbers for times; unknown values are refused, never ignored."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import cosim
from cosim.scenario import load


@pytest.mark.parametrize("time", [Fraction(1, 10), Decimal("0.1"), np.float64(0.1), 0.1, "1/10"])
def test_times(time):
    prepared = load("free_flight", stop_time=time, step_size=Fraction(1, 100))
    prepared.free()
    assert (prepared.settings.stop_time, prepared.settings.step_size) == (Fraction(1, 10), Fraction(1, 100))


@pytest.mark.parametrize("options", [{"isolation": "fmus"}, {"late": "never"}, {"sandbox": "strict"}])
def test_unknown_values(options):
    ((name, value),) = options.items()
    with pytest.raises(cosim.InputError, match=rf"{name}: expected .*found '{value}'"):
        cosim.load("free_flight", **options)
