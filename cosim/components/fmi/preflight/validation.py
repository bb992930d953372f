"""What `cosim validate` examines beyond what a run needs: every byte of the archive, every XML file, the XML schemas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from . import Examination, examine
from .archive import Archive, open_file
from .findings import Finding, Flaw
from .limits import LIMITS, Limits
from .schema import SCHEMAS, check_schema
from .xml import parse

#: beyond, the XML schemas are left out: they compare each variable with each other one
MOST_VARIABLES = 10_000


def validate(path: Path, limits: Limits = LIMITS) -> Sequence[Finding]:
    """All findings about an FMU, errors first. Raises InputError when there is no such file."""
    examination = examine(path, limits)
    found = [*examination.findings, *examination.binary]
    if examination.members:
        with open_file(path) as file:
            archive = Archive(file, limits)
            found += archive.verify()
            if all(finding.rule.severity == "warning" for finding in found):
                found += _documents(archive, examination, limits)
    known = {finding.place for finding in found if finding.line and finding.rule.name != "xml.schema"}
    # the schemas often say once more, and less clearly, what a rule has said
    kept = [finding for finding in found if finding.rule.name != "xml.schema" or finding.place not in known]
    return sorted(dict.fromkeys(kept), key=lambda finding: finding.rule.severity)


def _documents(archive: Archive, examination: Examination, limits: Limits) -> Iterator[Finding]:
    model = examination.model
    assert model is not None  # anything else is an error
    for version, member in SCHEMAS:
        if version == model.major and member in archive.members:
            try:
                root = parse(archive.read(member), member, limits)
                if len(model.variables) <= MOST_VARIABLES:
                    yield from check_schema(root, member, model.major)
            except Flaw as flaw:
                yield flaw.finding
