"""FMUs with sources but without a binary for this machine are compiled when they are used."""

from __future__ import annotations

from pathlib import Path
from zipfile import ZipFile

import pytest
from ball_fmus import SOURCE, description_1, model_description
from cosim_command import run_cosim

#: macro of the source that sets the FMI version; the prefix is that of tools whose sources add one by themselves
MAIN = "#define FMI {version}\n#if !defined FMI2_FUNCTION_PREFIX && !defined NO_FUNCTION_PREFIX\n"
MAIN += "#define FMI2_FUNCTION_PREFIX ball_\n"
MAIN += '#endif\n#include "ball.c"\n'
BUILD = """<?xml version="1.0"?><fmiBuildDescription fmiVersion="3.0">
<BuildConfiguration modelIdentifier="ball" platform="x86_64-windows">
<SourceFileSet><SourceFile name="none.c"/></SourceFileSet>
</BuildConfiguration>
<BuildConfiguration modelIdentifier="ball"><SourceFileSet language="C99"><SourceFile name="ball.c"/>
<PreprocessorDefinition name="FMI" value="3"/></SourceFileSet></BuildConfiguration></fmiBuildDescription>"""


#: sources of FMI 1.0 include the headers of the standard, which add the prefix to the names of functions
OLD = """#define MODEL_IDENTIFIER ball
#include "fmiFunctions.h"
#ifndef FMI_COSIMULATION
#error no macro
#endif
fmiStatus fmiResetSlave(fmiComponent c) { return fmiOK; }
fmiStatus ball_fmiSetDebugLogging(fmiComponent c, fmiBoolean on) { return on ? fmiResetSlave(c) : fmiWarning; }
"""


def write_source_fmu(path: Path, version: int, sources: dict[str, str], files: str = "") -> Path:
    text = description_1("CS") if version == 1 else model_description(version)
    description = text.replace('="true"/>\n<DefaultE', f'="true">{files}</ModelExchange>\n<DefaultE')
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
    "FMI 1.0": (1, {"main.c": MAIN.format(version=1), "ball.c": SOURCE.read_text(), "old.c": OLD}, ""),
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
    (tmp_path / "s.json").write_text('{"name": "s", "stop_time": 1, "step_size": 0.1, "components": {"b": {"fmu": "ball.fmu"}}}')
    done = run_cosim("run", "s.json", "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done
    assert '"ball.fmu"' in (tmp_path / "runs/s/run.json").read_text()


@pytest.mark.parametrize(
    ("sources", "files", "message"),
    [
        ({"ball.c": "int main( {"}, "", "cannot be compiled: ball.c:1:"),
        ({"ball.c": "double f(void); double g(void) { return f(); }"}, "", "undefined reference to `f'"),
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
