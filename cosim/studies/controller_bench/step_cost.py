"""Processor time of controllers per step, measured in turns, so that other load of the machine affects all of them equally."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from ...api import Simulation, load
from ...core.errors import InputError
from ...core.time_grid import fraction_text
from .candidate import parse_source

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
    """Return the smallest processor time per step (s) of the reference, an FMU, and of each controller.

    Each controller steps alone, with the inputs that it has in its scenario at a quarter of the time. A reference that is one of
    the controllers is measured once, so that its ratio is 1; any other one keeps the start values of its inputs.
    """
    entry = parse_source(reference).entry
    same = next((i for i, each in enumerate(controllers) if parse_source(each.source).entry == entry), None)
    with ExitStack() as stack:
        alone = [stack.enter_context(_load_with_inputs(each)) for each in controllers]
        alone += [stack.enter_context(_load_alone(reference, Fraction(1, 100)))] if same is None else []
        rounds = [[_step_seconds(each) for each in alone] for _ in range(ROUNDS)]
    costs = [min(column) for column in zip(*rounds, strict=True)]
    return [costs[-1 if same is None else same], *costs[: len(controllers)]]


def _load_alone(source: str, step: Fraction) -> Simulation:
    times = {"stop_time": fraction_text((ROUNDS * STEPS + 1) * step), "step_size": fraction_text(step)}
    components = {_NAME: dict(parse_source(source).entry)}
    return load({"name": _NAME, **times, "components": components, "record": {"signals": []}})


def _load_with_inputs(controller: MeasuredController) -> Simulation:
    with load(controller.scenario) as flight:
        grid = flight.prepared.plan.grid
        flight.step(max(1, grid.count // 4))
        alone = _load_alone(controller.source, grid.step)
        for name, component in alone.prepared.system.components.items():
            for slot in (slot for v in component.variables if v.causality == "input" for slot in v.scalar_names):
                with suppress(InputError):  # another part of a nested system feeds this input
                    alone.set(f"{name}.{slot}", flight.get(f"{controller.component}{name.removeprefix(_NAME)}.{slot}"))
    return alone


def _step_seconds(simulation: Simulation) -> float:
    began = time.process_time()
    simulation.step(STEPS)
    return (time.process_time() - began) / STEPS
