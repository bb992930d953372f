"""Initialization of components up to step mode; outputs are passed to connected inputs until they converge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.component import Component, Ports
from ..core.errors import ComponentError, abbreviate_names
from ..core.system import Endpoint
from ..process.journal import calling_component
from .convergence import exceeds_tolerance
from .layout import Dtype
from .plan import Plan
from .transfer_calls import compile_transfer

#: iterations allowed beyond one per component, for algebraic loops that converge; relative tolerance of their outputs
EXTRA_ITERATIONS, TOLERANCE = 100, 1e-12

PortValues = Mapping[Dtype, np.ndarray]


def instantiate_components(plan: Plan) -> None:
    """Bind all components to their arrays and instantiate them.

    Raises:
        ComponentError: a component failed.
    """
    for name, component in plan.system.components.items():
        with calling_component(name, "bind", "load"):
            component.bind(plan.inputs.ports[name], plan.outputs.ports[name])
        with calling_component(name, "instantiate", "load"):
            component.instantiate()


def initialize_components(plan: Plan) -> None:
    """Bring instantiated components to step mode: start values, initialization mode, consistent initial outputs.

    Raises:
        ComponentError: a component failed, or an algebraic loop did not converge.
    """
    start, stop = plan.grid.time_at(0), plan.grid.time_at(plan.grid.count)
    components = plan.system.components
    for name, component in components.items():
        with calling_component(name, "set", "initialization"):
            for variable, value in plan.system.start_values.get(name, {}).items():
                component.set(variable, value)
    for name, component in components.items():
        with calling_component(name, "enter_initialization_mode", "initialization", start):
            component.enter_initialization_mode(start, stop)
            component.get_outputs()
            copy_start_values(component, plan.inputs.ports[name])
    propagate_initial_values(plan, start)
    for name, component in components.items():
        with calling_component(name, "exit_initialization_mode", "initialization", start):
            component.exit_initialization_mode()
            component.get_outputs()


def copy_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's start values; inputs without a connection keep them."""
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.scalar_names)
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)


def propagate_initial_values(plan: Plan, time: float) -> None:
    """Pass outputs to inputs repeatedly until no value changes; without algebraic loops one iteration per component suffices.

    Args:
        plan: its components must be in initialization mode.
        time: start time (s), for messages.

    Raises:
        ComponentError: a component failed, or an algebraic loop did not converge.
    """
    transfers = [compile_transfer(transfer) for phase in plan.all_phases for transfer in phase.transfers]
    components, inputs, outputs = plan.system.components, plan.inputs.ports, plan.outputs.ports
    last_inputs: dict[str, PortValues] = {}
    last_outputs = {name: _copy_values(outputs[name]) for name in components}
    for iteration in range(len(components) + 1 + EXTRA_ITERATIONS):
        for transfer in transfers:
            transfer()
        tolerance = TOLERANCE if iteration > len(components) else 0.0
        changing: list[Endpoint] = []
        for name, component in components.items():
            now = _copy_values(inputs[name])
            if name in last_inputs and not _changed_scalars(inputs[name], last_inputs[name], now):
                continue
            with calling_component(name, "set_inputs and get_outputs", "initialization", time):
                component.set_inputs()
                component.get_outputs()
            before, last_inputs[name], last_outputs[name] = last_outputs[name], now, _copy_values(outputs[name])
            changing += [Endpoint(name, s) for s in _changed_scalars(outputs[name], before, last_outputs[name], tolerance)]
        if not changing:
            return
    names = abbreviate_names(endpoint.component for endpoint in changing)
    raise ComponentError(names, "initialization", _algebraic_loop_message(plan, changing), time)


def _copy_values(ports: Ports) -> PortValues:
    return {dtype: array.copy() for dtype, array in ports.arrays.items()}


def _changed_scalars(ports: Ports, old: PortValues, new: PortValues, tolerance: float = 0.0) -> list[str]:
    """Return the names of the scalars whose values differ; with tolerance 0, in any bit."""
    if all(_bit_pattern(old[dtype]) == _bit_pattern(new[dtype]) for dtype in new):
        return []
    changed = {dtype: iter(_changed_elements(old[dtype], new[dtype], tolerance).tolist()) for dtype in new}
    return [name for variable in ports.variables for name in variable.scalar_names if next(changed[variable.dtype])]


def _changed_elements(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    if old.dtype.hasobject:
        return np.asarray(old != new)
    if old.dtype.kind == "f" and tolerance:
        return exceeds_tolerance(old, new, tolerance)
    bits = f"u{old.dtype.itemsize}"
    return np.asarray(old.view(bits) != new.view(bits))


def _bit_pattern(array: np.ndarray) -> object:
    return array.tolist() if array.dtype.hasobject else array.tobytes()


def _algebraic_loop_message(plan: Plan, changing: Sequence[Endpoint]) -> str:
    connections = [f"{c.source} -> {c.target}" for c in plan.system.connections if c.source in changing]
    iterations = len(plan.system.components) + EXTRA_ITERATIONS
    return (
        f"an algebraic loop does not converge in {iterations} iterations: {abbreviate_names(connections)};"
        " remove the direct feedthrough of one component in the loop, or reduce the loop gain below 1"
    )
