"""Initialization mode: outputs go to inputs until they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.component import Component, Ports
from ..core.errors import ComponentError, abbreviate_names
from ..core.system import Endpoint
from ..process.journal import calling_component
from .layout import Dtype
from .plan import Plan
from .transfer_calls import compile_transfer

#: a loop may take so many rounds more than a chain, until outputs change by no more than this, relative to 1 + their size
EXTRA_ITERATIONS, TOLERANCE = 100, 1e-12

PortValues = Mapping[Dtype, np.ndarray]


def propagate_initial_values(plan: Plan, time: float) -> None:
    """Hand outputs to inputs again and again until nothing changes, which takes a round per component at most.

    An algebraic loop may settle by itself later, as contractions do. Raises ComponentError for one that does not.
    """
    moves = [compile_transfer(gather) for phase in plan.all_phases for gather in phase.transfers]
    components, inputs, outputs = plan.system.components, plan.inputs.ports, plan.outputs.ports
    given: dict[str, PortValues] = {}
    found = {name: _copy_values(outputs[name]) for name in components}
    for number in range(len(components) + 1 + EXTRA_ITERATIONS):
        for move in moves:
            move()
        tolerance = TOLERANCE if number > len(components) else 0.0
        changing: list[Endpoint] = []
        for name, component in components.items():
            now = _copy_values(inputs[name])
            if name in given and not _changed_scalars(inputs[name], given[name], now):
                continue
            with calling_component(name, "set_inputs and get_outputs", "initialization", time):
                component.set_inputs()
                component.get_outputs()
            before, given[name], found[name] = found[name], now, _copy_values(outputs[name])
            changing += [Endpoint(name, slot) for slot in _changed_scalars(outputs[name], before, found[name], tolerance)]
        if not changing:
            return
    raise ComponentError(
        abbreviate_names(end.component for end in changing), "initialization", _algebraic_loop_message(plan, changing), time
    )


def _copy_values(ports: Ports) -> PortValues:
    return {dtype: array.copy() for dtype, array in ports.arrays.items()}


def _changed_scalars(ports: Ports, old: PortValues, new: PortValues, tolerance: float = 0.0) -> list[str]:
    """The slots whose values differ, without a tolerance in any bit."""
    if all(_bit_pattern(old[dtype]) == _bit_pattern(new[dtype]) for dtype in new):
        return []
    moved = {dtype: iter(_changed_elements(old[dtype], new[dtype], tolerance).tolist()) for dtype in new}
    return [slot for variable in ports.variables for slot in variable.scalar_names if next(moved[variable.dtype])]


def _changed_elements(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    if old.dtype.hasobject:
        return np.asarray(old != new)
    if old.dtype.kind == "f" and tolerance:
        with np.errstate(invalid="ignore"):  # what is not finite never stands still
            return ~(np.abs(new - old) <= tolerance * (1 + np.abs(new)))
    bits = f"u{old.dtype.itemsize}"
    return np.asarray(old.view(bits) != new.view(bits))


def _bit_pattern(array: np.ndarray) -> object:
    return array.tolist() if array.dtype.hasobject else array.tobytes()


def _algebraic_loop_message(plan: Plan, changing: Sequence[Endpoint]) -> str:
    wires = [f"{c.source} -> {c.target}" for c in plan.system.connections if c.source in changing]
    advice = "a component in the loop has to answer in a step instead of at once, or the answers have to become smaller"
    rounds = len(plan.system.components) + EXTRA_ITERATIONS
    return f"an algebraic loop does not settle in {rounds} rounds, {abbreviate_names(wires)}; {advice}"


def copy_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's own values, which those keep that no connection feeds."""
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.scalar_names)
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)
