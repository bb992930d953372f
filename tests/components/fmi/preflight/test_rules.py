"""The table of the rules of the preflight check."""

import re
from pathlib import Path

from cosim.components.fmi import preflight
from cosim.components.fmi.preflight import findings

FOLDER = Path(preflight.__file__).parent


def test_each_rule_has_one_source_and_is_used():
    listed = " ".join(findings._RULES_BY_SOURCE.values()).split()
    groups = "|".join({rule.split(".")[0] for rule in listed})
    used = {"archive.file"}  # of the command, about a file that cannot be read
    for path in FOLDER.glob("*.py"):
        used.update(re.findall(rf'"((?:{groups})\.[a-z-]+)"', path.read_text()))
    assert sorted(used) == sorted(listed)


def test_each_warning_is_a_rule():
    listed = set(" ".join(findings._RULES_BY_SOURCE.values()).split())
    assert findings.RUN_WARNINGS <= findings._WARNINGS <= listed
