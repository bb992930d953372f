"""FMUs with sources but without a binary for this machine are compiled when they are used."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import pytest
from ball_fmus import SOURCE, description_1, model_description
from cosim_command import run_cosim

from cosim.components.fmi import open_fmu
from cosim.core.errors import InputError
from cosim.export.foreign import add_binary

#: macro of the source that sets the FMI version; the prefix is that of tools whose sources add one
#: by themselves
MAIN = "#define FMI {version}\n#if !defined FMI2_FUNCTION_PREFIX && !defined NO_FUNCTION_PREFIX\n"
MAIN += "#define FMI2_FUNCTION_PREFIX ball_\n"
MAIN += '#endif\n#include "ball.c"\n'
BUILD = """<?xml version="1.0"?><fmiBuildDescription fmiVersion="3.0">
<BuildConfiguration modelIdentifier="ball" platform="x86_64-windows">
<SourceFileSet><SourceFile name="none.c"/></SourceFileSet>
</BuildConfiguration>
<BuildConfiguration modelIdentifier="ball"><SourceFileSet language="C99"><SourceFile name="ball.c"/>
<PreprocessorDefinition name="FMI" value="3"/></SourceFileSet></BuildConfiguration>
</fmiBuildDescription>"""


#: sources of FMI 1.0 include the headers of the standard, which add the prefix to the names of
#: functions
OLD = """#define MODEL_IDENTIFIER ball
#include "fmiFunctions.h"
#ifndef FMI_COSIMULATION
#error no macro
#endif
fmiStatus fmiResetSlave(fmiComponent c) { return fmiOK; }
fmiStatus ball_fmiSetDebugLogging(fmiComponent c, fmiBoolean on) {
  return on ? fmiResetSlave(c) : fmiWarning;
}
"""


def write_source_fmu(path: Path, version: int, sources: dict[str, str], files: str = "") -> Path:
    text = description_1("CS") if version == 1 else model_description(version)
    description = text.replace(
        '="true"/>\n<DefaultE', f'="true">{files}</ModelExchange>\n<DefaultE'
    )
    with ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        for name, text in sources.items():
            archive.writestr(f"sources/{name}", text)
    return path


@pytest.fixture(autouse=True)
def cache(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


#: case -> FMI version, files in sources/, list of source files in the model description
FMUS = {
    "listed files": (
        2,
        {"main.c": MAIN.format(version=2), "ball.c": SOURCE.read_text(), "readme.txt": ""},
        '<SourceFiles><File name="main.c"/></SourceFiles>',
    ),
    "no list": (2, {"main.c": MAIN.format(version=2), "ball.c": SOURCE.read_text()}, ""),
    "FMI 1.0": (
        1,
        {"main.c": MAIN.format(version=1), "ball.c": SOURCE.read_text(), "old.c": OLD},
        "",
    ),
    "build description": (3, {"ball.c": SOURCE.read_text(), "buildDescription.xml": BUILD}, ""),
}


@pytest.mark.parametrize("case", FMUS)
def test_sources_are_compiled_once_and_cached(case, cache, tmp_path):
    fmu = write_source_fmu(tmp_path / "ball.fmu", *FMUS[case])
    first = run_cosim("simulate", fmu)
    assert (first.returncode, "count = 8" in first.stdout) == (0, True), first
    (compiled,) = cache.rglob("ball.fmu")
    written = compiled.stat().st_mtime_ns
    assert run_cosim("simulate", fmu).stdout == first.stdout
    assert compiled.stat().st_mtime_ns == written


def test_a_scenario_compiles_its_fmus(tmp_path):
    write_source_fmu(tmp_path / "ball.fmu", *FMUS["no list"])
    (tmp_path / "s.json").write_text(
        '{"name": "s", "stop_time": 1, "step_size": 0.1, "components": {"b": {"fmu": "ball.fmu"}}}'
    )
    done = run_cosim("run", "s.json", "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done
    assert '"ball.fmu"' in (tmp_path / "runs/s/run.json").read_text()


@pytest.mark.parametrize(
    ("sources", "files", "message"),
    [
        ({"ball.c": "int main( {"}, "", "cannot be compiled: ball.c:1:"),
        (
            {"ball.c": "double f(void); double g(void) { return f(); }"},
            "",
            "undefined reference to `f'",
        ),
        (
            {"ball.c": ""},
            '<SourceFiles><File name="bal.c"/></SourceFiles>',
            'its source file "bal.c" does not exist; did you mean "ball.c"?',
        ),
    ],
)
def test_sources_that_cannot_be_compiled_are_refused_in_one_line(sources, files, message, tmp_path):
    done = run_cosim("simulate", write_source_fmu(tmp_path / "ball.fmu", 2, sources, files))
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
    assert message in done.stderr


BUILT = (
    "<fmiBuildDescription><BuildConfiguration "
    'modelIdentifier="{}">{}</BuildConfiguration></fmiBuildDescription>'
)
ONE_FILE = '<SourceFileSet><SourceFile name="{}"/></SourceFileSet>'
DEFINITION = (
    '<SourceFileSet><PreprocessorDefinition name="A; touch pwned" value="$(touch '
    'pwned)"/></SourceFileSet>'
)
GOOD = SOURCE.read_text()

#: case -> sources and the message
BAD_SOURCES = {
    "several errors": (
        {"ball.c": "int x = nowhere;\nint y = nobody;"},
        "cannot be compiled: ball.c:1:.* \\(and 1 more\\)$",
    ),
    "a header that does not exist": ({"ball.c": '#include "none.h"'}, "ball.c:1:.*none.h"),
    "a platform that it refuses": (
        {"ball.c": '#error "needs a real-time clock"'},
        "needs a real-time clock",
    ),
    "functions defined twice": (
        {"a.c": "int f(void) { return 1; }", "b.c": "int f(void) { return 2; }"},
        "multiple definition of",
    ),
    "assembly that includes a device": (
        {"ball.c": '__asm__(".incbin \\"/dev/zero/none\\"");'},
        "Error: .*dev/zero",
    ),
    "C++ without a list of files": (
        {"ball.cpp": "class A {};"},
        "names no source files, and found no C files; found: .cpp$",
    ),
    "a file that includes itself": ({"ball.c": '#include "ball.c"'}, "names no source files"),
    "a build description that is not XML": (
        {"ball.c": GOOD, "buildDescription.xml": "<fmi"},
        "is not well-formed XML",
    ),
    "a file outside of the FMU": (
        {
            "ball.c": GOOD,
            "buildDescription.xml": BUILT.format("ball", ONE_FILE.format("../../etc/passwd")),
        },
        'its source file "../../etc/passwd" does not exist',
    ),
    "a file with the name of an option": (
        {
            "-o": "x",
            "ball.c": "int x;",
            "buildDescription.xml": BUILT.format("ball", ONE_FILE.format("-o")),
        },
        "cannot be compiled: .*syntax error",
    ),
    "a definition with a command": (
        {
            "ball.c": "int x;",
            "buildDescription.xml": BUILT.format("ball", DEFINITION + ONE_FILE.format("ball.c")),
        },
        "the library does not export fmi3",
    ),
    "a library of another name": (
        {
            "ball.c": "int x;",
            "buildDescription.xml": BUILT.format("bell", ONE_FILE.format("ball.c")),
        },
        "ball.so does not exist; found: .*bell.so",
    ),
}


@pytest.mark.parametrize("case", BAD_SOURCES)
def test_bad_sources_are_one_problem(case, tmp_path):
    sources, message = BAD_SOURCES[case]
    path = write_source_fmu(tmp_path / "ball.fmu", 3, sources)
    with pytest.raises(InputError, match=message) as refused:
        open_fmu(path, None, add_binary).check_binary()
    assert len(str(refused.value).splitlines()) == 1
    assert [path.name for path in tmp_path.rglob("pwned")] == []
