"""Rules of the preflight check, and findings of their violations."""

from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple

from ....core.errors import InputError
from ....core.text import escape_control_characters

DESCRIPTION_FILE = "modelDescription.xml"
#: errors that one message lists
_MAX_SHOWN = 100

#: source, a section of the standard or another reason -> ids of the rules that are from it
_RULES_BY_SOURCE = {
    "APPNOTE 4.3": "archive.zip",
    "APPNOTE 4.3.12": "archive.contents",
    "APPNOTE 4.3.16": "archive.trailing-data",
    "APPNOTE 4.3.7": "archive.header",
    "APPNOTE 4.3.8": "archive.data",
    "CVE-2024-0450": "archive.overlap",
    "FMI 1.0 ME section 3.1, FMI 2.0.5 section 2.2.1": "model.count",
    "FMI 2.0.5 section 2.1.4, FMI 3.0.2 section 2.2.4": "binary.version",
    "FMI 2.0.5 section 2.2, FMI 3.0.2 section 2.4": "xml.encoding",
    "FMI 2.0.5 section 2.2.1, FMI 3.0.2 section 2.4.1": """
        model.empty-token model.name model.repeated model.root model.token model.version
    """,
    "FMI 2.0.5 section 2.2.2, FMI 3.0.2 section 2.4.3": """
        unit.base unit.unique variable.display-unit variable.unit
    """,
    "FMI 2.0.5 section 2.2.3, FMI 3.0.2 section 2.4.4": "type.items type.kind type.unique",
    "FMI 2.0.5 section 2.2.4, FMI 3.0.2 section 2.4.5": "categories.unique",
    "FMI 2.0.5 section 2.2.5, FMI 3.0.2 section 2.4.6": "experiment.order experiment.value",
    "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7": """
        variable.name variable.type variable.unique
    """,
    "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.4": """
        reference.alias reference.shared reference.value variable.combination variable.continuous
        variable.implied-continuous variable.independent variable.word
    """,
    "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.5": """
        start.finite start.infinite start.missing start.range start.unwanted start.value
        variable.declared-type variable.derivative variable.initial variable.initial-not-allowed
        variable.limit-value variable.limits variable.other-type
    """,
    "FMI 2.0.5 section 2.2.8, FMI 3.0.2 section 2.4.8": """
        structure.dependencies structure.derivatives structure.initial-unknowns structure.outputs
        structure.reference structure.unique
    """,
    "FMI 2.0.5 section 2.2.9, FMI 3.0.2 section 2.4.7.5.1": "variable.convention",
    "FMI 2.0.5 section 2.3, FMI 3.0.2 section 2.5": """
        archive.collision archive.compression archive.description archive.encryption archive.file
        archive.gap archive.kind archive.name archive.name-form archive.repeated
    """,
    "FMI 2.0.5 section 2.3, FMI 3.0.2 section 2.5.1": """
        binary.format binary.needed binary.platform binary.present binary.sources-only
        binary.windows-only
    """,
    "FMI 2.0.5 section 4.3.1, FMI 3.0.2 sections 2.4.2 and 4.4": """
        model.identifier model.interface model.library-name
    """,
    "FMI 2.0.5 sections 2.1 and 4.2, FMI 3.0.2 section 2.5": """
        binary.functions binary.unused-functions
    """,
    "FMI 3.0.2 section 2.4.7.2": "variable.dimension",
    "FMI 3.0.2 section 2.4.7.4": "variable.clocks",
    "FMI 3.0.2 section 2.4.7.5": "start.count",
    "XML 1.0": "xml.syntax",
    "XML schemas of FMI 1.0.1, 2.0.5 and 3.0.2": "xml.schema",
    "limits": "archive.changed archive.size binary.size variable.size xml.size",
    "safety: entities": "xml.doctype",
}
#: rules whose violations do not prevent a run; those of the others do
_WARNINGS = frozenset(
    [
        "archive.gap",
        "archive.name-form",
        "archive.repeated",
        "binary.needed",
        "binary.sources-only",
        "binary.unused-functions",
        "binary.version",
        "binary.windows-only",
        "categories.unique",
        "experiment.order",
        "experiment.value",
        "model.empty-token",
        "model.identifier",
        "model.name",
        "reference.alias",
        "start.infinite",
        "start.missing",
        "start.range",
        "start.unwanted",
        "structure.dependencies",
        "structure.derivatives",
        "structure.initial-unknowns",
        "structure.outputs",
        "structure.unique",
        "type.kind",
        "variable.combination",
        "variable.continuous",
        "variable.convention",
        "variable.declared-type",
        "variable.display-unit",
        "variable.implied-continuous",
        "variable.independent",
        "variable.initial",
        "variable.initial-not-allowed",
        "variable.limit-value",
        "variable.limits",
        "variable.unique",
        "variable.unit",
        "xml.schema",
    ]
)
#: warnings about what may change the results of a run
RUN_WARNINGS = frozenset(
    [
        "archive.name-form",
        "archive.repeated",
        "experiment.value",
        "model.empty-token",
        "model.identifier",
        "start.missing",
        "start.range",
        "structure.outputs",
        "variable.combination",
        "variable.continuous",
        "variable.declared-type",
        "variable.initial",
        "variable.limits",
        "variable.unique",
        "variable.unit",
    ]
)


class Finding(NamedTuple):
    """Violation of a rule of the FMI standard, of a file format or for safety.

    Attributes:
        rule: Id of the rule, such as "archive.name".
        message: What was found and what was expected.
        member: Member of the archive, if the finding belongs to one.
        line: Line in the member, or 0.
    """

    rule: str
    message: str
    member: str = ""
    line: int = 0

    @property
    def severity(self) -> Literal["error", "warning"]:
        """An "error" prevents a run, a "warning" does not; see also `RUN_WARNINGS`."""
        return "warning" if self.rule in _WARNINGS else "error"

    @property
    def source(self) -> str:
        """Section of the standard, or another reason for the rule."""
        return next(
            source for source, rules in _RULES_BY_SOURCE.items() if self.rule in rules.split()
        )

    @property
    def location(self) -> str:
        """Member and line, such as "modelDescription.xml:12", or less if they are unknown."""
        return escape_unprintable(self.member) + (f":{self.line}" if self.line else "")

    def __str__(self) -> str:
        prefix = f"{self.location}: " if self.location else ""
        return f"{prefix}{escape_unprintable(self.message)} [{self.rule}, {self.source}]"


class FatalFindingError(Exception):
    """Finding that ends the check, because nothing after it can be read."""

    def __init__(self, rule: str, message: str, member: str = "", line: int = 0):
        self.finding = Finding(rule, message, member, line)
        super().__init__(str(self.finding))


def raise_errors(path: Path, findings: Iterable[Finding]) -> None:
    """Raise the errors among some findings, if there are any.

    Args:
        path: The FMU, for messages.
        findings: Errors and warnings.

    Raises:
        InputError: There are errors; it lists at most the first 100 and the number of the others.
    """
    errors = [finding for finding in findings if finding.severity == "error"]
    lines = [f'"{path}": {finding}' for finding in dict.fromkeys(errors[:_MAX_SHOWN])]
    if (hidden := len(errors) - _MAX_SHOWN) > 0:
        lines.append(f'"{path}": and {hidden} more error{"s" if hidden > 1 else ""}')
    if lines:
        raise InputError(lines)


def escape_unprintable(text: str, length: int = 300) -> str:
    """Return text of an FMU as one line without control characters.

    The line has at most `length` characters.
    """
    escaped = escape_control_characters(text[: length + 1])
    return escaped if len(escaped) <= length else escaped[: length - 3] + "..."
