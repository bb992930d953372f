"""Processor time of controllers per step.

It is measured in turns, so that other load of the machine affects all controllers equally.
"""

import logging
import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from ...api import Simulation, load
from ...core.errors import ComponentError, CosimError, InputError
from ...core.time_grid import fraction_text
from .candidate import parse_source, scalars

#: number of turns, and of steps in each of them
ROUNDS, STEPS = 12, 500
_NAME = "controller"


@dataclass(frozen=True)
class MeasuredController:
    """Controller whose steps are measured.

    Attributes:
        source: argument of the command, such as "my.fmu".
        scenario: scenario that contains it.
        component: full name of its component there.
    """

    source: str
    scenario: Path
    component: str


def measure_step_costs(controllers: Sequence[MeasuredController], reference: str) -> list[float]:
    """Return the smallest processor time per step (s) of the reference FMU and of each controller.

    Each controller steps alone, with the inputs that it has in its scenario at a quarter of the
    time. A reference that is one of the controllers is measured once, so that its ratio is 1; any
    other one keeps the start values of its inputs. The cost of a controller that fails is NaN, with
    a warning.
    """
    entry = parse_source(reference).entry
    same = next(
        (i for i, each in enumerate(controllers) if parse_source(each.source).entry == entry), None
    )
    with ExitStack() as stack:
        alone = [
            _enter(stack, each.source, partial(_load_with_inputs, each)) for each in controllers
        ]
        if same is None:
            alone.append(_enter(stack, reference, lambda: _load_alone(reference, Fraction(1, 100))))
        sources = [*(each.source for each in controllers), reference]
        rounds = np.full((ROUNDS, len(alone)), math.nan)
        for each in rounds:
            for i, simulation in enumerate(alone):
                each[i] = _step_seconds(sources[i], simulation)
    costs = rounds.min(0).tolist()  # NaN if a round has failed
    return [costs[-1 if same is None else same], *costs[: len(controllers)]]


def _enter(stack: ExitStack, source: str, prepare: Callable[[], Simulation]) -> Simulation | None:
    """Return a prepared simulation that the stack closes; None, with a warning, if it fails."""
    try:
        return stack.enter_context(prepare())
    except CosimError as error:
        _warn(source, error)
        return None


def _warn(source: str, error: CosimError) -> None:
    logging.getLogger("cosim").warning("the cost of %s is not measured: %s", source, error)


def _load_alone(source: str, step: Fraction) -> Simulation:
    times = {
        "stop_time": fraction_text((ROUNDS * STEPS + 1) * step),
        "step_size": fraction_text(step),
    }
    components = {_NAME: dict(parse_source(source).entry)}
    return load({"name": _NAME, **times, "components": components, "record": {"signals": []}})


def _load_with_inputs(controller: MeasuredController) -> Simulation:
    with load(controller.scenario) as flight:
        grid = flight.prepared.plan.grid
        flight.step(max(1, grid.count // 4))
        alone = _load_alone(controller.source, grid.step)
        for name, component in alone.prepared.system.components.items():
            name_in_flight = f"{controller.component}{name.removeprefix(_NAME)}"
            for slot in scalars(component, ("input",)):
                with suppress(InputError):  # another part of a nested system feeds this input
                    alone.set(f"{name}.{slot}", flight.get(f"{name_in_flight}.{slot}"))
    return alone


def _step_seconds(source: str, simulation: Simulation | None) -> float:
    """Return the processor time per step (s); NaN if the simulation has failed."""
    began = time.process_time()
    try:
        if simulation is None:
            return math.nan
        simulation.step(STEPS)
    except ComponentError as error:
        _warn(source, error)
        return math.nan
    except InputError:  # it failed in an earlier round
        return math.nan
    return (time.process_time() - began) / STEPS
