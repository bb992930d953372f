"""Simulation of a single FMU."""

import os
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from ..components.fmi import (
    InstanceSettings,
    Isolation,
    Method,
    SolverSettings,
    create_component,
    open_fmu,
)
from ..components.input_table import InputTable, make_input_table, parse_cell, read_input_table
from ..core import component_log
from ..core.component import Component, Variable, scalars_of
from ..core.errors import ComponentError, InputError, Problem, did_you_mean
from ..core.system import Connection, Endpoint, System
from ..core.time_grid import exact_divisor, exact_fraction
from ..engine.plan import Plan, compile_plan
from ..engine.plan_run import free_components, simulating
from ..engine.settings import Settings
from ..export.foreign import add_binary
from ..process.float_mode import default_float_mode
from ..process.process_state import exclusive_process_state
from ..results import Result, RunMetadata
from ..results.checks import warn_non_finite
from ..results.csv_files import read_rows
from ..scenario.name_resolution import UnknownNameError, check_assignment
from .arguments import check_names, expect

#: names of the components
FMU_NAME, PROFILE_NAME = "fmu", "profile"

#: times and values of inputs: a CSV file, or columns by name, the first one "time" (dict, pandas
#: DataFrame, structured array)
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
    solver: Method | None = None,
    solver_step_size: float | str | None = None,
    tolerance: float | None = None,
) -> Result:
    """Simulate one FMU from the start time of its default experiment.

    Co-Simulation or Model Exchange of FMI 1.0, 2.0 or 3.0.

    Args:
        fmu: Path of the FMU.
        stop_time: Stop time (s), a number or a fraction such as "1/3"; None: that of the default
            experiment, else 1 s later.
        step_size: Communication step size (s); None: that of the default experiment, else a
            hundredth of the duration.
        input: Values of inputs over time: a CSV file, or columns by name as a dict, a pandas
            DataFrame or a structured array. The
            column "time" is in s. Floating-point numbers are interpolated linearly, other values
            are held.
        start_values: Parameters and start values by the names of the variables.
        output: Names of the recorded variables; None: all outputs.
        isolation: "fmu" runs the FMU in a separate process.
        solver: A method of `cosim.core.integration_methods` simulates by Model Exchange; None: by
            Co-Simulation if the FMU has it, else with cvode.
        solver_step_size: Largest step size (s) of a fixed-step method; None: that of the default
            experiment, else `step_size`.
        tolerance: Relative tolerance of the FMU and of cvode; None: that of the default experiment.

    Returns:
        The recorded variables by their names.

    Raises:
        InputError: The FMU cannot be simulated, or an argument is of a wrong type.
        ComponentError: The FMU failed; the attribute `result` of the error holds what was
            recorded until then.
    """
    expect("fmu", fmu, isinstance(fmu, str | os.PathLike), "the path of an FMU")
    check_names("start_values", start_values)
    names = [output] if isinstance(output, str) else output
    accepted = names is None or (
        isinstance(names, Sequence) and all(isinstance(name, str) for name in names)
    )
    expect("output", output, accepted, "a list of names")
    expect("isolation", isolation, isolation in ("fmu", "none"), "'fmu' or 'none'")
    setup = Isolation() if isolation == "fmu" else None
    settings = InstanceSettings(tolerance, parse_solver(solver, solver_step_size))
    plan, warnings = compile_fmu(
        Path(fmu), stop_time, step_size, input, start_values or {}, names, setup, settings
    )
    for warning in warnings:
        component_log.log_message(FMU_NAME, component_log.WARNING, warning)
    result = None
    try:
        with simulating(plan) as run:
            about: RunMetadata = {
                "name": Path(fmu).stem,
                "non_finite": warn_non_finite(run.recording),
                "macro_steps": run.macro_steps,
                "terminated_by": None,
            }
            if ended := run.termination:
                about["terminated_by"] = {"component": ended.component, "time": ended.time}
            result = Result(run.recording, timing=dict(run.timing), metadata=about)
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
    settings: InstanceSettings,
) -> tuple[Plan, list[str]]:
    """Compile the system of an FMU, and of the table of its inputs if there is one.

    Args:
        fmu: The FMU.
        stop_time: See `simulate`.
        step_size: See `simulate`.
        input_values: See `simulate`.
        start_values: See `simulate`.
        output: See `simulate`.
        isolation: Settings of a worker process for the FMU; None runs the FMU in this process.
        settings: Tolerance and integration method.

    Returns:
        The plan, and warnings about the FMU and the end of the run.

    Raises:
        InputError: The FMU cannot be simulated in this way.
    """
    file = open_fmu(fmu, settings.interface, add_binary)
    settings = settings.with_structural_parameters(file.description, start_values)
    experiment = file.description.default_experiment
    start = experiment.start_time or Fraction(0)
    stop = (
        experiment.stop_time or start + 1 if stop_time is None else _seconds("stop_time", stop_time)
    )
    default_step = exact_divisor(stop - start, experiment.step_size or (stop - start) / 100)
    step = default_step if step_size is None else _seconds("step_size", step_size)
    component = create_component(file, file.description.model_name, settings, isolation)
    components: dict[str, Component] = {FMU_NAME: component}
    try:
        connections, stages = [], [(FMU_NAME,)]
        if input_values is not None:
            components[PROFILE_NAME] = profile = _read_inputs(input_values, component)
            stages.append((PROFILE_NAME,))
            connections = [
                Connection(Endpoint(PROFILE_NAME, v.name), Endpoint(FMU_NAME, v.name))
                for v in profile.variables
            ]
        assigned = _check_start_values(component, start_values)
        columns = {name: Endpoint(FMU_NAME, name) for name in _recorded_names(component, output)}
        system = System(components, connections, stages, start_values={FMU_NAME: assigned})
        plan = compile_plan(system, Settings(start, stop, step, columns))
        return plan, [text for text in (file.run_warning, plan.end_warning) if text]
    except BaseException:
        free_components(components)
        raise


def parse_solver(method: Method | None, step_size: float | str | None) -> SolverSettings | None:
    """Return the settings of a solver; None if there is no method.

    Args:
        method: Integration method, or None.
        step_size: Largest step size (s) of a method with fixed step size.

    Raises:
        InputError: The method is unknown, or the step size is not a positive time.
    """
    known = get_args(Method)
    expect("solver", method, method is None or method in known, f"one of {', '.join(known)}")
    seconds = None if step_size is None else _seconds("solver_step_size", step_size)
    if seconds is not None and seconds <= 0:
        raise InputError(
            f"solver_step_size: expected a positive number of seconds, found {step_size!r}"
        )
    return SolverSettings(method, seconds) if method else None


def _recorded_names(component: Component, output: Sequence[str] | None) -> list[str]:
    if output is None:
        return list(scalars_of(component.variables, "output"))
    scalars = scalars_of(component.variables)
    arrays = {variable.name: variable.scalar_names for variable in component.variables}
    if unknown := [name for name in output if name not in scalars and name not in arrays]:
        raise InputError(
            Problem(f'the FMU has no variable "{name}"{did_you_mean(name, scalars)}', "output")
            for name in unknown
        )
    return list(chain.from_iterable(arrays.get(name, (name,)) for name in output))


def _read_inputs(values: InputValues, component: Component) -> InputTable:
    """Return the table of the inputs of an FMU."""
    inputs = scalars_of(component.variables, "input")
    file = Path(values) if isinstance(values, str | os.PathLike) else None
    columns = read_rows(file)[0][1:] if file else _column_names(values)
    if unknown := [column for column in columns if column not in inputs]:
        where = str(file or "input")
        raise InputError(
            Problem(f'the FMU has no input "{column}"{did_you_mean(column, inputs)}', where)
            for column in unknown
        )
    targets = {column: inputs[column] for column in columns}
    return read_input_table(file, targets, "linear") if file else _table_of_columns(values, targets)


def _column_names(values: Any) -> list[str]:
    """Return the names of the columns after "time".

    `values` is a dict, a pandas DataFrame or a structured array.
    """
    if isinstance(values, np.ndarray):
        names = list(values.dtype.names or ())
    else:
        names = list(values) if hasattr(values, "keys") else []
    text = 'a CSV file, or columns by name with a column "time"'
    expect("input", values, "time" in names and all(isinstance(name, str) for name in names), text)
    return [name for name in names if name != "time"]


def _table_of_columns(values: Any, targets: Mapping[str, Variable]) -> InputTable:
    try:
        time = np.array(values["time"], np.float64)
        table: dict[str, list[Any]] = {}
        for name, variable in targets.items():
            column = values[name]
            table[name] = [
                # a text, as in CSV, is accepted for each type
                each if isinstance(each, bytes) else parse_cell(str(each), variable)
                for each in (column.tolist() if hasattr(column, "tolist") else list(column))
            ]
    except (TypeError, ValueError) as error:
        raise InputError(Problem(f"expected numbers: {error}", "input")) from None
    sizes_agree = (
        time.ndim == 1 and len(time) and all(len(each) == len(time) for each in table.values())
    )
    if not sizes_agree or not np.isfinite(time).all() or (np.diff(time) <= 0).any():
        text = "expected columns of equal length with finite numbers, and increasing time"
        raise InputError(Problem(text, "input"))
    return make_input_table(time.tolist(), table, targets, "linear")


def _check_start_values(component: Component, start_values: Mapping[str, Any]) -> dict[str, Any]:
    variables = {variable.name: variable for variable in component.variables}
    values: dict[str, Any] = {}
    problems = []
    for name, value in start_values.items():
        try:
            values |= check_assignment(FMU_NAME, variables, name, value, current=values.get)
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
