"""Complete check of an FMU for `cosim validate`.

All data of the archive, and all XML files against their schemas.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

from lxml import etree

from . import Examination, examine
from .archive import Archive, open_regular_file
from .findings import DESCRIPTION_FILE, FatalFindingError, Finding
from .xml import parse_xml

#: (FMI major version, member of the archive) -> schema file of FMPy
SCHEMA_FILES = {
    (1, DESCRIPTION_FILE): "fmi1/fmiModelDescription.xsd",
    (2, DESCRIPTION_FILE): "fmi2/fmi2ModelDescription.xsd",
    (3, DESCRIPTION_FILE): "fmi3/fmi3ModelDescription.xsd",
    (3, "sources/buildDescription.xml"): "fmi3/fmi3BuildDescription.xsd",
    (3, "terminalsAndIcons/terminalsAndIcons.xml"): "fmi3/fmi3TerminalsAndIcons.xsd",
}


@cache
def _load_schema(name: str) -> Any:
    """Load a schema from the copies that FMPy contains."""
    fmpy = find_spec("fmpy")
    assert fmpy is not None
    assert fmpy.origin is not None
    return etree.XMLSchema(file=str(Path(fmpy.origin).parent / "schema" / name))


def check_schema(root: Any, member: str, major: int) -> Iterator[Finding]:
    """Check an XML document against its schema.

    Args:
        root: Root element.
        member: Member of the archive, a key of `SCHEMA_FILES`.
        major: FMI major version.
    """
    schema = _load_schema(SCHEMA_FILES[major, member])
    if not schema.validate(root):
        for error in schema.error_log:
            yield Finding("xml.schema", error.message.rstrip("."), member, error.line)


#: largest model that is checked by schemas, because their uniqueness constraints take quadratic
#: time
MAX_SCHEMA_VARIABLES = 10_000


def validate_fmu(path: Path) -> Sequence[Finding]:
    """Check an FMU completely.

    Args:
        path: The FMU.

    Returns:
        All findings, errors first.

    Raises:
        InputError: The file does not exist or cannot be read.
    """
    examination = examine(path)
    findings = [*examination.findings, *chain.from_iterable(examination.binary_findings.values())]
    if examination.members:
        with open_regular_file(path) as file:
            archive = Archive(file)
            findings += archive.verify()
            if all(finding.severity == "warning" for finding in findings):
                findings += _check_xml_files(archive, examination)
    # a schema often reports, less clearly, the same problem as a rule
    locations = {
        finding.location for finding in findings if finding.line and finding.rule != "xml.schema"
    }
    unique = [
        finding
        for finding in findings
        if finding.rule != "xml.schema" or finding.location not in locations
    ]
    return sorted(dict.fromkeys(unique), key=lambda finding: finding.severity)


def _check_xml_files(archive: Archive, examination: Examination) -> Iterator[Finding]:
    model = examination.model
    assert model is not None  # otherwise the examination has found an error
    for version, member in SCHEMA_FILES:
        if version == model.major and member in archive.members:
            try:
                root = parse_xml(archive.read(member), member)
                if len(model.variables) <= MAX_SCHEMA_VARIABLES:
                    yield from check_schema(root, member, model.major)
            except FatalFindingError as error:
                yield error.finding
