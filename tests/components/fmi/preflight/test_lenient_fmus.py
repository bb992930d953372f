"""FMUs that deviate from the standard in ways that do not change their results: they run, with one
line of warning.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from bad_fmus import find_problems, members, pack_archive
from cosim_command import run_cosim

Files = dict[str, bytes]
Change = Callable[[Files], list[tuple[str, bytes]]]

LIBRARY = "binaries/linux64/probe.so"


def described(old: str, new: str, identifier: str = "probe") -> Change:
    """Replace a text of the model description, and the name of the library."""

    def change(files: Files) -> list[tuple[str, bytes]]:
        text = files["modelDescription.xml"].decode()
        assert old in text
        changed = files | {"modelDescription.xml": text.replace(old, new, 1).encode()}
        return [
            (name.replace("/probe.so", f"/{identifier}.so"), content)
            for name, content in changed.items()
        ]

    return change


def renamed(new_name: Callable[[str], str]) -> Change:
    """Rename all members."""
    return lambda files: [(new_name(name), content) for name, content in files.items()]


#: case -> (FMI major version, change of the probe FMU, rule of the warning)
DEVIATIONS: dict[str, tuple[int, Change, str]] = {
    "identifier that is no C identifier": (
        2,
        described('modelIdentifier="probe"', 'modelIdentifier="water-tank"', "water-tank"),
        "model.identifier",
    ),
    "start of a String as attribute": (
        3,
        described('causality="input"><Start value=""/>', 'causality="input" start="text">'),
        "xml.schema",
    ),
    "input without start": (
        2,
        described('<Real start="0" unit="m"/>', '<Real unit="m"/>'),
        "start.missing",
    ),
    "empty token": (2, described('guid="probe"', 'guid=""'), "model.empty-token"),
    "constant parameter": (
        2,
        described(
            'causality="parameter" variability="tunable"',
            'causality="parameter" variability="constant"',
        ),
        "variable.combination",
    ),
    "continuous Boolean": (
        2,
        described(
            'causality="input" variability="discrete"><Boolean',
            'causality="input" variability="continuous"><Boolean',
        ),
        "variable.continuous",
    ),
    "names that begin with ./": (2, renamed(lambda name: f"./{name}"), "archive.name-form"),
    "backslashes": (2, renamed(lambda name: name.replace("/", "\\")), "archive.name-form"),
    "entry ./": (2, lambda files: [("./", b""), *files.items()], "archive.name-form"),
    "folder twice": (
        2,
        lambda files: [("extra/", b""), ("extra/", b""), *files.items()],
        "archive.repeated",
    ),
    "file twice": (
        2,
        lambda files: [("extra/a.txt", b"a"), ("extra/a.txt", b"a"), *files.items()],
        "archive.repeated",
    ),
}


@pytest.mark.parametrize("case", DEVIATIONS)
def test_a_harmless_deviation_is_a_warning(case, good, tmp_path):
    version, change, rule = DEVIATIONS[case]
    path = tmp_path / "deviating.fmu"
    changed = []
    for pair in change(good[version]):
        changed += members(dict([pair]))
    path.write_bytes(pack_archive(changed))
    assert rule in {
        finding.rule for finding in find_problems(path) if finding.severity == "warning"
    }
    done = run_cosim("simulate", path)
    assert (done.returncode, "y = 0.0175" in done.stdout) == (0, True), done
    assert len(done.stderr.splitlines()) == (rule != "xml.schema"), done.stderr


def test_a_missing_function_that_no_capability_promises_is_not_needed(good, tmp_path):
    library = (
        good[2][LIBRARY]
        .replace(b"fmi2GetFMUstate\0", b"fmi2GetNothing_\0")
        .replace(b"fmi2CancelStep\0", b"fmi2Cancel_Ste\0")
    )
    path = tmp_path / "old.fmu"
    path.write_bytes(pack_archive(members(good[2] | {LIBRARY: library})))
    promised = [f.message for f in find_problems(path) if f.rule == "binary.functions"]
    assert promised == ["the library does not export fmi2GetFMUstate"]
    text = good[2]["modelDescription.xml"].replace(b'canGetAndSetFMUstate="true"', b"")
    path.write_bytes(
        pack_archive(members(good[2] | {LIBRARY: library, "modelDescription.xml": text}))
    )
    findings = {(f.rule, f.severity) for f in find_problems(path)}
    assert findings == {("binary.unused-functions", "warning")}
    assert run_cosim("simulate", path).returncode == 0
