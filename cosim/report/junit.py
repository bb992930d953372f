"""JUnit XML, the form in which CI services read which tests passed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ..results.files import writing_atomically

_INVALID_XML_CHARACTERS = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class JUnitCase(NamedTuple):
    """One test: it passed ("passed"), its result is not as expected ("failure"), or there is none ("error").

    `seconds` is its wall time, `details` says line by line what is wrong.
    """

    name: str
    outcome: str
    seconds: float
    details: Sequence[str] = ()


def write_junit(suite: str, cases: Sequence[JUnitCase], path: Path) -> None:
    """Write all cases as one suite; raises InputError when the file cannot be written."""
    counts = {kind: str(sum(case.outcome == word for case in cases)) for kind, word in _OUTCOME_COUNTERS.items()}
    about = {"name": suite, "tests": str(len(cases)), **counts, "time": f"{sum(case.seconds for case in cases):.3f}"}
    root = ElementTree.Element("testsuites")
    element = ElementTree.SubElement(root, "testsuite", about)
    for case in cases:
        _add_case(element, suite, case)
    ElementTree.indent(root)
    with writing_atomically(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


_OUTCOME_COUNTERS = {"failures": "failure", "errors": "error"}


def _add_case(parent: ElementTree.Element, suite: str, case: JUnitCase) -> None:
    element = ElementTree.SubElement(parent, "testcase", classname=suite, name=case.name, time=f"{case.seconds:.3f}")
    if case.outcome in _OUTCOME_COUNTERS.values():
        details = [_INVALID_XML_CHARACTERS.sub("?", line) for line in case.details]
        ElementTree.SubElement(element, case.outcome, message=details[0] if details else "").text = "\n".join(details)
