"""Initialization mode: outputs go to inputs until they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.component import Component, Ports
from ..core.errors import ComponentError
from ..core.system import Endpoint
from ..process.journal import calling
from .component_step import shown
from .layout import Dtype
from .plan import Plan
from .transfers import copy

#: a loop may take so many rounds more than a chain, until outputs change by no more than this, relative to 1 + their size
ROUNDS, TOLERANCE = 100, 1e-12

Values = Mapping[Dtype, np.ndarray]


def propagate(plan: Plan, time: float) -> None:
    """Hand outputs to inputs again and again until nothing changes, which takes a round per component at most.

    An algebraic loop may settle by itself later, as contractions do. Raises ComponentError for one that does not.
    """
    moves = [copy(gather) for phase in plan.all_phases for gather in phase.gathers]
    components, inputs, outputs = plan.system.components, plan.inputs.ports, plan.signals.ports
    given: dict[str, Values] = {}
    found = {name: _contents(outputs[name]) for name in components}
    for number in range(len(components) + 1 + ROUNDS):
        for move in moves:
            move()
        tolerance = TOLERANCE if number > len(components) else 0.0
        changing: list[Endpoint] = []
        for name, component in components.items():
            now = _contents(inputs[name])
            if name in given and not _changed(inputs[name], given[name], now):
                continue
            with calling(name, "set_inputs and get_outputs", "initialization", time):
                component.set_inputs()
                component.get_outputs()
            before, given[name], found[name] = found[name], now, _contents(outputs[name])
            changing += [Endpoint(name, slot) for slot in _changed(outputs[name], before, found[name], tolerance)]
        if not changing:
            return
    raise ComponentError(shown(end.component for end in changing), "initialization", _complaint(plan, changing), time)


def _contents(ports: Ports) -> Values:
    return {dtype: array.copy() for dtype, array in ports.arrays.items()}


def _changed(ports: Ports, old: Values, new: Values, tolerance: float = 0.0) -> list[str]:
    """The slots whose values differ, without a tolerance in any bit."""
    if all(_bits(old[dtype]) == _bits(new[dtype]) for dtype in new):
        return []
    moved = {dtype: iter(_moved(old[dtype], new[dtype], tolerance).tolist()) for dtype in new}
    return [slot for variable in ports.variables for slot in variable.slots if next(moved[variable.dtype])]


def _moved(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    if old.dtype.hasobject:
        return np.asarray(old != new)
    if old.dtype.kind == "f" and tolerance:
        with np.errstate(invalid="ignore"):  # what is not finite never stands still
            return ~(np.abs(new - old) <= tolerance * (1 + np.abs(new)))
    bits = f"u{old.dtype.itemsize}"
    return np.asarray(old.view(bits) != new.view(bits))


def _bits(array: np.ndarray) -> object:
    return array.tolist() if array.dtype.hasobject else array.tobytes()


def _complaint(plan: Plan, changing: Sequence[Endpoint]) -> str:
    wires = [f"{c.source} -> {c.target}" for c in plan.system.connections if c.source in changing]
    advice = "a component in the loop has to answer in a step instead of at once, or the answers have to become smaller"
    return f"an algebraic loop does not settle in {len(plan.system.components) + ROUNDS} rounds, {shown(wires)}; {advice}"


def take_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's own values, which those keep that no connection feeds."""
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.slots)
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)
