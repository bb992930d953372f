"""What is examined of an FMU before any of its code runs or any of its files is written."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from io import BufferedReader
from itertools import islice
from pathlib import Path

from ....core.errors import InputError
from . import rules_model, rules_structure, rules_values, rules_variables
from .archive import Archive, open_file
from .binary import check_binary
from .findings import DESCRIPTION, Finding, Flaw, Rule, refuse
from .limits import LIMITS, Limits
from .model_description import Model
from .platform import this_machine
from .xml import parse
from .xml_reader import read_model, repeated

__all__ = ["DESCRIPTION", "LIMITS", "Examination", "Finding", "Limits", "examine", "extract", "open_file", "refuse"]

MISSING = Rule("archive.description", "FMI 2.0.5 section 2.3, FMI 3.0.2 section 2.5")
CHANGED = Rule("archive.changed", "limits")
#: of one check; who has that many will look at the first ones first
_MOST_FINDINGS = 100
_CHECKS: Sequence[Callable[[Model], Iterator[Finding]]] = (
    *rules_model.CHECKS,
    *rules_variables.CHECKS,
    rules_values.check_starts,
    *rules_structure.CHECKS,
)


@dataclass
class Examination:
    """What was found. `model` is None when its description cannot be read; `binary` are findings about this machine.

    `stamp` tells whether the file is still the one that was examined.
    """

    stamp: tuple[int, ...] = ()
    members: Sequence[str] = ()
    model: Model | None = None
    findings: list[Finding] = field(default_factory=list)
    binary: list[Finding] = field(default_factory=list)


def examine(path: Path, limits: Limits = LIMITS) -> Examination:
    """Examine archive, model description and binary of an FMU; nothing is written, and nothing of it is executed.

    Raises InputError when there is no such file. What is wrong with the FMU itself is in the findings.
    """
    result = Examination()
    with open_file(path) as file:
        result.stamp = _stamp(file)
        try:
            _examine(Archive(file, limits), limits, result)
        except Flaw as flaw:
            result.findings.append(flaw.finding)
        except OSError as error:
            raise InputError(f'FMU "{path}" cannot be read: {error.strerror}') from None
    return result


def _examine(archive: Archive, limits: Limits, result: Examination) -> None:
    """In order of need: what is wrong with the archive is told before anything in it is read."""
    result.findings += archive.findings
    if _has_errors(archive.findings):
        return
    result.members = list(archive.members)
    if DESCRIPTION not in archive.members:
        raise Flaw(MISSING(f"There is no item named '{DESCRIPTION}' in the archive"))
    root = parse(archive.read(DESCRIPTION), DESCRIPTION, limits)
    model = result.model = read_model(root)
    result.findings += repeated(root)
    for check in _CHECKS:
        result.findings += islice(check(model), _MOST_FINDINGS)
    result.findings += islice(rules_values.check_dimensions(model, limits), _MOST_FINDINGS)
    if not _has_errors(result.findings):
        result.binary += _binary_findings(archive, model, limits)


def _binary_findings(archive: Archive, model: Model, limits: Limits) -> Iterator[Finding]:
    try:
        yield from check_binary(archive, model, this_machine(), limits)
    except Flaw as flaw:
        yield flaw.finding


def _has_errors(findings: Sequence[Finding]) -> bool:
    return any(finding.rule.severity == "error" for finding in findings)


def extract(path: Path, examination: Examination, folder: Path, limits: Limits = LIMITS) -> None:
    """Write the members of an examined FMU below `folder`.

    Raises InputError when the file is no longer the one that was examined, is not safe, or holds damaged data.
    """
    with open_file(path) as file:
        try:
            if _stamp(file) != examination.stamp:
                raise Flaw(CHANGED("the file was changed after it had been examined"))
            archive = Archive(file, limits)
            refuse(path, archive.findings)
            archive.extract(folder)
        except Flaw as flaw:
            refuse(path, [flaw.finding])


def _stamp(file: BufferedReader) -> tuple[int, ...]:
    status = os.fstat(file.fileno())
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
