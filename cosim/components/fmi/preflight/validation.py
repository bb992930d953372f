"""What `cosim validate` examines beyond what a run needs: every byte of the archive, every XML file, the XML schemas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from . import Examination, examine
from .archive import Archive, open_regular_file
from .findings import FatalFinding, Finding
from .limits import DEFAULT_LIMITS, PreflightLimits
from .schema import SCHEMA_FILES, check_schema
from .xml import parse_xml

#: beyond, the XML schemas are left out: they compare each variable with each other one
MAX_SCHEMA_VARIABLES = 10_000


def validate_fmu(path: Path, limits: PreflightLimits = DEFAULT_LIMITS) -> Sequence[Finding]:
    """All findings about an FMU, errors first. Raises InputError when there is no such file."""
    examination = examine(path, limits)
    found = [*examination.findings, *examination.binary_findings]
    if examination.members:
        with open_regular_file(path) as file:
            archive = Archive(file, limits)
            found += archive.verify()
            if all(finding.rule.severity == "warning" for finding in found):
                found += _check_xml_files(archive, examination, limits)
    known = {finding.location for finding in found if finding.line and finding.rule.name != "xml.schema"}
    # the schemas often say once more, and less clearly, what a rule has said
    kept = [finding for finding in found if finding.rule.name != "xml.schema" or finding.location not in known]
    return sorted(dict.fromkeys(kept), key=lambda finding: finding.rule.severity)


def _check_xml_files(archive: Archive, examination: Examination, limits: PreflightLimits) -> Iterator[Finding]:
    model = examination.model
    assert model is not None  # anything else is an error
    for version, member in SCHEMA_FILES:
        if version == model.major and member in archive.members:
            try:
                root = parse_xml(archive.read(member), member, limits)
                if len(model.variables) <= MAX_SCHEMA_VARIABLES:
                    yield from check_schema(root, member, model.major)
            except FatalFinding as flaw:
                yield flaw.finding
