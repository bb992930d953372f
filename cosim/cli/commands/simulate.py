"""`cosim simulate`: one FMU alone."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...process.temporary_folders import run_folder
from .. import report, strict_sandbox, supervision

if TYPE_CHECKING:
    from ...components.fmi import Isolation
    from ...core.component import Component
    from ...core.recording import Recording
    from ...core.system import System
    from ...engine.run_loop import Settings

NAME, PROFILE = "fmu", "profile"


@click.command(cls=strict_sandbox.Command)
@click.argument("fmu", type=click.Path(path_type=Path))
@click.option("--output-file", type=click.Path(path_type=Path), help="CSV file for the outputs; default: print final values.")
@click.option("--stop-time", help="Stop time in s; default: the FMU's, else 1.")
@click.option("--step-size", help="Communication step in s; default: the FMU's, else a hundredth of the duration.")
@click.option("--start-value", "start_values", multiple=True, metavar="name=value", help="Set a parameter or start value.")
@click.option("--input-file", type=click.Path(path_type=Path), help='CSV file with "time" and columns named as inputs.')
@supervision.option
def command(isolation: str, sandbox: str | None, output_file: Path | None, **options: Any) -> int:
    """Simulate FMU (FMI 2.0 or 3.0 Co-Simulation) from its default start time."""
    output = output_file.absolute() if output_file else None
    if strict_sandbox.wanted(sandbox):
        return strict_sandbox.again([path for path in (options["fmu"], options["input_file"]) if path], output and output.parent)
    with run_folder() as folder:
        unfinished = output.with_name(f".{output.name}.unfinished") if output else Path(folder) / "run"
        return supervision.protected(
            lambda: _simulate(unfinished, output, output_file, _apart(isolation, bool(sandbox)), **options),
            isolation,
            lambda outcome: _save(supervision.recovered(outcome), output, output_file),
        )


def _simulate(
    folder: Path,
    output: Path | None,
    shown: Path | None,
    apart: Isolation | None,
    fmu: Path,
    stop_time: str | None,
    step_size: str | None,
    start_values: tuple[str, ...],
    input_file: Path | None,
) -> int:
    from ...engine.run_loop import simulation
    from ...process.run_files.folder import saved, unfinished
    from ...results.files import prepare, remove
    from ...scenario.nested_systems import parse_settings
    from .. import messages

    messages.show()
    if output:
        prepare(output.parent)
    system, settings = _prepare(fmu, apart, stop_time, step_size, parse_settings(start_values), input_file)
    if output:
        remove(output.parent, output.name)
    with unfinished(folder, output), simulation(system, settings) as run:
        if output:
            _save(run.recording, output, shown)
            saved()
        if run.failure:
            return supervision.leaving(report(run.failure))
        if not output:
            _print_last(run.recording)
        return supervision.leaving(0)


def _save(recording: Recording, output: Path | None, shown: Path | None) -> None:
    from ...results.csv_files import write_csv

    if output and len(recording.time):
        write_csv(recording, output)
        click.echo(f"{len(recording.time)} rows in {shown}")


def _print_last(recording: Recording) -> None:
    click.echo(f"time = {recording.time.tolist()[-1]!r} s")
    for name, values in recording.columns.items():
        click.echo(f"{name} = {values.tolist()[-1]!r} {recording.units[name]}".rstrip())


def _apart(isolation: str, sandbox: bool) -> Isolation | None:
    from ...components.fmi import Isolation

    return Isolation(sandbox=sandbox) if sandbox or isolation == "fmu" else None


def _prepare(
    fmu: Path,
    apart: Isolation | None,
    stop_time: str | None,
    step_size: str | None,
    start_values: dict[str, Any],
    input_file: Path | None,
) -> tuple[System, Settings]:
    """The FMU, and the profile if there is one, as a system of their own."""
    from ...components.fmi import FmuFile, instantiate
    from ...core.system import Connection, Endpoint, System
    from ...engine.run_loop import Settings

    file = FmuFile(fmu)
    experiment = file.description.default_experiment
    start = experiment.start_time or Fraction(0)
    stop = _seconds(stop_time) if stop_time else experiment.stop_time or start + 1
    step = _seconds(step_size) if step_size else experiment.step_size or (stop - start) / 100
    components: dict[str, Component] = {NAME: instantiate(file, file.description.model_name, isolation=apart)}
    connections, stages = [], [(NAME,)]
    if input_file:
        components[PROFILE] = _profile(input_file, components[NAME])
        stages.append((PROFILE,))
        connections = [Connection(Endpoint(PROFILE, v.name), Endpoint(NAME, v.name)) for v in components[PROFILE].variables]
    assigned = _assigned(components[NAME], start_values)
    outputs = [slot for v in components[NAME].variables if v.causality == "output" for slot in v.slots]
    columns = {slot: Endpoint(NAME, slot) for slot in outputs}
    return System(components, connections, stages, start_values={NAME: assigned}), Settings(start, stop, step, columns)


def _profile(path: Path, component: Component) -> Component:
    import csv

    from ...components.input_table import read_table
    from ...core.errors import InputError, Problem, did_you_mean

    if not path.is_file():
        raise InputError(f'input file "{path}" does not exist')
    with path.open(newline="") as file:
        columns = next(csv.reader(file), ["time"])[1:]
    inputs = [slot for v in component.variables if v.causality == "input" for slot in v.slots]
    unknown = [column for column in columns if column not in inputs]
    if unknown:
        raise InputError(
            Problem(f'the FMU has no input "{column}"{did_you_mean(column, inputs)}', str(path)) for column in unknown
        )
    return read_table(path, columns, "linear")


def _assigned(component: Component, start_values: dict[str, Any]) -> dict[str, Any]:
    from ...core.errors import InputError, Problem
    from ...scenario.name_resolution import Unknown, assign

    variables = {variable.name: variable for variable in component.variables}
    values: dict[str, Any] = {}
    problems = []
    for name, value in start_values.items():
        try:
            values |= assign(NAME, variables, name, value)
        except (Unknown, ValueError) as error:
            problems.append(Problem(str(error), f"--start-value {name}"))
    if problems:
        raise InputError(problems)
    return values


def _seconds(text: str) -> Fraction:
    from ...core.errors import InputError
    from ...core.time_grid import exact

    try:
        return exact(text)
    except (ValueError, ZeroDivisionError):
        raise InputError(f'expected seconds, found "{text}"') from None
