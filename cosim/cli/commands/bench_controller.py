"""`cosim bench-controller`: benchmark of a controller against the shipped one."""

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
from ...core.text import count_noun
from ...studies.regression_runs import check_unique_names, default_folder, find_scenario_files
from .. import current_command_line, supervision
from ..bench_table import print_comparison, print_ranking
from ..bench_trial import ControllerTrial, TrialResult, run_trials
from ..completion import complete_role, complete_scenario
from ..messages import print_json
from ..output_options import json_option
from .regress import EXIT_CODE_SEVERITY, print_outcome

if TYPE_CHECKING:
    from ...studies.controller_bench.ranking import Ranking
    from ...studies.controller_bench.score import KpiComparison

#: file in which the child process that examines the candidate returns its results
_PREPARED_FILE = "bench.json"


@click.command()
@click.argument("controller")
@click.option(
    "--role",
    required=True,
    shell_complete=complete_role,
    help="Role of the controller (see `cosim list roles`), or the path of a role's JSON file.",
)
@click.option("--set", "settings", multiple=True, metavar="NAME=value", help="Set a parameter of the controller.")
@click.option(
    "--scenarios",
    multiple=True,
    metavar="DIR|SCENARIO",
    type=click.Path(path_type=Path),
    shell_complete=complete_scenario,
    help="Scenarios to run; default: the folder scenarios/ here, else the shipped ones.",
)
@click.option(
    "--output-dir", type=click.Path(path_type=Path), default=Path("runs/bench"), show_default=True, help="Folder for the results."
)
@click.option("--jobs", type=click.IntRange(min=1), help="Number of scenarios at a time; default: one per processor.")
@json_option("an object with candidate, role, ranking, scenarios (name, code, seconds, problems, kpis) and notes")
def command(
    controller: str,
    role: str,
    settings: tuple[str, ...],
    scenarios: tuple[Path, ...],
    output_dir: Path,
    jobs: int | None,
    as_json: bool,
) -> int:
    """Benchmark CONTROLLER in every scenario with its role.

    CONTROLLER is an FMU, my.py:Class, my.mo:Model or the JSON file of a nested system. It replaces the shipped controller. The
    summary ranks both: the one that meets more checks is above; then the goals of the role decide. --verbose prints tables that
    compare all KPIs with those of the shipped controller and of the candidate's last run. Exit code 0: all checks passed; 1: a
    component failed; 2: the controller's variables do not fit the role; 3: a check failed.
    """
    from ...scenario.settings import parse_settings
    from ...studies.controller_bench.candidate import parse_source
    from ...studies.controller_bench.ranking import rank

    candidate = parse_source(controller)
    files = list(find_scenario_files(scenarios or [default_folder()]))
    check_unique_names(files)
    candidate_folder = output_dir / Path(role).stem / candidate.name
    code = supervision.run_supervised_command(
        lambda: _write_scenarios(controller, role, files, candidate_folder, parse_settings(settings)),
        "run",
        lambda _outcome: None,
    )
    if code:
        return code
    prepared = json.loads((candidate_folder / _PREPARED_FILE).read_text(encoding="utf-8"))
    trials = _make_trials(prepared["scenarios"], candidate_folder, output_dir / "shipped")
    results = []
    for result in run_trials(trials, jobs or available_processors()):
        results.append(result)
        if not as_json:
            _print_trial(result, candidate.name)
    ranking = rank([result.kpis for result in results], prepared["goals"])
    if as_json:
        _print_json(candidate.name, role, results, prepared["notes"], ranking)
    else:
        _print_notes(prepared["notes"])
        print_ranking(ranking, candidate.name)
    return min((result.outcome.code for result in results), key=EXIT_CODE_SEVERITY.index)


def _write_scenarios(controller: str, role_name: str, files: Sequence[Path], folder: Path, settings: Mapping[str, Any]) -> int:
    """Examine the candidate and write the scenarios that use it; runs in a child process, since it executes foreign code."""
    from ...results.files import write_json
    from ...studies.controller_bench.candidate import interface_problems, parse_source, read_interface
    from ...studies.controller_bench.role import read_role
    from ...studies.controller_bench.substitution import ControllerSubstitution

    role, candidate = read_role(role_name), parse_source(controller)
    variables = read_interface(candidate)
    if problems := interface_problems(role, variables, settings):
        raise InputError([Problem(problem.message, controller) for problem in problems])
    rmtree(folder / "scenarios", ignore_errors=True)
    written, notes = [], []
    for file in files:
        substitution = ControllerSubstitution(role, candidate, variables, file, settings)
        if path := substitution.write((folder / "scenarios").absolute()):
            written.append({"file": path, "original": file})
            notes += [f"{file.stem}: {note}" for note in dict.fromkeys(substitution.notes)]
    if not written:
        raise InputError(f'no scenario has a component with the role "{role.name}": {role.description}')
    write_json({"scenarios": written, "notes": notes, "goals": role.goals}, folder / _PREPARED_FILE)
    return 0


def _make_trials(written: Sequence[Mapping[str, str]], folder: Path, shipped: Path) -> list[ControllerTrial]:
    """Return the trials of the written scenarios."""
    return [
        ControllerTrial(
            Path(each["file"]), Path(each["original"]), folder / Path(each["file"]).stem, shipped / Path(each["file"]).stem
        )
        for each in written
    ]


def _print_trial(result: TrialResult, candidate: str) -> None:
    """Print a line about a scenario and its problems; with --verbose also all KPIs."""
    print_outcome(result.outcome)
    if current_command_line().verbosity > 0:
        print_comparison(result.rows(), candidate)


def _print_notes(notes: Sequence[str]) -> None:
    """Print what is left out of the scenarios; equal notes of several scenarios on one line, unless --verbose is given."""
    scenarios: dict[str, list[str]] = {}
    for name, _, text in (note.partition(": ") for note in notes):
        scenarios.setdefault(text, []).append(name)
    for text, names in scenarios.items():
        is_grouped = len(names) > 1 and current_command_line().verbosity <= 0
        for where in [count_noun(len(names), "scenario")] if is_grouped else names:
            click.echo(f"note: {where}: {text}")


def _print_json(candidate: str, role: str, results: Sequence[TrialResult], notes: Sequence[str], ranking: Ranking) -> None:
    scenarios = [
        {
            "name": result.name,
            "code": result.outcome.code,
            "seconds": result.outcome.seconds,
            "problems": result.outcome.details,
            "kpis": [_row_as_json(row) for row in result.rows()],
        }
        for result in results
    ]
    summary = {**asdict(ranking), "verdict": ranking.verdict}
    print_json({"candidate": candidate, "role": role, "ranking": summary, "scenarios": scenarios, "notes": notes})


def _row_as_json(row: KpiComparison) -> dict[str, Any]:
    checks = [{**outcome.check, "passed": outcome.passed} for outcome in row.checks]
    return {**asdict(row), "checks": checks}
