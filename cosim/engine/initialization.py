"""Initialization mode: outputs go to inputs until they agree."""

from __future__ import annotations

from ..component import Component, Ports
from ..errors import ComponentError
from ..journal import calling
from .moves import copy
from .plan import Plan


def propagate(plan: Plan, time: float) -> None:
    """Hand outputs to inputs again and again until nothing changes, at most once per component.

    Raises ComponentError for an algebraic loop that does not settle.
    """
    moves = [copy(gather) for phase in plan.all_phases for gather in phase.gathers]
    components, inputs, outputs = plan.system.components, plan.inputs.ports, plan.signals.ports
    given: dict[str, object] = dict.fromkeys(components)
    found = {name: _contents(outputs[name]) for name in components}
    for _ in range(len(components) + 1):
        for move in moves:
            move()
        fed = {name: now for name in components if (now := _contents(inputs[name])) != given[name]}
        for name in fed:
            with calling(name, "set_inputs and get_outputs", "initialization", time):
                components[name].set_inputs()
                components[name].get_outputs()
        changed = {name: now for name in fed if (now := _contents(outputs[name])) != found[name]}
        if not changed:
            return
        given |= fed
        found |= changed
    reason = f"the outputs still change after {len(components)} rounds: an algebraic loop"
    raise ComponentError(" -> ".join(changed), "initialization", reason, time)


def _contents(ports: Ports) -> list[object]:
    """What stands in the arrays, bit for bit."""
    return [array.tolist() if array.dtype.hasobject else array.tobytes() for array in ports.arrays.values()]


def take_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's own values, which those keep that no connection feeds."""
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.slots)
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)
