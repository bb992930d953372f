"""`cosim validate`: validation of FMUs against the FMI standard and the importer's safety rules."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..messages import print_json
from ..options import PATH, json_option

if TYPE_CHECKING:
    from ...components.fmi.preflight.findings import Finding


@click.command()
@click.argument("fmus", metavar="FMU...", nargs=-1, required=True, type=PATH)
@json_option("a list of findings with file, severity, rule, source, member, line and message")
def command(fmus: tuple[Path, ...], as_json: bool) -> int:
    """Validate FMUs against the FMI standard without running them.

    Examines the archive, the model description and the binary for this machine. `cosim run` refuses
    FMUs with errors; warnings are violations of the FMI standard that do not prevent a run. Results
    of the FMU are not examined. Exit code 0: no findings; 2: findings.
    """
    findings = {path: _validate_fmu(path) for path in fmus}
    if as_json:
        listed = []
        for path, found in findings.items():
            for finding in found:
                listed.append(
                    {
                        "file": str(path),
                        "severity": finding.severity,
                        "rule": finding.rule,
                        "source": finding.source,
                        "member": finding.member,
                        "line": finding.line or None,
                        "message": finding.message,
                    }
                )
        print_json(listed)
    else:
        for path, found in findings.items():
            if not found:
                click.echo(f"{path}: no findings")
            for finding in found:
                click.echo(f"{path}: {finding.severity}: {finding}")
    return 2 if any(findings.values()) else 0


def _validate_fmu(path: Path) -> Sequence[Finding]:
    from ...components.fmi.preflight.findings import Finding
    from ...components.fmi.preflight.validation import validate_fmu
    from ...core.errors import InputError

    try:
        return validate_fmu(path)
    except InputError as error:
        return [Finding("archive.file", problem.message) for problem in error.problems]
