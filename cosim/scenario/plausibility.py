"""Warnings about probable mistakes in a scenario that can run nevertheless."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from ..components.fmi import FmuDescription
from ..components.fmi.changed_sources import changed_sources_warning
from ..core.component import scalars_of
from ..core.errors import Problem, abbreviate_names
from ..core.paths import is_file
from ..core.system import Endpoint
from ..engine.transfer_plan import unit_conversion
from .input_limits import set_excesses
from .missing_connections import VariablesByEndpoint, find_missing_connections

if TYPE_CHECKING:
    from .prepared_run import PreparedRun

#: ratio of the step of a component to the one that its FMU recommends, from which on results may be
#: wrong
_MAX_STEP_RATIO = 5


def find_warnings(prepared: PreparedRun) -> list[Problem]:
    """Return all warnings about a prepared run, each with its location in the scenario file."""
    return [
        *find_run_warnings(prepared),
        *set_excesses(prepared).values(),
        *_missing_reference(prepared),
    ]


def find_run_warnings(prepared: PreparedRun) -> Iterator[Problem]:
    """Yield the warnings that concern the results.

    Functions left out, late times, connections, steps, FMUs.
    """
    if left_out := prepared.left_out:
        yield replace(left_out[0], message="; ".join(problem.message for problem in left_out))
    yield from _late_events(prepared)
    yield from _late_kpis(prepared)
    if prepared.plan.end_warning:
        yield Problem(prepared.plan.end_warning, prepared.root.where("stop_time"))
    root, unconnected = prepared.root, unconnected_inputs(prepared)
    for name, text in find_missing_connections(root, prepared.system, unconnected):
        yield Problem(text, root.where_component(name) or root.where("connections"))
    yield from _double_conversions(prepared)
    yield from _large_steps(prepared)
    for file in prepared.component_factory.fmus.values():
        if file.run_warning:
            yield Problem(file.run_warning)
        if changed := changed_sources_warning(file):
            yield Problem(changed)


def _double_conversions(prepared: PreparedRun) -> Iterator[Problem]:
    """Yield a warning for each gain that repeats the conversion of units of its connection."""
    system = prepared.system
    for connection in system.connections:
        source, target = (
            system.find_element(end).variable for end in (connection.source, connection.target)
        )
        factor, _ = unit_conversion(source, target)
        if (
            factor != 1.0
            and math.isclose(abs(connection.gain), factor, rel_tol=1e-3)
            and source.unit
            and target.unit
        ):
            sign = "-1" if connection.gain < 0 else "1"
            text = (
                f"{connection.source} -> {connection.target}: {source.unit.name} is converted to "
                f"{target.unit.name}, and then "
                f"multiplied by the gain {connection.gain:g}: is the gain {sign} meant?"
            )
            yield Problem(text, prepared.root.where("connections"))


def unconnected_inputs(prepared: PreparedRun) -> VariablesByEndpoint:
    """Return the inputs that no connection, start value or event sets, with their variables."""
    system = prepared.system
    connected = {connection.target for connection in system.connections}
    changes = [system.start_values, *(event.values for event in prepared.plan.settings.events)]
    assigned: set[tuple[str, str]] = set()
    for values in changes:
        for component, own in values.items():
            assigned.update((component, name) for name in own)
    unconnected: VariablesByEndpoint = {}
    for name, each in system.components.items():
        for scalar, variable in scalars_of(each.variables, "input").items():
            end = Endpoint(name, scalar)
            if end not in connected and (name, variable.name) not in assigned:
                unconnected[end] = variable
    return unconnected


def _large_steps(prepared: PreparedRun) -> Iterator[Problem]:
    """Yield a warning for each step much longer than FMUs recommend (FMI: DefaultExperiment).

    FMUs for Model Exchange are left out, because their solver has a step of its own.
    """
    system, macro_step = prepared.system, prepared.plan.settings.step_size
    groups: dict[Fraction, dict[str, Fraction]] = defaultdict(dict)
    for name, component in system.components.items():
        description = getattr(component, "description", None)
        if isinstance(description, FmuDescription) and description.interface != "model-exchange":
            step, recommended = (
                system.periods.get(name, macro_step),
                description.default_experiment.step_size,
            )
            if recommended and step >= _MAX_STEP_RATIO * recommended:
                groups[step][name] = recommended
    for step, sizes in groups.items():
        names = sorted(sizes, key=sizes.__getitem__)
        size, source = sizes[names[0]], prepared.sources[names[0]].rpartition("/")[2]
        verb = "step" if len(names) > 1 else "steps"
        fault = (
            f"{abbreviate_names(names, 3)} {verb} every {float(step):g} s, "
            f"{float(step / size):.3g} times the {float(size):g} s"
        )
        text = (
            f"{fault} that {source} recommends: the results may be wrong, use about "
            f"{float(size):g} s"
        )
        has_period = names[0] in system.periods
        where = prepared.root.where_component(names[0], "period") if has_period else ""
        yield Problem(text, where or prepared.root.where("step_size"))


def _missing_reference(prepared: PreparedRun) -> Iterator[Problem]:
    reference = prepared.spec.reference
    if reference and not is_file(prepared.root.folder / reference.file):
        text = f'file "{reference.file}" does not exist: `cosim regress --update` writes it'
        yield Problem(text, prepared.root.where("reference", "file"))


def _late_events(prepared: PreparedRun) -> Iterator[Problem]:
    stop = prepared.plan.settings.stop_time
    for event in prepared.plan.settings.events:
        if event.time > stop:
            text = (
                f"this event does not happen: {float(event.time):g} s is after the stop time "
                f"{float(stop):g} s"
            )
            yield Problem(text, event.where)


def _late_kpis(prepared: PreparedRun) -> Iterator[Problem]:
    """Yield a warning for every KPI whose argument `start` (s) is after the end of the run."""
    stop = prepared.plan.settings.stop_time
    for kpi in prepared.spec.kpis:
        start = kpi.arguments.get("start")
        if isinstance(start, int | float) and start > stop:
            text = (
                f'KPI "{kpi.name}" starts at {float(start):g} s, after the stop time '
                f"{float(stop):g} s, and may have no value"
            )
            yield Problem(
                text,
                prepared.root.where("kpis", prepared.index_of_kpi(kpi.name), "arguments", "start"),
            )
