"""Trials of controllers and of the shipped ones in the same scenarios."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from shutil import rmtree
from typing import Any

from ...core.errors import InputError, Problem
from ...results.files import write_json
from ...scenario.variable_values import quote_value
from ...scenario.wiring import NO_MATCHING_OUTPUT
from ..regression import (
    EXIT_CODE_SEVERITY,
    CommandRunner,
    Regression,
    RegressionOutcome,
    run_in_parallel,
)
from .candidate import interface_problems, parse_source, read_interface
from .page import BenchedController, describe_kpis
from .ranking import KpiComparison, RunKpis, ScenarioKpis, compare_kpis, is_current, rank
from .role import read_role
from .step_cost import MeasuredController, measure_step_costs
from .substitution import ControllerSubstitution, Omission

#: beginnings of log messages on standard error
LOG_LEVELS = ("DEBUG ", "INFO ", "WARNING ")


@dataclass(frozen=True)
class ControllerTrial:
    """Scenario with the candidate and the original scenario.

    Attributes:
        scenario: what `write_scenarios` has written about it.
        candidate_folder: output directory of the scenario with the candidate.
        shipped_folder: output directory of the original scenario.
        run_command: function that runs commands.
    """

    scenario: Mapping[str, Any]
    candidate_folder: Path
    shipped_folder: Path
    run_command: CommandRunner

    @property
    def file(self) -> Path:
        """The scenario with the candidate."""
        return Path(self.scenario["file"])

    def run(self) -> TrialResult:
        """Run the scenario with the candidate and return the result."""
        last = RunKpis.read(self.candidate_folder)
        return TrialResult(
            self, Regression(self.file, self.candidate_folder, False, self.run_command).run(), last
        )

    def run_shipped(self) -> None:
        """Run the original scenario unless the results of its last run are up to date."""
        original = Path(self.scenario["original"])
        if not is_current(self.shipped_folder, original):
            Regression(original, self.shipped_folder, False, self.run_command).run()


@dataclass(frozen=True)
class TrialResult:
    """Outcome of the candidate in a scenario, and the KPIs of its previous run."""

    trial: ControllerTrial
    outcome: RegressionOutcome
    previous: RunKpis | None

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.trial.file.stem

    @property
    def unfed_inputs(self) -> list[str]:
        """Problems of the inputs of the candidate that the scenario does not feed.

        Empty if it was refused for another reason.
        """
        problems = [line for line in self.outcome.details if not line.startswith(LOG_LEVELS)]
        if self.outcome.code != 2 or not all(NO_MATCHING_OUTPUT in line for line in problems):
            return []
        return [line[line.index(": input ") + 2 :] for line in problems]

    @property
    def is_applicable(self) -> bool:
        """False if the scenario does not feed an input of the candidate."""
        return not self.unfed_inputs

    @cached_property
    def kpis(self) -> ScenarioKpis:
        """KPIs of the candidate and of the shipped controller, with the checks of the scenario."""
        candidate = (
            RunKpis.read(self.trial.candidate_folder) if self.outcome.code in (0, 3) else None
        )
        checks = json.loads(self.trial.file.read_text(encoding="utf-8-sig"))["checks"]
        scenario = self.trial.scenario
        return ScenarioKpis(
            candidate,
            RunKpis.read(self.trial.shipped_folder),
            checks,
            self.is_applicable,
            scenario["own_name"],
            scenario["kpi_descriptions"],
            settings_text(scenario["applied_settings"]),
        )

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON."""
        return {
            "name": self.name,
            "applicable": self.is_applicable,
            "code": self.outcome.code,
            "seconds": self.outcome.seconds,
            "problems": self.outcome.details,
            "ignored_settings": self.trial.scenario["ignored_settings"],
            "applied_settings": self.trial.scenario["applied_settings"],
            "kpis": [asdict(row) | {"checks": row.check_results()} for row in self.rows()],
        }

    def rows(self) -> list[KpiComparison]:
        """Return the compared KPIs; none if the run did not reach its end."""
        candidate, shipped, checks = self.kpis.candidate, self.kpis.shipped, list(self.kpis.checks)
        return compare_kpis(candidate, shipped, self.previous, checks) if candidate else []


def settings_text(settings: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the values of each variable of the candidate ("landing_time = 5.0").

    Several if its components differ.
    """
    values: dict[str, dict[str, None]] = {}
    for variables in settings.values():
        for name, value in variables.items():
            values.setdefault(name, {})[quote_value(value)] = None
    return ", ".join(f"{name} = {' or '.join(texts)}" for name, texts in values.items())


def summarize_omissions(omissions: Sequence[tuple[str, Omission]]) -> list[str]:
    """Return a line of ignored settings and one of KPIs and figures that are left out.

    Each entry has the number of its scenarios.
    """
    settings: dict[str, set[str]] = {}
    entries: dict[str, set[str]] = {}
    for scenario, each in omissions:
        if each.entry:
            entries.setdefault(f'{each.entry} without "{each.lacking}"', set()).add(scenario)
        else:
            settings.setdefault(each.lacking, set()).add(scenario)
    headings = {
        "ignored settings, for which the controller has no variable": settings,
        "left out": entries,
    }
    lines = []
    for heading, scenarios in headings.items():
        if scenarios:
            counts = (f"{text} ({len(names)})" for text, names in scenarios.items())
            lines.append(f"{heading} (number of scenarios): {', '.join(counts)}")
    return lines


@dataclass(frozen=True, kw_only=True)
class ControllerTrials(BenchedController):
    """Controller with its results in all scenarios, and what is left out of each of them.

    Attributes:
        source: argument of the command, such as "my.fmu".
        results: the result in each scenario.
        omissions: names of scenarios, and what is left out of each.
    """

    source: str
    results: Sequence[TrialResult]
    omissions: Sequence[tuple[str, Omission]]

    @property
    def exit_code(self) -> int:
        """The most severe exit code of the applicable scenarios; 2 if there is none."""
        codes = [result.outcome.code for result in self.results if result.is_applicable]
        return min(codes, key=EXIT_CODE_SEVERITY.index, default=2)

    def first_finished(self) -> Mapping[str, str] | None:
        """Return the first scenario that the controller ran to its end, with all its inputs fed.

        None if there is none.
        """
        for result in self.results:
            if result.is_applicable and result.outcome.code in (0, 3):
                return result.trial.scenario
        return None

    def as_json(self) -> dict[str, Any]:
        """Return ranking, scenarios and notes as JSON."""
        scenarios = [result.as_json() for result in self.results]
        notes = [f"{scenario}: {each}" for scenario, each in self.omissions]
        summary = {**asdict(self.ranking), "verdict": self.ranking.verdict}
        return {"candidate": self.name, "ranking": summary, "scenarios": scenarios, "notes": notes}


def run_trials(
    source: str,
    prepared: Mapping[str, Any],
    folder: Path,
    shipped_folder: Path,
    run_command: CommandRunner,
    jobs: int,
    on_result: Callable[[TrialResult], None],
) -> ControllerTrials:
    """Run a controller and the shipped ones in all prepared scenarios, `jobs` at a time.

    Args:
        source: argument of the command, such as "my.fmu".
        prepared: what `write_scenarios` has written.
        folder: folder of the output directories of the controller.
        shipped_folder: folder of those of the shipped controllers.
        run_command: function that runs commands.
        jobs: number of scenarios at a time.
        on_result: called with each result, in order, as soon as both controllers have run.
    """
    work: list[Callable[[], TrialResult | None]] = []
    for scenario in prepared["scenarios"]:
        name = Path(scenario["file"]).stem
        trial = ControllerTrial(scenario, folder / name, shipped_folder / name, run_command)
        work += [trial.run_shipped, trial.run]
    results = []
    for result in run_in_parallel(work, jobs):
        if result:
            results.append(result)
            on_result(result)
    applicable = [result.kpis for result in results if result.is_applicable]
    omissions = [
        (each["scenario"], Omission(each["entry"], each["variable"], each["lacking"]))
        for each in prepared["omissions"]
    ]
    return ControllerTrials(
        name=parse_source(source).name,
        ranking=rank(applicable, prepared["goals"]),
        scenarios={result.name: result.kpis for result in results},
        goals=prepared["goals"],
        notes=summarize_omissions(omissions),
        source=source,
        results=results,
        omissions=omissions,
    )


def write_scenarios(
    controller: str,
    role_name: str,
    files: Sequence[Path],
    folder: Path,
    settings: Mapping[str, Any],
    file: Path,
) -> None:
    """Examine a controller and write the scenarios that use it.

    It executes foreign code, so call it in a child process.

    Args:
        controller: argument of the command, such as "my.fmu".
        role_name: the role, or its file.
        files: the original scenarios.
        folder: the scenarios are written to its folder "scenarios".
        settings: parameters of the controller.
        file: JSON file for scenarios, omissions and goals.

    Raises:
        InputError: the controller does not fit the role, or no scenario has it.
    """
    role, candidate = read_role(role_name), parse_source(controller)
    variables = read_interface(candidate)
    if problems := interface_problems(role, variables, settings):
        raise InputError([Problem(problem.message, controller) for problem in problems])
    target = (folder / "scenarios").absolute()
    written, omissions, substitutions = [], [], []
    for original in files:
        substitution = ControllerSubstitution(role, candidate, variables, original, settings)
        path = substitution.substitute(target)
        if not path:
            continue
        substitutions.append(substitution)
        lacking = [each.lacking for each in substitution.omissions if not each.entry]
        kpis = substitution.changed_files[path]["kpis"]
        written.append(
            {
                "file": path,
                "original": original,
                "component": next(iter(substitution.replaced_components)),
                "own_name": ", ".join(dict.fromkeys(substitution.replaced_components.values())),
                "ignored_settings": list(dict.fromkeys(lacking)),
                "applied_settings": substitution.applied_settings,
                "kpi_descriptions": describe_kpis(kpis, path.parent),
            }
        )
        for each in dict.fromkeys(substitution.omissions):
            omissions.append({"scenario": original.stem, **asdict(each)})
    if not written:
        raise InputError(
            f'no scenario has a component with the role "{role.name}": {role.description}'
        )
    rmtree(target, ignore_errors=True)
    for substitution in substitutions:
        substitution.write_files()
    write_json({"scenarios": written, "omissions": omissions, "goals": role.goals}, file)


def write_costs(
    role_name: str, measured: Sequence[tuple[str, Mapping[str, str]]], file: Path
) -> None:
    """Measure the processor time per step of controllers and write it to a JSON file.

    It executes foreign code, so call it in a child process.

    Args:
        role_name: the role, or its file.
        measured: source of each controller, and a scenario of `write_scenarios` for it.
        file: JSON file for the name of the reference, and for its cost and those of the
            controllers (s).
    """
    reference = str(read_role(role_name).cost_reference or measured[0][0])
    controllers = [
        MeasuredController(source, Path(each["file"]), each["component"])
        for source, each in measured
    ]
    costs = measure_step_costs(controllers, reference)
    write_json({"reference": Path(reference).stem, "costs": costs}, file)
