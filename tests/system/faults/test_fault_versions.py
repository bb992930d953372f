"""FMUs that deviate from the standard in ways that `cosim run` accepts with a warning: version,
platform, outputs, units.
"""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT, FaultFmus, scenario

#: FMI version, text in the library, another text, warning
TEXTS = [
    (2, b"\0002.0\0", b"\0001.0\0", 'fmi2GetVersion returns "1.0", expected "2.0"'),
    (
        2,
        b"\0default\0",
        b"\0standrd\0",
        'fmi2GetTypesPlatform returns "standrd", expected "default"',
    ),
    (3, b"\0003.0\0", b"\0002.0\0", 'fmi3GetVersion returns "2.0", expected "3.0"'),
]
LISTED = {2: '<Outputs><Unknown index="2"/></Outputs>', 3: '<Output valueReference="2"/>'}
OUTPUT = {2: 'initial="calculated"><Real', 3: '<Float64 name="y" valueReference="2"'}
PLACE = {2: "modelDescription.xml:7", 3: "modelDescription.xml:8"}
UNLISTED = 'variable "y": is an output but is missing in the outputs of the model structure'
UNDEFINED = 'variable "y": the unit "bar" is not defined'


@pytest.mark.parametrize("isolation", ["none", "run", "fmu"])
@pytest.mark.parametrize(("version", "old", "new", "text"), TEXTS)
def test_a_wrong_version_or_platform_is_one_warning(
    fault_libraries, runner, tmp_path, version, old, new, text, isolation
):
    """Two instances of one FMU: the file has one warning."""
    library = tmp_path / "fault.so"
    content = fault_libraries[version].read_bytes()
    assert content.count(old) == 1
    library.write_bytes(content.replace(old, new))
    fmu = FaultFmus({version: library}, tmp_path)(version)
    file = scenario(
        tmp_path, fmu, components={name: {"fmu": str(fmu)} for name in ("lag", "other")}
    )
    done = runner.cosim(
        tmp_path, "run", file, "--output-dir", "out", "--no-report", "--isolation", isolation
    )
    assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1), done.err
    warnings = [f"WARNING {name}: {text}" for name in ("lag", "other")]
    assert done.err.splitlines() == (warnings if isolation == "fmu" else warnings[:1])


@pytest.mark.parametrize("function", ["GetVersion", "GetTypesPlatform"])
def test_a_null_pointer_is_a_warning_too(fmus, runner, tmp_path, function):
    done = runner.simulate(tmp_path, fmus(2, f"{function} 1 error"))
    assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1), done.err
    assert f"WARNING Lag: fmi2{function} returns a null pointer, expected" in done.err


@pytest.mark.parametrize("what", ["segv", "exit_0", "abort"])
def test_a_crash_there_names_component_and_function(fmus, runner, tmp_path, version, what):
    done = runner.run(tmp_path, fmus(version, f"GetVersion 1 {what}"))
    assert done.code == 1
    assert f"lag: fmi{version}GetVersion" in done.err


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (lambda version: {LISTED[version]: ""}, f"{UNLISTED} [structure.outputs"),
        (
            lambda version: {OUTPUT[version]: f'{OUTPUT[version]} unit="bar"'},
            f"{UNDEFINED} [variable.unit",
        ),
    ],
    ids=["output", "unit"],
)
@pytest.mark.parametrize("command", ["run", "simulate", "check"])
def test_an_incomplete_description_is_one_warning(
    fmus, runner, tmp_path, version, changes, text, command
):
    fmu = fmus(version, changes=changes(version))
    words = {"run": ("--output-dir", "out", "--no-report"), "simulate": (), "check": ()}[command]
    done = runner.cosim(
        tmp_path, command, fmu if command == "simulate" else scenario(tmp_path, fmu), *words
    )
    assert done.code == 0, done.err
    lines = [
        line
        for line in (done.err + done.out).splitlines()
        if str(fmu) in line and "modelDescription" in line
    ]
    assert len(lines) == 1
    assert f'"{fmu}": {PLACE[version]}: {text}' in lines[0]
    assert lines[0].endswith("; `cosim validate` lists all findings")


def test_several_findings_are_one_line_per_fmu(fmus, runner, tmp_path, version):
    changes = {LISTED[version]: "", OUTPUT[version]: f'{OUTPUT[version]} unit="bar"'}
    fmu = fmus(version, changes=changes)
    file = scenario(
        tmp_path, fmu, components={name: {"fmu": str(fmu)} for name in ("lag", "other")}
    )
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report")
    (line,) = done.err.splitlines()
    assert line.startswith(f'WARNING "{fmu}": {PLACE[version]}: {UNDEFINED}')
    assert line.endswith(", and 1 more; `cosim validate` lists all findings")
    found = runner.cosim(tmp_path, "validate", fmu)
    assert found.code == 2
    assert UNDEFINED in found.out
    assert UNLISTED in found.out
    assert f'WARNING "{fmu}"' not in found.err


def test_other_findings_are_left_to_the_validation(fmus, runner, tmp_path, version):
    """An initial unknown that is not listed changes no result."""
    listed = {
        2: '<InitialUnknowns><Unknown index="2"/></InitialUnknowns>',
        3: '<InitialUnknown valueReference="2"/>',
    }
    fmu = fmus(version, changes={listed[version]: ""})
    done = runner.cosim(
        tmp_path, "run", scenario(tmp_path, fmu), "--output-dir", "out", "--no-report"
    )
    assert (done.code, done.err) == (0, "")
    assert "structure.initial-unknowns" in runner.cosim(tmp_path, "validate", fmu).out
