"""Check of XML files against the XML schemas of FMI, which find misspelt and misplaced elements and attributes."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lxml import etree

from .findings import DESCRIPTION_FILE, Finding, Rule

SCHEMA = Rule("xml.schema", "XML schemas of FMI 1.0.1, 2.0.5 and 3.0.2", "warning")
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
            yield SCHEMA(error.message.rstrip("."), member, error.line)
