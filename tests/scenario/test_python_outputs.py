"""Outputs of a PythonFMU class have the type of the variable, or convert to it without loss."""

import numpy as np
import pytest
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Integer, Real, String
from systems import make_system, run_system

from cosim.components.python_fmu import PythonFmuComponent
from cosim.core.errors import ComponentError

START = {Real: 0.0, Integer: 0, Boolean: False, String: ""}


def last(kind, value):
    class Constant(Fmi2Slave):
        def __init__(self, **arguments):
            super().__init__(**arguments)
            self.y = START[kind]
            self.register_variable(kind("y", causality=Fmi2Causality.output))

        def do_step(self, _t, _h):
            self.y = value
            return True

    return run_system(
        make_system({"a": PythonFmuComponent(Constant(instance_name="a"), "a")}), 1, 1, ["a.y"]
    ).columns["a.y"][-1]


@pytest.mark.parametrize("unit", ["m/s", "°C", "-", "bar_g", "€/kWh"])
def test_a_unit_may_have_any_name(unit):
    class Spoken(Fmi2Slave):
        def __init__(self, **arguments):
            super().__init__(**arguments)
            self.y = 0.0
            variable = Real("y", causality=Fmi2Causality.output)
            variable.unit = unit
            self.register_variable(variable)

        def do_step(self, _t, _h):
            return True

    system = make_system({"a": PythonFmuComponent(Spoken(instance_name="a"), "a")})
    assert run_system(system, 1, 1, ["a.y"]).units == {"a.y": unit}


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (Real, 2, 2.0),
        (Real, np.float32(0.5), 0.5),
        (Real, np.array(1.5), 1.5),
        (Real, True, 1.0),
        (Integer, np.int64(7), 7),
        (Integer, True, 1),
        (Boolean, np.True_, True),
        (Boolean, 1, True),
        (String, "x", "x"),
    ],
)
def test_a_value_that_converts_without_loss_is_accepted(kind, value, expected):
    assert last(kind, value) == expected


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (Real, None, "a number"),
        (Real, "1.5", "a number"),
        (Real, np.zeros(2), "a number"),
        (Integer, 2.7, "an integer of 32 bits"),
        (Integer, 2**31, "an integer of 32 bits"),
        (Integer, np.int64(2**31), "an integer of 32 bits"),
        (Boolean, "False", "True or False"),
        (Boolean, 2, "True or False"),
        (String, 5, "a text"),
    ],
)
def test_any_other_value_is_an_error_that_names_the_output(kind, value, expected):
    with pytest.raises(
        ComponentError, match=f'output "y" is .*, expected {expected}$'
    ):  # and no line of cosim itself
        last(kind, value)
