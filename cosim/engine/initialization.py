"""Initialization of components up to step mode, with consistent initial values.

Outputs are passed to inputs until no value changes. Algebraic loops that do not converge so are
solved by Newton's method.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..core.component import Component, Ports
from ..core.errors import ComponentError, abbreviate_names
from ..core.graph import strong_components
from ..core.system import FLOAT_TYPES, Endpoint, System
from ..process.journal import calling_component
from .iteration import exceeds_tolerance, solve_newton
from .layout import ArrayPosition, Dtype
from .plan import Plan, all_transfers
from .transfer_plan import compile_transfer, connection_conversion


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
    for variable, array, part in ports.elements():
        if not variable.derivative_of:
            array[part] = component.get(variable.name)


#: sweeps beyond one per component before Newton's method, for loops that are contractions; relative
#: tolerance of their outputs
EXTRA_SWEEPS, TOLERANCE = 100, 1e-12
#: largest number of steps of Newton's method
MAX_NEWTON_STEPS = 50

PortValues = Mapping[Dtype, np.ndarray]


class InitialValues:
    """Values of the connected variables of a plan, whose components are in initialization mode.

    Args:
        plan: the compiled system.
        time: start time (s), for messages.
    """

    def __init__(self, plan: Plan, time: float):
        self._plan, self._time = plan, time
        self._components = plan.system.components
        self._transfers = list(map(compile_transfer, all_transfers(plan.all_phases)))
        self._last_inputs: dict[str, PortValues] = {}
        self._last_outputs = {
            name: _copy_values(plan.outputs.ports[name]) for name in self._components
        }
        #: values of the inputs that do not get those of the connected outputs
        self._held: dict[ArrayPosition, float] = {}
        #: largest absolute change of a floating-point output in the present sweep
        self._largest_change = 0.0

    def solve(self) -> None:
        """Find values with which every input has the value of its output.

        Loops by fixed point, else by Newton's method.

        Raises:
            ComponentError: a component failed, or an algebraic loop did not converge.
        """
        start = self._plan.inputs.copy_values()
        changing = self._propagate()
        if not changing:
            return
        loops = [
            loop for loop in find_loops(self._plan.system) if not set(changing).isdisjoint(loop)
        ]
        unknowns = [_Unknowns(self._plan, loop) for loop in loops]
        if not all(each.targets for each in unknowns) or not unknowns:
            self._require_settled(changing)
        self._plan.inputs.restore_values(start)
        for each in unknowns:
            self._held |= each.read_inputs()
        for each in unknowns:
            self._solve_loop(each)
        self._held = {}
        self._sweep(TOLERANCE)

    def _require_settled(self, changing: Sequence[Endpoint]) -> None:
        if changing:
            raise self._failure(
                changing, f"the outputs {abbreviate_names(map(str, changing))} do not settle"
            )

    def _propagate(self) -> list[Endpoint]:
        """Sweep until no output changes, and return the outputs that still change after all sweeps.

        In a loop of n components that is a contraction, the largest change is smaller than n sweeps
        before. If it is not, the sweeps end, because components may fail with diverging values.
        """
        changing: list[Endpoint] = []
        largest: list[float] = []
        for number in range(len(self._components) + 1 + EXTRA_SWEEPS):
            self._largest_change = 0.0
            changing = self._sweep(TOLERANCE if number > len(self._components) else 0.0)
            before = largest[-len({end.component for end in changing}) :][:1]
            largest.append(self._largest_change)
            if not changing or (
                number > len(self._components) and 0.0 < before[0] <= self._largest_change
            ):
                break
        return changing

    def _transfer(self) -> None:
        for transfer in self._transfers:
            transfer()

    def _sweep(self, tolerance: float) -> list[Endpoint]:
        """Pass all outputs to inputs once; return those that changed by more than the tolerance."""
        inputs, outputs = self._plan.inputs, self._plan.outputs.ports
        self._transfer()
        for (dtype, offset), value in self._held.items():
            inputs.arrays[dtype][offset] = value
        changing: list[Endpoint] = []
        for name in self._components:
            now = _copy_values(inputs.ports[name])
            if name in self._last_inputs and not _changed_scalars(
                inputs.ports[name], self._last_inputs[name], now
            ):
                continue
            self._evaluate(name)
            before, self._last_inputs[name] = self._last_outputs[name], now
            self._last_outputs[name] = _copy_values(outputs[name])
            self._largest_change = max(
                self._largest_change, _largest_difference(before, self._last_outputs[name])
            )
            changing += [
                Endpoint(name, s)
                for s in _changed_scalars(
                    outputs[name], before, self._last_outputs[name], tolerance
                )
            ]
        return changing

    def _evaluate(self, name: str) -> None:
        with calling_component(name, "set_inputs and get_outputs", "initialization", self._time):
            self._components[name].set_inputs()
            self._components[name].get_outputs()

    # -- algebraic loops

    def _solve_loop(self, unknowns: _Unknowns) -> None:
        """Solve one loop; the inputs of all loops are held, and earlier loops have been solved."""

        def residuals(values: np.ndarray) -> np.ndarray:
            self._held |= dict(zip(unknowns.positions, values.tolist(), strict=True))
            self._require_settled(self._propagate())
            self._transfer()
            difference: np.ndarray = unknowns.read() - values
            return difference

        self._propagate()
        start = np.array([self._held[position] for position in unknowns.positions])

        def jacobian(values: np.ndarray, found: np.ndarray) -> np.ndarray:
            columns = [self._column(unknowns, i, values, found) for i in range(len(values))]
            return np.column_stack(columns) - np.eye(len(values))

        solution = solve_newton(residuals, jacobian, start, unknowns.tolerances, MAX_NEWTON_STEPS)
        if not solution.converged:
            texts = [
                f"{end} {residual:.3g}"
                for end, residual in zip(unknowns.targets, solution.residuals, strict=True)
            ]
            raise self._failure(
                unknowns.targets, f"residuals after Newton's method: {abbreviate_names(texts)}"
            )
        self._held |= dict(zip(unknowns.positions, solution.values.tolist(), strict=True))

    def _column(
        self, unknowns: _Unknowns, i: int, values: np.ndarray, found: np.ndarray
    ) -> np.ndarray:
        """Return the derivatives of what all inputs receive with respect to input `i`."""
        name, position = unknowns.targets[i].component, unknowns.positions[i]
        if (exact := self._exact_column(unknowns, i)) is not None:
            return exact
        array = self._plan.inputs.arrays[position.dtype]
        unknowns.write(values)
        array[position.offset] += np.sqrt(np.finfo(position.dtype).eps) * (1.0 + abs(values[i]))
        difference = float(array[position.offset]) - values[i]
        self._evaluate(name)
        self._transfer()
        column = (unknowns.read() - (found + values)) / difference
        unknowns.write(values)
        self._evaluate(name)
        return np.asarray(column)

    def _exact_column(self, unknowns: _Unknowns, i: int) -> np.ndarray | None:
        """Return the column by directional derivatives; None if the component offers none."""
        target = unknowns.targets[i]
        sources = unknowns.sources_of(target.component)
        with calling_component(
            target.component, "get_directional_derivative", "initialization", self._time
        ):
            derivatives = self._components[target.component].get_directional_derivative(
                sources, target.scalar
            )
        return (
            None
            if derivatives is None
            else unknowns.received(target.component, dict(zip(sources, derivatives, strict=True)))
        )

    def _failure(self, ends: Sequence[Endpoint], reason: str) -> ComponentError:
        names = abbreviate_names(dict.fromkeys(end.component for end in ends))
        connections = [
            f"{c.source} -> {c.target}"
            for c in self._plan.system.connections
            if {c.source, c.target} & set(ends)
        ]
        text = f"an algebraic loop does not converge ({abbreviate_names(connections)}): {reason}"
        return ComponentError(names, "initialization", text, self._time)


class _Unknowns:
    """Floating-point inputs of an algebraic loop: positions, tolerances and connections."""

    def __init__(self, plan: Plan, loop: Sequence[Endpoint]):
        members = set(loop)
        self._plan = plan
        self._connections = [
            c for c in plan.system.connections if c.source in members and c.target in members
        ]
        inputs = dict.fromkeys(connection.target for connection in self._connections)
        self.targets = [
            end for end in inputs if plan.system.find_element(end).variable.type in FLOAT_TYPES
        ]
        self.positions = [plan.inputs.positions[end] for end in self.targets]
        self._rows = {end: i for i, end in enumerate(self.targets)}
        precisions = [np.finfo(position.dtype).eps for position in self.positions]
        self.tolerances = (
            np.maximum(TOLERANCE, 100 * np.array(precisions, np.float64))
            if precisions
            else np.zeros(0)
        )

    def read(self) -> np.ndarray:
        """Return the present values of the inputs in memory."""
        return np.array(
            [self._plan.inputs.arrays[dtype][offset] for dtype, offset in self.positions],
            np.float64,
        )

    def write(self, values: np.ndarray) -> None:
        """Write values of the inputs to memory."""
        for (dtype, offset), value in zip(self.positions, values.tolist(), strict=True):
            self._plan.inputs.arrays[dtype][offset] = value

    def read_inputs(self) -> dict[ArrayPosition, float]:
        """Return the present values by position."""
        return dict(zip(self.positions, self.read().tolist(), strict=True))

    def sources_of(self, component: str) -> list[str]:
        """Return the outputs of a component in the loop."""
        return list(
            dict.fromkeys(
                c.source.scalar for c in self._connections if c.source.component == component
            )
        )

    def received(self, component: str, values: Mapping[str, float]) -> np.ndarray:
        """Return the part of the inputs' values that is proportional to outputs of a component."""
        result = np.zeros(len(self.targets))
        for connection in self._connections:
            if connection.source.component == component and connection.target in self._rows:
                factor, _ = connection_conversion(self._plan.system, connection)
                result[self._rows[connection.target]] += factor * values[connection.source.scalar]
        return result


def find_loops(system: System) -> list[list[Endpoint]]:
    """Return inputs and outputs of each algebraic loop of the initialization, upstream loops first.

    Outputs without declared dependencies may depend on every input of their component.
    """
    successors: dict[Endpoint, list[Endpoint]] = {}
    for connection in system.connections:
        successors.setdefault(connection.source, []).append(connection.target)
        successors.setdefault(connection.target, [])
    outputs: dict[str, list[str]] = {}
    for connection in {c.source: c for c in system.connections}.values():
        outputs.setdefault(connection.source.component, []).append(connection.source.scalar)
    for end in {connection.target for connection in system.connections}:
        component = system.components[end.component]
        successors[end] = [
            Endpoint(end.component, scalar)
            for scalar in outputs.get(end.component, ())
            if depends_on(
                system, component.initial_dependencies, Endpoint(end.component, scalar), end
            )
        ]
    return [loop for loop in reversed(strong_components(successors)) if len(loop) > 1]


def depends_on(
    system: System, dependencies: Mapping[str, frozenset[str]], output: Endpoint, end: Endpoint
) -> bool:
    """Return whether an output may depend on an input by the declared dependencies."""
    known = dependencies.get(system.find_element(output).variable.name)
    return known is None or system.find_element(end).variable.name in known


def _copy_values(ports: Ports) -> PortValues:
    return {dtype: array.copy() for dtype, array in ports.arrays.items()}


def _changed_scalars(
    ports: Ports, old: PortValues, new: PortValues, tolerance: float = 0.0
) -> list[str]:
    """Return the names of the scalars whose values differ; with tolerance 0, in any bit."""
    if all(_bit_pattern(old[dtype]) == _bit_pattern(new[dtype]) for dtype in new):
        return []
    changed = {
        dtype: iter(_changed_elements(old[dtype], new[dtype], tolerance).tolist()) for dtype in new
    }
    names: list[str] = []
    for variable in ports.variables:
        names += [name for name in variable.scalar_names if next(changed[variable.dtype])]
    return names


def _changed_elements(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    if old.dtype.hasobject:
        return np.asarray(old != new)
    if old.dtype.kind == "f" and tolerance:
        return exceeds_tolerance(old, new, tolerance)
    bits = f"u{old.dtype.itemsize}"
    return np.asarray(old.view(bits) != new.view(bits))


def _largest_difference(old: PortValues, new: PortValues) -> float:
    floats = [dtype for dtype, values in new.items() if dtype.kind == "f" and len(values)]
    with np.errstate(invalid="ignore"):
        return max((float(np.abs(new[dtype] - old[dtype]).max()) for dtype in floats), default=0.0)


def _bit_pattern(array: np.ndarray) -> object:
    return array.tolist() if array.dtype.hasobject else array.tobytes()
