"""Initialization of components up to step mode."""

from __future__ import annotations

from ..core.component import Component, Ports
from ..process.journal import calling_component
from .initial_values import InitialValues
from .plan import Plan


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
    """Bring instantiated components to step mode.

    Start values, initialization mode, consistent initial outputs.

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
    InitialValues(plan, start).solve()
    for name, component in components.items():
        with calling_component(name, "exit_initialization_mode", "initialization", start):
            component.exit_initialization_mode()
            component.get_outputs()


def copy_start_values(component: Component, ports: Ports) -> None:
    """Fill the bound inputs with the component's start values.

    Inputs without a connection keep them.
    """
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        begin = filled[variable.dtype]
        filled[variable.dtype] += len(variable.scalar_names)
        if variable.derivative_of:
            continue
        ports.arrays[variable.dtype][begin : filled[variable.dtype]] = component.get(variable.name)
