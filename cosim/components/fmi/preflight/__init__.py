"""Preflight check of an FMU, made before any of its code runs and any of its files is extracted."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BufferedReader
from itertools import islice, starmap
from pathlib import Path

from ....core.errors import InputError
from . import rules_model, rules_variables
from .archive import Archive, open_regular_file
from .binary import check_binary
from .findings import (
    DESCRIPTION_FILE,
    FatalFindingError,
    Finding,
    raise_errors,
)
from .model_description import Interface, ModelDescription, Violation, to_finding
from .platforms import current_platform
from .xml import parse_xml
from .xml_reader import check_repeated_elements, read_model

_MAX_FINDINGS_PER_CHECK = 100
#: folders that a running FMU does not use
_UNUSED_FOLDERS = ("documentation", "sources")
_CHECKS: Sequence[Callable[[ModelDescription], Iterator[Violation]]] = (
    *rules_model.CHECKS,
    *rules_variables.CHECKS,
    rules_variables.check_starts,
    *rules_model.STRUCTURE_CHECKS,
    rules_variables.check_dimensions,
)


@dataclass
class Examination:
    """Result of the preflight check.

    Attributes:
        file_identity: Device, inode, size and modification time, to detect that the file is changed
            later.
        members: CRC-32 of each member of the archive, by name.
        model: Model description, None if it cannot be read.
        findings: Findings that do not depend on the platform.
        binary_findings: Findings about the binary for this platform, by interface.
    """

    file_identity: tuple[int, ...] = ()
    members: Mapping[str, int] = field(default_factory=dict)
    model: ModelDescription | None = None
    findings: list[Finding] = field(default_factory=list)
    binary_findings: dict[Interface, list[Finding]] = field(default_factory=dict)


def examine(path: Path) -> Examination:
    """Check archive, model description and binary of an FMU.

    Nothing is extracted or executed.

    Args:
        path: The FMU.

    Returns:
        The result; problems of the FMU itself are findings, not exceptions.

    Raises:
        InputError: The file does not exist, is not a regular file or cannot be read.
    """
    result = Examination()
    with open_regular_file(path) as file:
        result.file_identity = _file_identity(file)
        try:
            _examine_archive(Archive(file), result)
        except FatalFindingError as error:
            result.findings.append(error.finding)
        except OSError as error:
            raise InputError(f'FMU "{path}" cannot be read: {error.strerror}') from None
    return result


def _examine_archive(archive: Archive, result: Examination) -> None:
    """Check the archive; read and check its members only if it has no errors."""
    result.findings += archive.findings
    if _has_errors(archive.findings):
        return
    result.members = {name: entry.crc for name, entry in archive.members.items()}
    if DESCRIPTION_FILE not in archive.members:
        raise FatalFindingError(
            "archive.description", f"there is no member '{DESCRIPTION_FILE}' in the archive"
        )
    root = parse_xml(archive.read(DESCRIPTION_FILE), DESCRIPTION_FILE)
    model = result.model = read_model(root)
    result.findings += check_repeated_elements(root)
    for check in _CHECKS:
        result.findings += starmap(to_finding, islice(check(model), _MAX_FINDINGS_PER_CHECK))
    if not _has_errors(result.findings):
        for interface in model.interfaces:
            found = result.binary_findings[interface] = []
            try:
                found += check_binary(archive, model, interface, current_platform())
            except FatalFindingError as error:
                found.append(error.finding)


def _has_errors(findings: Sequence[Finding]) -> bool:
    return any(finding.severity == "error" for finding in findings)


def extract(path: Path, examination: Examination, folder: Path) -> None:
    """Extract the members of an examined FMU that it can use on this platform.

    Args:
        path: The FMU.
        examination: Result of the preflight check.
        folder: Folder that receives the files.

    Raises:
        InputError: The file was changed after the check, or contains damaged data.
    """
    assert examination.model is not None  # otherwise the FMU has errors and is not used
    binary_folder = current_platform().binary_folder(examination.model.major)

    def is_used(name: str) -> bool:
        """Return False for sources, documentation and binaries of other platforms."""
        first, _, rest = name.partition("/")
        return first not in _UNUSED_FOLDERS and (
            first != "binaries" or rest.partition("/")[0] == binary_folder
        )

    with open_regular_file(path) as file:
        try:
            if _file_identity(file) != examination.file_identity:
                raise FatalFindingError(
                    "archive.changed", "the file was changed after it had been examined"
                )
            archive = Archive(file)
            raise_errors(path, archive.findings)
            archive.extract(folder, is_used)
        except FatalFindingError as error:
            raise_errors(path, [error.finding])


def _file_identity(file: BufferedReader) -> tuple[int, ...]:
    status = os.fstat(file.fileno())
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns
