"""What an examination of an FMU finds, and which rule says so."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ....core.errors import InputError

Severity = Literal["error", "warning"]
DESCRIPTION_FILE = "modelDescription.xml"
_MAX_SHOWN = 100


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule of the standard or of caution. An FMU that breaks an error is not run; a warning is only reported by `validate`."""

    name: str
    source: str
    severity: Severity = "error"

    def __call__(self, message: str, member: str = "", line: int = 0) -> Finding:
        """The finding that an FMU breaks this rule, in `member` of the archive, at `line` of it (0: nowhere special)."""
        return Finding(self, message, member, line)


@dataclass(frozen=True, slots=True)
class Finding:
    """One broken rule: what was found and expected, and where."""

    rule: Rule
    message: str
    member: str = ""
    line: int = 0

    @property
    def location(self) -> str:
        """ "modelDescription.xml:12", or less where less is known."""
        return escape_unprintable(self.member) + (f":{self.line}" if self.line else "")

    def __str__(self) -> str:
        place = f"{self.location}: " if self.location else ""
        return f"{place}{escape_unprintable(self.message)} [{self.rule.name}, {self.rule.source}]"


class FatalFinding(Exception):
    """A finding after which nothing more can be examined."""

    def __init__(self, finding: Finding):
        super().__init__(str(finding))
        self.finding = finding


def raise_errors(path: Path, findings: Iterable[Finding]) -> None:
    """Raises InputError with all errors among the findings; of very many, with the first ones and their number."""
    errors = [finding for finding in findings if finding.rule.severity == "error"]
    lines = [f'"{path}": {finding}' for finding in dict.fromkeys(errors[:_MAX_SHOWN])]
    if len(errors) > _MAX_SHOWN:
        lines.append(f'"{path}": and {len(errors) - _MAX_SHOWN} more errors')
    if lines:
        raise InputError(lines)


def escape_unprintable(text: str, length: int = 300) -> str:
    """Text of an FMU on one line: control characters are made visible, what is very long is shortened."""
    text = text[: length + 1]
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)
    return shown if len(shown) <= length else shown[: length - 3] + "..."
