"""JUnit XML files, in which CI services read the outcomes of tests."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

from ..results.files import writing_atomically

_INVALID_XML_CHARACTERS = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class JUnitCase(NamedTuple):
    """Outcome of one test."""

    name: str
    #: "passed", "failure" (the result is not as expected) or "error" (there is no result)
    outcome: str
    #: wall time (s)
    seconds: float
    #: lines that describe a failure or an error
    details: Sequence[str] = ()


def write_junit(suite: str, cases: Sequence[JUnitCase], path: Path) -> None:
    """Write the cases as one test suite.

    Raises:
        InputError: The file cannot be written.
        OutputError: The disk is full or failed.
    """
    counts = {
        kind: str(sum(case.outcome == word for case in cases))
        for kind, word in _OUTCOME_COUNTERS.items()
    }
    attributes = {
        "name": suite,
        "tests": str(len(cases)),
        **counts,
        "time": f"{sum(case.seconds for case in cases):.3f}",
    }
    root = ElementTree.Element("testsuites")
    element = ElementTree.SubElement(root, "testsuite", attributes)
    for case in cases:
        _add_case(element, suite, case)
    ElementTree.indent(root)
    with writing_atomically(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


#: attribute of the suite that counts each outcome
_OUTCOME_COUNTERS = {"failures": "failure", "errors": "error"}


def _add_case(parent: ElementTree.Element, suite: str, case: JUnitCase) -> None:
    element = ElementTree.SubElement(
        parent, "testcase", classname=suite, name=case.name, time=f"{case.seconds:.3f}"
    )
    if case.outcome in _OUTCOME_COUNTERS.values():
        details = [_INVALID_XML_CHARACTERS.sub("?", line) for line in case.details]
        ElementTree.SubElement(
            element, case.outcome, message=details[0] if details else ""
        ).text = "\n".join(details)
