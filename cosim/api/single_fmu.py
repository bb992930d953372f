"""Simulation of a single FMU."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..components.fmi import FmuFile, Isolation, create_component
from ..components.input_table import InputTable, read_input_table
from ..core import component_log
from ..core.component import Component
from ..core.csv_text import read_rows
from ..core.errors import ComponentError, InputError, Problem, did_you_mean
from ..core.system import Connection, Endpoint, System
from ..core.time_grid import exact_fraction
from ..engine.plan import Plan, compile_plan
from ..engine.plan_run import free_components
from ..engine.run_loop import simulating
from ..engine.settings import Settings
from ..process.float_mode import default_float_mode
from ..process.process_state import exclusive_process_state
from ..results import Result
from ..results.non_finite import warn_non_finite
from ..scenario.name_resolution import UnknownNameError, check_assignment
from .arguments import check_names, expect

#: names of the components
FMU_NAME, PROFILE_NAME = "fmu", "profile"

#: times and values of inputs: a CSV file, or columns by name, the first one "time" (dict, pandas DataFrame, structured array)
InputValues = str | Path | Mapping[str, Any] | np.ndarray


def simulate(
    fmu: str | Path,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
    input: InputValues | None = None,
    start_values: Mapping[str, Any] | None = None,
    output: Sequence[str] | None = None,
    isolation: Literal["fmu", "none"] = "none",
) -> Result:
    """Simulate one FMU for Co-Simulation (FMI 2.0 or 3.0), from the start time of its default experiment.

    Args:
        fmu: Path of the FMU.
        stop_time: Stop time (s), a number or a fraction such as "1/3"; None: that of the default experiment, else 1 s later.
        step_size: Communication step size (s); None: that of the default experiment, else a hundredth of the duration.
        input: Values of inputs over time, interpolated linearly: a CSV file, or columns by name as a dict, a pandas DataFrame or
            a structured array. The column "time" is in s.
        start_values: Parameters and start values by the names of the variables.
        output: Names of the recorded variables; None: all outputs.
        isolation: "fmu" runs the FMU in a separate process.

    Returns:
        The recorded variables by their names.

    Raises:
        InputError: The FMU cannot be simulated, or an argument is of a wrong type.
        ComponentError: The FMU failed; the attribute `result` of the error holds what was recorded until then.
    """
    expect("fmu", fmu, isinstance(fmu, str | os.PathLike), "the path of an FMU")
    check_names("start_values", start_values)
    names = [output] if isinstance(output, str) else output
    accepted = names is None or (isinstance(names, Sequence) and all(isinstance(name, str) for name in names))
    expect("output", output, accepted, "a list of names")
    expect("isolation", isolation, isolation in ("fmu", "none"), "'fmu' or 'none'")
    setup = Isolation() if isolation == "fmu" else None
    plan, warning = compile_fmu(Path(fmu), stop_time, step_size, input, start_values or {}, names, setup)
    if warning:
        component_log.log_message(FMU_NAME, component_log.WARNING, warning)
    result = None
    try:
        with simulating(plan) as run:
            about = {"name": Path(fmu).stem, "non_finite": warn_non_finite(run.recording), "macro_steps": run.macro_steps}
            ended = {"component": run.termination.component, "time": run.termination.time} if run.termination else None
            result = Result(run.recording, timing=dict(run.timing), metadata={**about, "terminated_by": ended})
            if run.failure:
                raise run.failure
    except (ComponentError, KeyboardInterrupt) as error:
        vars(error)["result"] = result
        raise
    return result


@default_float_mode()
@exclusive_process_state()
def compile_fmu(
    fmu: Path,
    stop_time: float | str | None,
    step_size: float | str | None,
    input_values: InputValues | None,
    start_values: Mapping[str, Any],
    output: Sequence[str] | None,
    isolation: Isolation | None,
) -> tuple[Plan, str]:
    """Compile the system of an FMU, and of the table of its inputs if there is one.

    Args:
        fmu: The FMU.
        stop_time: See `simulate`.
        step_size: See `simulate`.
        input_values: See `simulate`.
        start_values: See `simulate`.
        output: See `simulate`.
        isolation: Settings of a worker process for the FMU; None runs the FMU in this process.

    Returns:
        The plan, and a warning about the FMU, or "".

    Raises:
        InputError: The FMU cannot be simulated in this way.
    """
    file = FmuFile(fmu)
    experiment = file.description.default_experiment
    start = experiment.start_time or Fraction(0)
    stop = experiment.stop_time or start + 1 if stop_time is None else _seconds("stop_time", stop_time)
    step = experiment.step_size or (stop - start) / 100 if step_size is None else _seconds("step_size", step_size)
    component = create_component(file, file.description.model_name, isolation=isolation)
    components: dict[str, Component] = {FMU_NAME: component}
    try:
        connections, stages = [], [(FMU_NAME,)]
        if input_values is not None:
            components[PROFILE_NAME] = profile = _read_inputs(input_values, component)
            stages.append((PROFILE_NAME,))
            connections = [Connection(Endpoint(PROFILE_NAME, v.name), Endpoint(FMU_NAME, v.name)) for v in profile.variables]
        assigned = _check_start_values(component, start_values)
        columns = {name: Endpoint(FMU_NAME, name) for name in _recorded_names(component, output)}
        system = System(components, connections, stages, start_values={FMU_NAME: assigned})
        return compile_plan(system, Settings(start, stop, step, columns)), file.run_warning
    except BaseException:
        free_components(components)
        raise


def _recorded_names(component: Component, output: Sequence[str] | None) -> list[str]:
    scalars = {scalar: variable for variable in component.variables for scalar in variable.scalar_names}
    if output is None:
        return [scalar for scalar, variable in scalars.items() if variable.causality == "output"]
    arrays = {variable.name: variable.scalar_names for variable in component.variables}
    if unknown := [name for name in output if name not in scalars and name not in arrays]:
        raise InputError(Problem(f'the FMU has no variable "{name}"{did_you_mean(name, scalars)}', "output") for name in unknown)
    return [scalar for name in output for scalar in arrays.get(name, (name,))]


def _read_inputs(values: InputValues, component: Component) -> InputTable:
    """Return the table of the inputs of an FMU."""
    inputs = [slot for v in component.variables if v.causality == "input" for slot in v.scalar_names]
    file = Path(values) if isinstance(values, str | os.PathLike) else None
    columns = read_rows(file)[0][1:] if file else _column_names(values)
    if unknown := [column for column in columns if column not in inputs]:
        where = str(file or "input")
        raise InputError(Problem(f'the FMU has no input "{column}"{did_you_mean(column, inputs)}', where) for column in unknown)
    return read_input_table(file, columns, "linear") if file else _table_of_columns(values, columns)


def _column_names(values: Any) -> list[str]:
    """Return the names of the columns after "time" of a dict, a pandas DataFrame or a structured array."""
    found = values.dtype.names if isinstance(values, np.ndarray) else values if hasattr(values, "keys") else ()
    names = list(found or ())
    text = 'a CSV file, or columns by name with a column "time"'
    expect("input", values, "time" in names and all(isinstance(name, str) for name in names), text)
    return [name for name in names if name != "time"]


def _table_of_columns(values: Any, columns: Sequence[str]) -> InputTable:
    try:
        table = {name: np.array(values[name], np.float64) for name in ("time", *columns)}
    except (TypeError, ValueError) as error:
        raise InputError(Problem(f"expected numbers: {error}", "input")) from None
    time = table.pop("time")
    sizes_agree = time.ndim == 1 and len(time) and all(each.shape == time.shape for each in table.values())
    if not sizes_agree or not all(np.isfinite(each).all() for each in (time, *table.values())) or (np.diff(time) <= 0).any():
        raise InputError(Problem("expected columns of equal length with finite numbers, and increasing time", "input"))
    return InputTable(time, table)


def _check_start_values(component: Component, start_values: Mapping[str, Any]) -> dict[str, Any]:
    variables = {variable.name: variable for variable in component.variables}
    values: dict[str, Any] = {}
    problems = []
    for name, value in start_values.items():
        try:
            values |= check_assignment(FMU_NAME, variables, name, value)
        except (UnknownNameError, ValueError) as error:
            problems.append(Problem(str(error), f"start value {name}"))
    if problems:
        raise InputError(problems)
    return values


def _seconds(name: str, value: float | str) -> Fraction:
    try:
        return exact_fraction(value.item() if hasattr(value, "item") else value)
    except (TypeError, ValueError, ZeroDivisionError, OverflowError):
        raise InputError(f'{name}: expected seconds, found "{value}"') from None
