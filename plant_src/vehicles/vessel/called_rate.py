"""Models whose derivatives are one function in C, which all stages of the integration call.

The code is small.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca

from cosim.export.equations.c_code import call_in_c
from cosim.export.equations.model import ContinuousModel


def with_called_rate(model: ContinuousModel) -> ContinuousModel:
    """Return the model with its derivatives as a function that the generated code calls."""
    symbols = [
        ca.SX.sym("state", len(model.states)),
        ca.SX.sym("inputs", len(model.elements("input"))),
    ]
    symbols.append(model.derived_parameter_symbols())
    rate = ca.Function("rate_of_change", symbols, [model.derivatives(*symbols)])
    return replace(
        model,
        derivatives=lambda state, inputs, constants: call_in_c(rate, state, inputs, constants)[0],
    )
