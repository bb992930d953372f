"""Options of `cosim.load` and `cosim.run` in Python: other numbers for times; unknown values are
refused, never ignored.
"""

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
    assert (prepared.plan.settings.stop_time, prepared.plan.settings.step_size) == (
        Fraction(1, 10),
        Fraction(1, 100),
    )


@pytest.mark.parametrize(
    "options", [{"isolation": "fmus"}, {"late": "never"}, {"sandbox": "strict"}]
)
def test_unknown_values(options):
    ((name, value),) = options.items()
    with pytest.raises(cosim.InputError, match=rf"{name}: expected .*found '{value}'"):
        cosim.load("free_flight", **options)


@pytest.mark.parametrize(
    ("method", "message"),
    [
        (
            "do_step(self, t)",
            (
                "x.py:A: expected do_step(self, current_time, step_size); found do_step(self, t) "
                "(x.py:3)"
            ),
        ),
        ("dostep(self, t, h)", "x.py:A has no method do_step(self, current_time, step_size)"),
    ],
)
def test_a_wrong_or_missing_do_step_is_named_before_the_run(folder, method, message):
    (folder.path / "x.py").write_text(
        f"from pythonfmu import Fmi2Slave\nclass A(Fmi2Slave):\n    def {method}: return True\n"
    )
    (found,) = folder.problems({"a": {"python": "x.py:A"}})
    assert found.endswith(message)
