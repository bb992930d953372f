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
from .archive import Archive, open_regular_file
from .binary import check_binary
from .findings import DESCRIPTION_FILE, FatalFinding, Finding, Rule, raise_errors
from .fmu_platform import current_platform
from .limits import DEFAULT_LIMITS, PreflightLimits
from .model_description import ModelDescription
from .xml import parse_xml
from .xml_reader import check_repeated_elements, read_model

__all__ = [
    "DEFAULT_LIMITS",
    "DESCRIPTION_FILE",
    "Examination",
    "Finding",
    "PreflightLimits",
    "examine",
    "extract",
    "open_regular_file",
    "raise_errors",
]

MISSING = Rule("archive.description", "FMI 2.0.5 section 2.3, FMI 3.0.2 section 2.5")
CHANGED = Rule("archive.changed", "limits")
#: of one check; who has that many will look at the first ones first
_MAX_FINDINGS_PER_CHECK = 100
_CHECKS: Sequence[Callable[[ModelDescription], Iterator[Finding]]] = (
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

    file_identity: tuple[int, ...] = ()
    members: Sequence[str] = ()
    model: ModelDescription | None = None
    findings: list[Finding] = field(default_factory=list)
    binary_findings: list[Finding] = field(default_factory=list)


def examine(path: Path, limits: PreflightLimits = DEFAULT_LIMITS) -> Examination:
    """Examine archive, model description and binary of an FMU; nothing is written, and nothing of it is executed.

    Raises InputError when there is no such file. What is wrong with the FMU itself is in the findings.
    """
    result = Examination()
    with open_regular_file(path) as file:
        result.file_identity = _file_identity(file)
        try:
            _examine_archive(Archive(file, limits), limits, result)
        except FatalFinding as flaw:
            result.findings.append(flaw.finding)
        except OSError as error:
            raise InputError(f'FMU "{path}" cannot be read: {error.strerror}') from None
    return result


def _examine_archive(archive: Archive, limits: PreflightLimits, result: Examination) -> None:
    """In order of need: what is wrong with the archive is told before anything in it is read."""
    result.findings += archive.findings
    if _has_errors(archive.findings):
        return
    result.members = list(archive.members)
    if DESCRIPTION_FILE not in archive.members:
        raise FatalFinding(MISSING(f"There is no item named '{DESCRIPTION_FILE}' in the archive"))
    root = parse_xml(archive.read(DESCRIPTION_FILE), DESCRIPTION_FILE, limits)
    model = result.model = read_model(root)
    result.findings += check_repeated_elements(root)
    for check in _CHECKS:
        result.findings += islice(check(model), _MAX_FINDINGS_PER_CHECK)
    result.findings += islice(rules_values.check_dimensions(model, limits), _MAX_FINDINGS_PER_CHECK)
    if not _has_errors(result.findings):
        result.binary_findings += _binary_findings(archive, model, limits)


def _binary_findings(archive: Archive, model: ModelDescription, limits: PreflightLimits) -> Iterator[Finding]:
    try:
        yield from check_binary(archive, model, current_platform(), limits)
    except FatalFinding as flaw:
        yield flaw.finding


def _has_errors(findings: Sequence[Finding]) -> bool:
    return any(finding.rule.severity == "error" for finding in findings)


def extract(path: Path, examination: Examination, folder: Path, limits: PreflightLimits = DEFAULT_LIMITS) -> None:
    """Write the members of an examined FMU below `folder`.

    Raises InputError when the file is no longer the one that was examined, is not safe, or holds damaged data.
    """
    with open_regular_file(path) as file:
        try:
            if _file_identity(file) != examination.file_identity:
                raise FatalFinding(CHANGED("the file was changed after it had been examined"))
            archive = Archive(file, limits)
            raise_errors(path, archive.findings)
            archive.extract(folder)
        except FatalFinding as flaw:
            raise_errors(path, [flaw.finding])


def _file_identity(file: BufferedReader) -> tuple[int, ...]:
    status = os.fstat(file.fileno())
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
