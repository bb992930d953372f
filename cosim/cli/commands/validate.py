"""`cosim validate`: is an FMU what the standard and caution ask for?"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ...components.fmi.preflight import Finding


@click.command()
@click.argument("fmus", metavar="FMU...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print a JSON array: one object per finding.")
def command(fmus: tuple[Path, ...], as_json: bool) -> int:
    """Examine FMUs without running anything of them: archive, model description and binary for this machine.

    Errors are what `cosim run` refuses; warnings break the FMI standard without harm to a run. Whether an FMU computes what
    it should is not examined. Ends with 2 when there are findings.
    """
    findings = {path: _validate_fmu(path) for path in fmus}
    if as_json:
        click.echo(
            json.dumps([_finding_as_json(path, finding) for path, found in findings.items() for finding in found], indent=1)
        )
    else:
        _print_findings(findings)
    return 2 if any(findings.values()) else 0


def _validate_fmu(path: Path) -> Sequence[Finding]:
    from ...components.fmi.preflight.archive import FILE
    from ...components.fmi.preflight.validation import validate_fmu
    from ...core.errors import InputError

    try:
        return validate_fmu(path)
    except InputError as error:
        return [FILE(problem.message) for problem in error.problems]


def _print_findings(findings: Mapping[Path, Sequence[Finding]]) -> None:
    for path, found in findings.items():
        if not found:
            click.echo(f"{path}: no findings")
        for finding in found:
            click.echo(f"{path}: {finding.rule.severity}: {finding}")


def _finding_as_json(path: Path, finding: Finding) -> dict[str, Any]:
    return {
        "file": str(path),
        "severity": finding.rule.severity,
        "rule": finding.rule.name,
        "source": finding.rule.source,
        "member": finding.member,
        "line": finding.line or None,
        "message": finding.message,
    }
