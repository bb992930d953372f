"""Iteration of macro steps by fixed point or Newton's method, from the same saved state.

All components of a loop step from the same state in every iteration. Their inputs are the outputs
of the previous iteration, or of this iteration if the source is in an earlier stage. After
convergence the inputs belong to the end of the macro step.

Fixed point: repeat until no connected output changes by more than the tolerance. It converges if
the loop is a contraction, such as for short steps. Newton: the unknowns are the connected outputs
y; the residuals are the outputs G(y) of one repetition minus y. The Jacobian is formed by forward
differences, so each step costs one repetition per unknown, but loops that are no contraction
converge too. A step that does not reduce the residuals is halved (damped Newton).
"""

from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from itertools import compress
from typing import Any, NamedTuple

import numpy as np

from ..core.component import Component
from ..core.errors import ComponentError, abbreviate_names
from ..process.journal import calling_component
from .layout import Dtype, Layout
from .plan import Loop, ScheduledStep
from .transfer_plan import TransferCall


class IterationPhase(NamedTuple):
    """A phase of a loop; delayed transfers run in the first iteration of a macro step only."""

    transfers: Sequence[TransferCall]
    delayed_transfers: Sequence[TransferCall]
    steps: Sequence[ScheduledStep]


class FixedPointIteration:
    """Iteration of a loop's macro steps.

    Args:
        loop: its components and connections.
        outputs: layout of the outputs of the system.
        phases: the phases of the loop in order.
        prepare: functions that store the values at the start of the macro step.
        run_step: runs one scheduled step.
    """

    def __init__(
        self,
        loop: Loop,
        outputs: Layout,
        phases: Sequence[IterationPhase],
        prepare: Sequence[Callable[[], None]],
        run_step: Callable[[ScheduledStep], None],
    ):
        self._loop, self._phases, self._prepare, self._run_step = loop, phases, prepare, run_step
        self._components = loop.components
        sources: dict[Dtype, dict[int, str]] = defaultdict(dict)
        for connection in loop.connections:
            position = outputs.positions[connection.source]
            sources[position.dtype][position.offset] = str(connection.source)
        self._coupled_outputs = [
            (outputs.arrays[dtype], list(names)) for dtype, names in sources.items()
        ]
        self._output_names = [list(names.values()) for names in sources.values()]

    def step(self, time: float, discard_requests: Callable[[], None]) -> None:
        """Iterate the macro step that begins at `time` (s) until the connected outputs converge.

        Args:
            time: start of the macro step (s).
            discard_requests: discards the termination requests of a rejected iteration.

        Raises:
            ComponentError: a component failed, or the outputs did not converge within the allowed
                iterations.
        """
        for store_values in self._prepare:
            store_values()
        with ExitStack() as stack:
            states = {
                name: self._get_state(name, component, time, stack)
                for name, component in self._components.items()
            }
            is_first = True

            def run_round() -> list[np.ndarray]:
                """Repeat the macro step, and return the masks of the outputs that it changed."""
                nonlocal is_first
                if not is_first:
                    discard_requests()
                    for name, state in states.items():
                        with calling_component(name, "set_state", "step", time):
                            self._components[name].set_state(state)
                before = self._output_values()
                for transfers, delayed_transfers, steps in self._phases:
                    for transfer in (*transfers, *delayed_transfers) if is_first else transfers:
                        transfer()
                    for step in steps:
                        self._run_step(step)
                is_first = False
                return [
                    self._changed(old, new)
                    for old, new in zip(before, self._output_values(), strict=True)
                ]

            if self._loop.iteration.method == "newton":
                self._solve_by_newton(run_round)
            for _ in range(self._loop.iteration.max_rounds):
                changed = run_round()
                if not any(mask.any() for mask in changed):
                    return
        raise ComponentError(self._loop.name, "iteration", self._divergence_message(changed), time)

    def _solve_by_newton(self, run_round: Callable[[], object]) -> None:
        """Store the solution for the outputs that are floating-point numbers.

        All others have the values of the round before.
        """
        floats = [
            (array, offsets) for array, offsets in self._coupled_outputs if array.dtype.kind == "f"
        ]

        def read() -> np.ndarray:
            return np.concatenate([array[offsets].astype(np.float64) for array, offsets in floats])

        def write(values: np.ndarray) -> None:
            parts = np.split(values, np.cumsum([len(offsets) for _, offsets in floats])[:-1])
            for (array, offsets), part in zip(floats, parts, strict=True):
                array[offsets] = part

        def residuals(values: np.ndarray) -> np.ndarray:
            write(values)
            run_round()
            difference: np.ndarray = read() - values
            return difference

        if floats:
            iteration = self._loop.iteration
            start = read()
            if len(floats) < len(self._coupled_outputs):
                # the Jacobian's differences need the integers and texts that belong to these values
                residuals(start)
            jacobian = difference_jacobian(residuals)
            write(
                solve_newton(
                    residuals, jacobian, start, iteration.tolerance, iteration.max_rounds
                ).values
            )

    def _get_state(self, name: str, component: Component, time: float, stack: ExitStack) -> Any:
        """Return the component's state, which is freed when `stack` is closed."""
        with calling_component(name, "get_state", "step", time):
            state = component.get_state()

        def free() -> None:
            with calling_component(name, "free_state", "step", time):
                component.free_state(state)

        stack.callback(free)
        return state

    def _output_values(self) -> list[np.ndarray]:
        return [array[offsets] for array, offsets in self._coupled_outputs]

    def _changed(self, old: np.ndarray, new: np.ndarray) -> np.ndarray:
        if old.dtype.kind != "f":
            return np.asarray(old != new)
        return exceeds_tolerance(old, new, self._loop.iteration.tolerance)

    def _divergence_message(self, changed: Sequence[np.ndarray]) -> str:
        changing: list[str] = []
        for names, mask in zip(self._output_names, changed, strict=True):
            changing += compress(names, mask)
        iteration = self._loop.iteration
        return (
            f"no convergence after {iteration.max_rounds} iterations; outputs that still change "
            "by more than "
            f"{iteration.tolerance:g}: {abbreviate_names(changing)}"
        )


def exceeds_tolerance(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    """Return a Boolean mask of the floats that changed by more than `tolerance * (1 + abs(new))`.

    A value that is NaN or infinite always counts as changed.
    """
    with np.errstate(invalid="ignore"):
        changed: np.ndarray = ~(np.abs(new - old) <= tolerance * (1 + np.abs(new)))
    return changed


#: largest number of halvings of one step
MAX_HALVINGS = 20
#: a solution at which the residuals cannot be reduced is accepted if they are at most this many
#: times the tolerance
ACCEPTED_MULTIPLE = 1000.0


class NewtonSolution(NamedTuple):
    """Last values and their residuals, each of shape (n,)."""

    values: np.ndarray
    residuals: np.ndarray
    converged: bool


def solve_newton(
    residuals: Callable[[np.ndarray], np.ndarray],
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray],
    start: np.ndarray,
    tolerance: np.ndarray | float,
    limit: int,
) -> NewtonSolution:
    """Solve residuals(values) = 0; a step that does not reduce the residuals is halved.

    Args:
        residuals: Function of the values.
        jacobian: Derivative of the residuals, shape (n, n), from values and residuals.
        start: First values, shape (n,).
        tolerance: The values v are a solution if each residual is at most tolerance * (1 + |v|).
        limit: Largest number of steps.
    """
    values, found = start, residuals(start)
    scale = 1.0 + np.abs(start)
    for _ in range(limit):
        if _are_small(found, values, tolerance):
            return NewtonSolution(values, found, True)
        matrix = jacobian(values, found)
        if not (np.isfinite(matrix).all() and np.isfinite(found).all()):
            break
        step = np.linalg.lstsq(matrix, -found, rcond=None)[0]
        for _ in range(MAX_HALVINGS):
            trial = values + step
            new = residuals(trial)
            if np.linalg.norm(new / scale) < np.linalg.norm(found / scale):
                break
            step = step / 2
        else:
            break
        values, found = trial, new
    return NewtonSolution(values, found, _are_small(found, values, ACCEPTED_MULTIPLE * tolerance))


def difference_jacobian(
    residuals: Callable[[np.ndarray], np.ndarray],
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return the Jacobian of a function by forward differences, as `solve_newton` needs it."""

    def jacobian(values: np.ndarray, found: np.ndarray) -> np.ndarray:
        columns = []
        for i, step in enumerate(np.sqrt(np.finfo(np.float64).eps) * (1.0 + np.abs(values))):
            moved = values.copy()
            moved[i] += step
            columns.append((residuals(moved) - found) / (moved[i] - values[i]))
        return np.column_stack(columns)

    return jacobian


def _are_small(residuals: np.ndarray, values: np.ndarray, tolerance: np.ndarray | float) -> bool:
    return bool((np.abs(residuals) <= tolerance * (1.0 + np.abs(values))).all())
