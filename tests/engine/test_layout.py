"""Layout of values: variables of one type are adjacent, so that one FMI call gets them."""

import numpy as np
import pytest
from fakes import FakeComponent
from systems import endpoint, make_system

from cosim.core.component import Variable
from cosim.core.time_grid import exact_fraction
from cosim.engine import compile_plan
from cosim.engine.settings import Settings

INT = np.dtype(np.int32)

VARIABLES = {
    "n": Variable("n", "Int32", "output"),
    "flag": Variable("flag", "Boolean", "output", dtype=INT),
    "x": Variable("x", "Float64", "output"),
    "mode": Variable("mode", "Enumeration", "output", dtype=INT),
    "m": Variable("m", "Int32", "output"),
    "other": Variable("other", "Boolean", "output", dtype=INT),
}


@pytest.mark.parametrize(
    ("chosen", "order"),
    [
        (VARIABLES, ["n", "mode", "m", "flag", "other", "x"]),
        (["flag", "x", "mode", "m"], ["flag", "x", "mode", "m"]),
    ],
)
def test_variables_that_one_fmi_call_can_get_are_adjacent(chosen, order):
    component = FakeComponent([VARIABLES[name] for name in chosen], lambda _values, _t, _h: None)
    columns = {name: endpoint(f"a.{name}") for name in chosen}
    plan = compile_plan(
        make_system({"a": component}),
        Settings(exact_fraction(0), exact_fraction(1), exact_fraction(1), columns),
    )
    assert [variable.name for variable in plan.outputs.ports["a"].variables] == order
