"""Rules and limits of the preflight check, and findings of violations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ....core.errors import InputError
from ....core.text import escape_control_characters

Severity = Literal["error", "warning"]
DESCRIPTION_FILE = "modelDescription.xml"
#: errors that one message lists
_MAX_SHOWN = 100


@dataclass(frozen=True, slots=True)
class Rule:
    """Rule of the FMI standard, of a file format or for safety.

    Attributes:
        name: Rule id, such as "archive.name".
        source: Section of the standard, or another reason.
        severity: "error" for an FMU that is not run, "warning" for one that is run, with a message
            if the rule is one of `RUN_WARNINGS`.
    """

    name: str
    source: str
    severity: Severity = "error"

    def __call__(self, message: str, member: str = "", line: int = 0) -> Finding:
        """Create a finding that an FMU violates this rule.

        Args:
            message: What was found and what was expected.
            member: Member of the archive, if the finding belongs to one.
            line: Line in the member, or 0.
        """
        return Finding(self, message, member, line)


@dataclass(frozen=True, slots=True)
class Finding:
    """Violation of a rule, with its place in the FMU; see `Rule.__call__`."""

    rule: Rule
    message: str
    member: str = ""
    line: int = 0

    @property
    def location(self) -> str:
        """Member and line, such as "modelDescription.xml:12", or less if they are unknown."""
        return escape_unprintable(self.member) + (f":{self.line}" if self.line else "")

    def __str__(self) -> str:
        prefix = f"{self.location}: " if self.location else ""
        return f"{prefix}{escape_unprintable(self.message)} [{self.rule.name}, {self.rule.source}]"


class FatalFindingError(Exception):
    """Finding that ends the check, because nothing after it can be read."""

    def __init__(self, finding: Finding):
        super().__init__(str(finding))
        self.finding = finding


def raise_errors(path: Path, findings: Iterable[Finding]) -> None:
    """Raise the errors among some findings, if there are any.

    Args:
        path: The FMU, for messages.
        findings: Errors and warnings.

    Raises:
        InputError: There are errors; it lists at most the first 100 and the number of the others.
    """
    errors = [finding for finding in findings if finding.rule.severity == "error"]
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
