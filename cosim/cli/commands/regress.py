"""`cosim compare` and `cosim regress`: comparison of results with their references."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...core.resources import available_processors
from ...core.text import count_noun
from ..messages import print_json, print_outcome
from ..options import PATH, complete_scenario, flag_option, jobs_option, json_option, path_option

if TYPE_CHECKING:
    from ...studies.regression import RegressionOutcome

#: name of the test suite in JUnit XML
_SUITE = "cosim regress"
_INVALID_XML_CHARACTERS = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


@click.command()
@click.argument("result", type=PATH)
@click.argument("reference", type=PATH, shell_complete=complete_scenario)
@click.option("--absolute", default=0.0, help="Tolerance of values, in the unit of each signal.")
@click.option(
    "--relative",
    default=0.0,
    help="Tolerance of values, relative to the range of each signal in the reference.",
)
@click.option("--time", default=0.0, help="Tolerance of time (s).")
@click.option(
    "--signals",
    multiple=True,
    metavar="PATTERN",
    help='Compare only these signals of the reference; "*" matches any text.',
)
@path_option(
    "--plot",
    metavar="FILE",
    help="Draw the worst signals in their tubes (PNG or SVG).",
)
@json_option(
    "an object with passed and signals, a list of signal, passed, problem, time (s) and excess"
)
def compare(
    result: Path,
    reference: Path,
    absolute: float,
    relative: float,
    time: float,
    signals: tuple[str, ...],
    plot: Path | None,
    as_json: bool,
) -> int:
    """Compare RESULT with REFERENCE, signal by signal.

    Each is a CSV file or a folder written by `cosim run`. Every signal of the reference must stay
    within the larger of the absolute and the relative tolerance, and within the tolerance of time;
    without tolerances it must be equal. If REFERENCE is a scenario file or the name of a shipped
    scenario, its reference and its tolerances are used. Exit code 0: all signals agree; 3: a signal
    leaves its tube, is missing, ends early, or is not finite. The text lists the 10 earliest
    failures.
    """
    from ...api.reference_comparison import ComparisonTask
    from ...results.tolerance_tube import Tolerance

    if plot and plot.suffix not in (".png", ".svg"):
        raise click.BadParameter(
            f'"{plot}" has neither the suffix .png nor .svg', param_hint="--plot"
        )
    task = ComparisonTask.read(result, reference, Tolerance(absolute, relative, time), signals)
    comparison = task.compare()
    if plot:
        from ...report.figures import draw_figure, save_figure

        save_figure(draw_figure(task.result, *task.figure(comparison)), plot)
    if as_json:
        verdicts = []
        for verdict in comparison.verdicts:
            verdicts.append({**verdict._asdict(), "passed": verdict.passed})
        print_json({"passed": comparison.passed, "signals": verdicts})
    else:
        share = task.needed_share() if comparison.passed else 0
        margin = f"; {share:.0%} of the tolerances would suffice" if share else ""
        click.echo(f"{comparison.shortened()}{margin}", err=not comparison.passed)
    return 0 if comparison.passed else 3


@click.command()
@click.argument(
    "scenarios",
    nargs=-1,
    metavar="[DIR|SCENARIO...]",
    type=PATH,
    shell_complete=complete_scenario,
)
@flag_option("--update", help="Write new references from these runs.")
@path_option(
    "--junit",
    metavar="FILE.xml",
    help="Also write the outcomes as JUnit XML.",
)
@path_option(
    "--output-dir",
    default=Path("runs"),
    show_default=True,
    help="Folder for the results.",
)
@jobs_option
@json_option(
    "an object with failed, their number, and scenarios, a list of name, code, summary, details, "
    "seconds and accept"
)
def regress(
    scenarios: tuple[Path, ...],
    update: bool,
    junit: Path | None,
    output_dir: Path,
    jobs: int | None,
    as_json: bool,
) -> int:
    """Run all scenarios that have checks or a reference, and compare their results with these.

    SCENARIO is a file or the name of a shipped scenario; DIR stands for its files *.json; default:
    the folder scenarios/, or without it the shipped ones. Each scenario runs as with `cosim run
    --no-report`. FMUs are taken as they are: export a changed controller first. --update writes the
    references: the signals matched by the patterns of their tolerances, with as few rows as
    necessary, and a JSON file with their origin. A run that fails its checks does not become a
    reference.

    Exit code 0: all passed; 1: a component failed; 2: a scenario was refused; 3: a check or
    comparison failed.
    """
    from ...studies.regression import (
        EXIT_CODE_SEVERITY,
        accept_command,
        default_folder,
        run_regressions,
    )
    from ..forked_commands import forked_commands

    folders = scenarios or [default_folder()]
    if not scenarios and folders != [Path("scenarios")]:
        click.echo("no folder scenarios/ here: the shipped scenarios are run", err=True)
    if junit:
        from ...results.files import check_output_file

        check_output_file(junit.absolute())
    outcomes = []
    count = jobs or available_processors()
    for outcome in run_regressions(folders, update, output_dir, count, forked_commands):
        outcomes.append(outcome)
        if not as_json:
            print_outcome(outcome)
    if junit:
        _write_junit(outcomes, junit)
    failed = sum(outcome.code != 0 for outcome in outcomes)
    if as_json:
        print_json({"failed": failed, "scenarios": [asdict(outcome) for outcome in outcomes]})
    else:
        verdict = f"{failed} failed" if failed else "all passed"
        click.echo(f"{count_noun(len(outcomes), 'scenario')}, {verdict}")
        if accepted := [outcome.accept for outcome in outcomes if outcome.accept]:
            click.echo(accept_command(accepted))
    return min((outcome.code for outcome in outcomes), key=EXIT_CODE_SEVERITY.index)


def _write_junit(outcomes: Sequence[RegressionOutcome], file: Path) -> None:
    """Write the outcomes as a JUnit XML file, which CI services read.

    A scenario without a result is an error, one whose result is not as expected is a failure.

    Raises:
        InputError: The file cannot be written.
        OutputError: The disk is full or failed.
    """
    from xml.etree import ElementTree

    from ...results.files import writing_atomically

    kinds = [{0: "", 3: "failure"}.get(outcome.code, "error") for outcome in outcomes]
    attributes = {
        "name": _SUITE,
        "tests": str(len(outcomes)),
        "failures": str(kinds.count("failure")),
        "errors": str(kinds.count("error")),
        "time": f"{sum(outcome.seconds for outcome in outcomes):.3f}",
    }
    root = ElementTree.Element("testsuites")
    suite = ElementTree.SubElement(root, "testsuite", attributes)
    for outcome, kind in zip(outcomes, kinds, strict=True):
        attributes = {"name": outcome.name, "time": f"{outcome.seconds:.3f}"}
        case = ElementTree.SubElement(suite, "testcase", {"classname": _SUITE, **attributes})
        if kind:
            details = [_INVALID_XML_CHARACTERS.sub("?", line) for line in outcome.details]
            problem = ElementTree.SubElement(case, kind, message=details[0] if details else "")
            problem.text = "\n".join(details)
    ElementTree.indent(root)
    with writing_atomically(file) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
