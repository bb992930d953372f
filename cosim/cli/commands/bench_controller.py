"""`cosim bench-controller`: does a controller fit, does it fly, and is it better than the shipped one?"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import InputError, Problem
from ...core.processors import available_processors
from .. import supervision
from ..bench_trial import ControllerTrial, TrialResult, run_trials
from .regress import EXIT_CODE_SEVERITY, check_unique_names, default_folder, find_scenario_files

if TYPE_CHECKING:
    from ...studies.controller_bench.score import KpiComparison

#: what the child process that looks at the candidate hands over to its parent
_PREPARED_FILE = "bench.json"


@click.command()
@click.argument("controller")
@click.option(
    "--role", required=True, help="Which place it takes: usv_autopilot, uav_position, ...; or the path of a role's JSON."
)
@click.option("--set", "settings", multiple=True, metavar="NAME=value", help="A parameter of the controller.")
@click.option(
    "--scenarios",
    multiple=True,
    metavar="DIR|SCENARIO",
    type=click.Path(path_type=Path),
    help="Where it is tried; default: the folder scenarios/ here, else the shipped one.",
)
@click.option(
    "--output-dir", type=click.Path(path_type=Path), default=Path("runs/bench"), show_default=True, help="Where results go."
)
@click.option("--jobs", type=click.IntRange(min=1), help="How many scenarios run at a time; default: one per processor.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
def command(
    controller: str,
    role: str,
    settings: tuple[str, ...],
    scenarios: tuple[Path, ...],
    output_dir: Path,
    jobs: int | None,
    as_json: bool,
) -> int:
    """Put CONTROLLER in the place of the shipped one in every scenario that has such a place, and fly them all.

    CONTROLLER is an FMU, my.py:Class, my.mo:Model or a nested system's JSON. Its variables are examined first. The table shows
    its KPIs beside those of the shipped controller and of its last run here. Ends with 3 when a check was not met, 1 when a
    component failed, 2 when the controller does not fit.
    """
    from ...scenario.nested_systems import parse_settings
    from ...studies.controller_bench.candidate import parse_source

    candidate = parse_source(controller)
    files = list(find_scenario_files(scenarios or [default_folder()]))
    check_unique_names(files)
    own = output_dir / Path(role).stem / candidate.name
    code = supervision.run_supervised_command(
        lambda: _write_scenarios(controller, role, files, own, parse_settings(settings)), "run", lambda outcome: None
    )
    if code:
        return code
    trials, notes = _read_trials(own, output_dir / "shipped")
    flown = []
    for flight in run_trials(trials, jobs or available_processors()):
        flown.append(flight)
        if not as_json:
            _print_trial(flight, candidate.name)
    if as_json:
        _print_json(candidate.name, role, flown, notes)
    else:
        _print_summary(flown, notes)
    return min((flight.outcome.code for flight in flown), key=EXIT_CODE_SEVERITY.index)


def _write_scenarios(controller: str, role_name: str, files: Sequence[Path], own: Path, settings: Mapping[str, Any]) -> int:
    """Examine the candidate and write the scenarios with it; in a child process, since its code is run."""
    from ...results.files import write_json
    from ...studies.controller_bench.candidate import interface_problems, parse_source, read_interface
    from ...studies.controller_bench.role import read_role
    from ...studies.controller_bench.substitution import ControllerSubstitution

    role, candidate = read_role(role_name), parse_source(controller)
    variables = read_interface(candidate)
    if misfits := interface_problems(role, variables, settings):
        raise InputError([Problem(problem.message, controller) for problem in misfits])
    rmtree(own / "scenarios", ignore_errors=True)
    written, notes = [], []
    for file in files:
        transplant = ControllerSubstitution(role, candidate, variables, file, settings)
        if path := transplant.write((own / "scenarios").absolute()):
            written.append({"file": path, "original": file})
            notes += [f"{file.stem}: {note}" for note in dict.fromkeys(transplant.notes)]
    if not written:
        raise InputError(f'no scenario has a place for the role "{role.name}": {role.description}')
    write_json({"scenarios": written, "notes": notes}, own / _PREPARED_FILE)
    return 0


def _read_trials(own: Path, shipped: Path) -> tuple[list[ControllerTrial], list[str]]:
    """The scenarios that were written, and the notes on what was left out of them."""
    prepared = json.loads((own / _PREPARED_FILE).read_text(encoding="utf-8"))
    trials = [
        ControllerTrial(
            Path(each["file"]), Path(each["original"]), own / Path(each["file"]).stem, shipped / Path(each["file"]).stem
        )
        for each in prepared["scenarios"]
    ]
    return trials, prepared["notes"]


def _print_trial(flight: TrialResult, candidate: str) -> None:
    from ..bench_table import print_comparison

    word = click.style("passed", fg="green") if flight.outcome.code == 0 else click.style("FAILED", fg="red", bold=True)
    click.echo(f"\n{word}  {flight.name}  {flight.outcome.seconds:.1f} s")
    for line in flight.outcome.details:
        click.echo(f"        {line}")
    print_comparison(flight.rows(), candidate)


def _print_summary(flown: Sequence[TrialResult], notes: Sequence[str]) -> None:
    for note in notes:
        click.echo(f"note: {note}")
    better, worse = (sum(row.against_shipped == word for each in flown for row in each.rows()) for word in ("better", "worse"))
    failed = sum(flight.outcome.code != 0 for flight in flown)
    click.echo(
        f"\n{len(flown)} scenarios, {failed} failed; {better} KPIs better and {worse} worse than with the shipped controller"
    )


def _print_json(candidate: str, role: str, flown: Sequence[TrialResult], notes: Sequence[str]) -> None:
    from ...results.files import to_json_types

    scenarios = [
        {
            "name": flight.name,
            "code": flight.outcome.code,
            "seconds": flight.outcome.seconds,
            "problems": flight.outcome.details,
            "kpis": [_row_as_json(row) for row in flight.rows()],
        }
        for flight in flown
    ]
    content = {"candidate": candidate, "role": role, "scenarios": scenarios, "notes": notes}
    click.echo(json.dumps(to_json_types(content), indent=2))


def _row_as_json(row: KpiComparison) -> dict[str, Any]:
    checks = [{**outcome.check, "passed": outcome.passed} for outcome in row.checks]
    return {**asdict(row), "checks": checks}
