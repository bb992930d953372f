"""Complete check of an FMU for `cosim validate`.

All data of the archive, and all XML files against their schemas.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

from . import Examination, examine
from .archive import Archive, open_regular_file
from .findings import FatalFindingError, Finding
from .limits import DEFAULT_LIMITS, PreflightLimits
from .schema import SCHEMA_FILES, check_schema
from .xml import parse_xml

#: largest model that is checked by schemas, because their uniqueness constraints take quadratic
#: time
MAX_SCHEMA_VARIABLES = 10_000


def validate_fmu(path: Path, limits: PreflightLimits = DEFAULT_LIMITS) -> Sequence[Finding]:
    """Check an FMU completely.

    Args:
        path: The FMU.
        limits: Limits of the check.

    Returns:
        All findings, errors first.

    Raises:
        InputError: The file does not exist or cannot be read.
    """
    examination = examine(path, limits)
    findings = [*examination.findings, *chain.from_iterable(examination.binary_findings.values())]
    if examination.members:
        with open_regular_file(path) as file:
            archive = Archive(file, limits)
            findings += archive.verify()
            if all(finding.rule.severity == "warning" for finding in findings):
                findings += _check_xml_files(archive, examination, limits)
    # a schema often reports, less clearly, the same problem as a rule
    locations = {
        finding.location
        for finding in findings
        if finding.line and finding.rule.name != "xml.schema"
    }
    unique = [
        finding
        for finding in findings
        if finding.rule.name != "xml.schema" or finding.location not in locations
    ]
    return sorted(dict.fromkeys(unique), key=lambda finding: finding.rule.severity)


def _check_xml_files(
    archive: Archive, examination: Examination, limits: PreflightLimits
) -> Iterator[Finding]:
    model = examination.model
    assert model is not None  # otherwise the examination has found an error
    for version, member in SCHEMA_FILES:
        if version == model.major and member in archive.members:
            try:
                root = parse_xml(archive.read(member), member, limits)
                if len(model.variables) <= MAX_SCHEMA_VARIABLES:
                    yield from check_schema(root, member, model.major)
            except FatalFindingError as error:
                yield error.finding
