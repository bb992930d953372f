"""`cosim bench-controller`: benchmark of controllers against those that the scenarios contain."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import ComponentError, InputError
from ...core.resources import available_processors
from ...studies.regression import (
    EXIT_CODE_SEVERITY,
    check_unique_names,
    default_folder,
    find_scenario_files,
)
from .. import supervision
from ..bench_output import (
    print_heading,
    print_omissions,
    print_ranking,
    print_side_by_side,
    print_trial,
)
from ..forked_commands import forked_commands
from ..messages import print_json
from ..options import (
    Texts,
    complete_role,
    complete_scenario,
    flag_option,
    jobs_option,
    json_option,
    path_option,
)

if TYPE_CHECKING:
    from ...studies.controller_bench.trials import ControllerTrials, TrialResult

#: file in which the child process that examines the candidate returns its results
_PREPARED_FILE = "bench.json"
#: file in which the child process that measures the costs per step returns them
_COSTS_FILE = "costs.json"


@click.command()
@click.argument("controllers", nargs=-1, metavar="[CONTROLLER]...")
@click.option(
    "--role",
    required=True,
    shell_complete=complete_role,
    help="Role of the controller (see `cosim list roles`), or the path of a role's JSON file.",
)
@flag_option(
    "--all",
    "with_shipped",
    help="Also benchmark all shipped controllers of the role.",
)
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=value",
    help="Set a parameter of the (only) controller.",
)
@path_option(
    "--scenarios",
    multiple=True,
    metavar="DIR|SCENARIO",
    shell_complete=complete_scenario,
    help="Scenarios to run; default: the folder scenarios/ here, else the shipped ones.",
)
@path_option(
    "--output-dir",
    default=Path("runs/bench"),
    show_default=True,
    help="Folder for the results.",
)
@jobs_option
@json_option(
    "an object with candidate, role, ranking, scenarios (name, applicable, code, seconds, "
    "problems, ignored_settings, "
    "applied_settings, kpis) and notes; of several controllers: role, reference and controllers, "
    "objects with the same keys, "
    "cost (s per step) and cost_ratio"
)
def command(
    controllers: Texts,
    role: str,
    with_shipped: bool,
    settings: Texts,
    scenarios: tuple[Path, ...],
    output_dir: Path,
    jobs: int | None,
    as_json: bool,
) -> int:
    """Benchmark each CONTROLLER in every scenario with its role.

    CONTROLLER is an FMU, my.py:Class, my.mo:Model or the JSON file of a nested system. It replaces
    the scenario's own controller, which is the one that the scenario file contains. The summary
    ranks both by passed checks, then by the goals of the role. The page bench.html in the output
    directory shows the checked KPIs and goals. --verbose prints tables that compare all KPIs with
    those of the scenario's own controller and of the candidate's last run, and the settings that
    each scenario gives the controller (without it, of failed scenarios only).

    Several controllers, or those of --all, are shown side by side, with the processor time per step
    of each. A scenario that does not feed an input of the controller is not applicable ("n/a") and
    does not count. Exit code 0: all checks passed; 1: a component failed; 2: the controller's
    variables do not fit the role, or no scenario is applicable; 3: a check failed. The controllers
    that --all adds to a named CONTROLLER do not affect it.
    """
    from ...scenario.settings import parse_settings
    from ...studies.controller_bench.candidate import parse_source
    from ...studies.controller_bench.role import read_role

    shipped = [str(path) for path in read_role(role).different_controllers] if with_shipped else []
    sources = list(dict.fromkeys([*controllers, *shipped]))
    if not sources:
        raise click.UsageError("name a CONTROLLER, or --all")
    if settings and len(sources) > 1:
        raise click.UsageError("--set needs a single CONTROLLER")
    names = [parse_source(source).name for source in sources]
    if repeated := next((name for name in names if names.count(name) > 1), None):
        raise InputError(
            f'2 controllers are called "{repeated}": their results would go to one folder'
        )
    files = list(find_scenario_files(scenarios or [default_folder()]))
    check_unique_names(files)
    bench = _Bench(role, files, output_dir, jobs or available_processors(), as_json)
    if len(sources) == 1 and not with_shipped:
        return bench.run_one(sources[0], parse_settings(settings))
    return bench.run_all(sources, number_of_own=len(set(controllers)) or len(sources))


@dataclass(frozen=True)
class _Bench:
    """Benchmark of controllers in the scenarios of a role."""

    role: str
    files: Sequence[Path]
    output_dir: Path
    jobs: int
    as_json: bool

    @property
    def _page(self) -> Path:
        return self.output_dir / Path(self.role).stem / "bench.html"

    def run_one(self, source: str, settings: Mapping[str, Any]) -> int:
        """Benchmark a controller against those that the scenarios contain."""
        from ...studies.controller_bench.page import write_bench_page

        trials = self._run_trials(source, settings)
        write_bench_page(self.role, [trials], self._page)
        if self.as_json:
            print_json({"role": self.role, **trials.as_json()})
        else:
            print_ranking(trials.ranking, trials.name)
            click.echo("\n" if trials.omissions else "", nl=False)
            print_omissions(trials.omissions)
            click.echo(f"page: {self._page}")
        return trials.exit_code

    def run_all(self, sources: Sequence[str], number_of_own: int) -> int:
        """Benchmark several controllers and show them side by side.

        Return the exit code of the first `number_of_own`.
        """
        from ...studies.controller_bench.candidate import parse_source
        from ...studies.controller_bench.page import order, write_bench_page

        everything: list[ControllerTrials] = []
        began = time.perf_counter()
        for finished, source in enumerate(sources):
            if not self.as_json:
                print_heading(parse_source(source).name, finished, len(sources), began)
            everything.append(self._run_trials(source, {}))
        if not self.as_json:
            click.echo("measuring the processor time per step")
        reference, costs = self._measure_costs(everything)
        benched = [
            replace(trials, cost=cost, cost_ratio=cost / costs[0])
            for trials, cost in zip(everything, costs[1:], strict=True)
        ]
        write_bench_page(self.role, benched, self._page, reference, costs[0])
        if self.as_json:
            shown = [
                {**each.as_json(), "cost": each.cost, "cost_ratio": each.cost_ratio}
                for each in benched
            ]
            print_json(
                {
                    "role": self.role,
                    "reference": reference,
                    "reference_cost": costs[0],
                    "controllers": shown,
                }
            )
        else:
            print_side_by_side(order(benched), reference)
            for trials in everything:
                print_omissions(trials.omissions, trials.name)
            click.echo(f"page: {self._page}")
        return min(
            (trials.exit_code for trials in everything[:number_of_own]),
            key=EXIT_CODE_SEVERITY.index,
        )

    def _run_trials(self, source: str, settings: Mapping[str, Any]) -> ControllerTrials:
        from ...studies.controller_bench.candidate import parse_source
        from ...studies.controller_bench.trials import run_trials, write_scenarios

        name = parse_source(source).name
        folder = self.output_dir / Path(self.role).stem / name
        file = folder / _PREPARED_FILE
        prepared = _in_child(
            lambda: write_scenarios(source, self.role, self.files, folder, settings, file), file
        )

        def show(result: TrialResult) -> None:
            if not self.as_json:
                print_trial(result, name)

        shipped = self.output_dir / "shipped"
        with forked_commands(self.jobs) as run_command:
            return run_trials(source, prepared, folder, shipped, run_command, self.jobs, show)

    def _measure_costs(self, everything: Sequence[ControllerTrials]) -> tuple[str, list[float]]:
        """Measure the processor time per step (s) of the controllers in a child process.

        The cost of a controller that does not run to its end in any scenario is NaN, and so are all
        if the process crashes.

        Returns:
            Name of the reference, its cost, and the cost of each controller.
        """
        from ...studies.controller_bench.trials import write_costs

        file = self.output_dir / Path(self.role).stem / _COSTS_FILE
        measured: dict[str, tuple[str, Mapping[str, str]]] = {}
        for trials in everything:
            scenario = trials.first_finished()
            if scenario:
                measured[trials.name] = (trials.source, scenario)
        found: Mapping[str, Any] = {"reference": "", "costs": [None] * (1 + len(measured))}
        try:
            if measured:
                found = _in_child(lambda: write_costs(self.role, [*measured.values()], file), file)
        except click.exceptions.Exit:  # the child process has printed why
            pass
        except ComponentError as error:
            click.echo(f"WARNING no cost is measured: {error}", err=True)
        costs = [math.nan if cost is None else float(cost) for cost in found["costs"]]
        cost_of = dict(zip(measured, costs[1:], strict=True))
        names = [trials.name for trials in everything]
        return found["reference"], [costs[0], *(cost_of.get(name, math.nan) for name in names)]


def _in_child(work: Callable[[], None], file: Path) -> Any:
    """Do work that executes foreign code in a child process.

    Return the content of the JSON file that it writes. If the child process was refused or failed,
    it has printed why, and the command ends with its exit code.
    """

    def run() -> int:
        work()
        return 0

    if code := supervision.run_supervised_command(run):
        raise click.exceptions.Exit(code)
    return json.loads(file.read_text(encoding="utf-8"))
