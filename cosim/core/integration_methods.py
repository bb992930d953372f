"""Integration methods of Model Exchange FMUs: their names, step sizes and descriptions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple

#: name of a method
Method = Literal["euler", "rk4", "cvode"]


class MethodInfo(NamedTuple):
    """Description of a method.

    Attributes:
        description: Text for the documentation of a key.
        variable_step: The method has a tolerance in place of a step size.
    """

    description: str
    variable_step: bool = False


METHODS: Mapping[Method, MethodInfo] = {
    "euler": MethodInfo("explicit, fixed step size"),
    "rk4": MethodInfo("explicit of order 4, fixed step size"),
    "cvode": MethodInfo("BDF with variable step size and root finding", variable_step=True),
}
