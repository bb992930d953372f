"""Access to the variables of a simulation by their names."""

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

from ..core.component import Variable
from ..core.errors import InputError, Problem, did_you_mean
from ..core.system import Endpoint
from ..engine.layout import Layout
from ..engine.plan_run import PlanRun
from ..engine.run_checks import not_settable_reason
from ..scenario import PreparedRun
from ..scenario.name_resolution import (
    Target,
    UnknownNameError,
    check_assignment,
    resolve_name,
    vector_names,
)
from .arguments import expect

#: returns the present value of a variable of the run
Reader = Callable[[PlanRun], Any]


class _RealList(NamedTuple):
    """Real scalars that a list sets, with their limits, which were found settable before."""

    component: str
    names: Sequence[str]
    is_array: bool
    limits: Sequence[tuple[float, float]]

    def accepts(self, value: Any) -> bool:
        """Return whether a value is a list of as many numbers within the limits."""
        if value.__class__ is not list or len(value) != len(self.limits):
            return False
        for number, (low, high) in zip(value, self.limits, strict=True):
            if number.__class__ is not float or not low <= number <= high:
                return False
        return True

    def values(self, value: list[float]) -> dict[str, Any]:
        """Return the values by the names of the variables."""
        if self.is_array:
            return {self.names[0]: list(value)}
        return dict(zip(self.names, value, strict=True))


class VariableAccess:
    """Reads and sets variables by name; each name is resolved once."""

    def __init__(self, prepared: PreparedRun):
        self._prepared, self._system, self._plan = prepared, prepared.system, prepared.plan
        self._readers: dict[str, Reader] = {}
        self._targets: dict[str, list[Target]] = {}
        self._variables: dict[str, Mapping[str, Variable]] = {}
        self._real_lists: dict[str, _RealList] = {}
        self._connected = {connection.target for connection in self._system.connections}

    def get(self, name: str, run: PlanRun) -> Any:
        """Return the value of a variable; see `Simulation.get`."""
        try:
            reader = self._readers[name]
        except (KeyError, TypeError):
            expect("name", name, isinstance(name, str), "the name of a variable")
            reader = self._readers[name] = self._make_reader(self._find_signal(name))
        return reader(run)

    def set(self, name: str, value: Any, run: PlanRun) -> None:
        """Set a variable; see `Simulation.set`."""
        expect("name", name, isinstance(name, str), "the name of a variable")
        value = value.tolist() if hasattr(value, "tolist") else value
        known = self._real_lists.get(name)
        if known and known.accepts(value):
            run.set_in_next_step(known.component, known.values(value))
            return
        if name not in self._targets:
            self._targets[name] = self._resolve(name, ("parameters", "inputs"))
        for target in self._targets[name]:
            component, variables = target.component, self._variables_of(target.component)
            read = partial(self._read_now, run, component)
            try:
                values = check_assignment(component, variables, target.prefix, value, True, read)
            except (UnknownNameError, ValueError) as error:
                raise InputError(Problem(str(error), f'set("{name}")')) from None
            for variable in values:
                if reason := not_settable_reason(component, variables[variable], self._connected):
                    text = f"{reason}, it cannot be set during the simulation"
                    if "connection" not in reason:
                        text += "; load() and reset() take start values as `parameters`"
                    raise InputError(Problem(text, f'set("{name}")'))
            run.set_in_next_step(component, values)
            if len(self._targets[name]) == 1 and isinstance(value, list):
                self._remember_reals(name, component, [variables[each] for each in values])

    def _read_now(self, run: PlanRun, component: str, variable: str) -> Any:
        """Return the value of a variable after all values that were set before."""
        with run.accessing(component, "get"):
            return self._system.components[component].get(variable)

    def _remember_reals(self, name: str, component: str, variables: Sequence[Variable]) -> None:
        """Remember real variables, or an array of them, which a list of numbers has set."""
        array = variables[0] if len(variables) == 1 and len(variables[0].shape) == 1 else None
        if any(each.type != "Float64" or (each.shape and each is not array) for each in variables):
            return
        limits = []
        for each in variables:
            low = -sys.float_info.max if each.minimum is None else each.minimum
            high = sys.float_info.max if each.maximum is None else each.maximum
            limits += [(low, high)] * len(each.scalar_names)
        names = [each.name for each in variables]
        self._real_lists[name] = _RealList(component, names, array is not None, limits)

    def _variables_of(self, component: str) -> Mapping[str, Variable]:
        if component not in self._variables:
            self._variables[component] = {
                variable.name: variable for variable in self._system.components[component].variables
            }
        return self._variables[component]

    def _resolve(self, name: str, ports: tuple[str, ...]) -> list[Target]:
        try:
            return resolve_name(self._prepared.root, name, ports, include_inner=True)
        except UnknownNameError as error:
            raise InputError(f'no variable "{name}": {error}') from None

    def _find_signal(self, name: str) -> Target:
        """Return the component of a signal, and the name of its variable."""
        parts = name.split(".")
        for count in range(len(parts) - 1, 0, -1):
            if (component := ".".join(parts[:count])) in self._system.components:
                return Target(component, ".".join(parts[count:]))
        if name in self._system.aliases:
            return Target(*self._system.aliases[name])
        return self._resolve(name, ("outputs", "inputs", "parameters"))[0]

    def _make_reader(self, target: Target) -> Reader:
        component, text = target
        elements = self._system.slots[component]
        if text in elements:
            return self._make_scalar_reader(Endpoint(component, text))
        variables = self._variables_of(component)
        variable = variables.get(text)
        names = (
            variable.scalar_names
            if variable
            else [slot for slot in elements if slot.startswith(f"{text}[")]
        )
        names = names or vector_names(variables, text)
        if not names and (below := [slot for slot in elements if slot.startswith(f"{text}.")]):
            raise InputError(
                f'"{component}.{text}" is a prefix, expected a variable such as '
                f'"{component}.{below[0]}"'
            )
        if not names:
            raise InputError(
                f'component "{component}" has no variable "{text}"{did_you_mean(text, elements)}'
            )
        readers = [self._make_scalar_reader(Endpoint(component, slot)) for slot in names]
        return lambda run: [read(run) for read in readers]

    def _make_scalar_reader(self, endpoint: Endpoint) -> Reader:
        variable, element = self._system.find_element(endpoint)
        if endpoint in self._plan.outputs.positions:
            return _make_array_reader(self._plan.outputs, endpoint, variable)
        if endpoint in self._connected:
            return _make_array_reader(self._plan.inputs, endpoint, variable)
        component = self._system.components[endpoint.component]

        def call_component(run: PlanRun) -> Any:
            with run.accessing(endpoint.component, "get"):
                value = component.get(variable.name)
            return value[element] if variable.shape else value

        return call_component


def _make_array_reader(layout: Layout, endpoint: Endpoint, variable: Variable) -> Reader:
    """Return a reader of a value in the arrays of the engine, without a call of the component."""
    dtype, offset = layout.positions[endpoint]
    read = layout.arrays[dtype].item
    return (
        (lambda _: bool(read(offset))) if variable.type == "Boolean" else (lambda _: read(offset))
    )
