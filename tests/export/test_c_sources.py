"""Export of C controllers with a hand-written model description."""

from __future__ import annotations

import shutil
from pathlib import Path
from zipfile import ZipFile

import pytest
from cosim_command import run_cosim
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

from cosim.core.errors import InputError
from cosim.core.resources import root
from cosim.export.build import build, build_to, read_manifest
from cosim.export.build_check import check_fmus
from cosim.export.fmu_sources import find_sources

pytestmark = pytest.mark.slow

KEEPER = root() / "controllers/c/speed_keeper"


@pytest.fixture
def folder(tmp_path):
    """Return a copy of the shipped controller that a test can modify."""
    return Path(shutil.copytree(KEEPER, tmp_path / "controllers/c/keeper"))


@pytest.fixture
def description(folder):
    return folder / "modelDescription.xml"


def replace(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_the_fmu_is_valid_and_contains_its_sources(folder, tmp_path):
    replace(folder / "speed_keeper.c", '#include "fmi2Functions.h"', '#include "own.h"')
    (folder / "own.h").write_text('#include "fmi2Functions.h"\n')
    (folder / "notes.txt").write_text("not for others")
    fmu = build_to(folder, None, tmp_path / "keeper.fmu")
    assert validate_fmu(str(fmu)) == []
    headers = {"fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"}
    with ZipFile(fmu) as archive:
        sources = {
            name.removeprefix("sources/")
            for name in archive.namelist()
            if name.startswith("sources/")
        }
        assert (
            archive.read("modelDescription.xml") == (folder / "modelDescription.xml").read_bytes()
        )
    assert sources == {"speed_keeper.c", "own.h", *headers}


def test_the_same_sources_give_the_same_bytes(folder, tmp_path):
    first, second = (
        build_to(source, None, tmp_path / f"{source.name}.fmu") for source in (folder, KEEPER)
    )
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.skipif(shutil.which("cmake") is None, reason="needs cmake")
def test_the_fmu_can_be_rebuilt_from_its_sources_alone(folder, tmp_path):
    fmu = build_to(folder, None, tmp_path / "keeper.fmu")
    unpacked = Path(extract(str(fmu), str(tmp_path / "unpacked")))
    shutil.rmtree(unpacked / "binaries")
    build_platform_binary(unpacked, generator="Unix Makefiles")
    assert simulate_fmu(str(unpacked), stop_time=0.1, output=["thrust"])["thrust"][-1] == 3.0


def test_several_files_are_compiled_together(folder, description, tmp_path):
    replace(
        folder / "speed_keeper.c",
        "static double clamp(double value, double limit) {",
        "double clamp(double, double); /*",
    )
    replace(folder / "speed_keeper.c", "fmax(-limit, fmin(limit, value)); }", "*/")
    (folder / "clamp.c").write_text(
        "double clamp(double value, double limit) { return value < limit ? value : limit / 2; }\n"
    )
    replace(
        description,
        '<File name="speed_keeper.c"/>',
        '<File name="speed_keeper.c"/><File name="clamp.c"/>',
    )
    fmu = build_to(folder, None, tmp_path / "keeper.fmu")
    assert simulate_fmu(str(fmu), stop_time=0.1, output=["thrust"])["thrust"][-1] == 1.5


def test_a_built_fmu_is_in_the_manifest_and_passes_the_check(folder, description, tmp_path):
    (built,) = build([folder], tmp_path)
    assert built.fmus == {2: tmp_path / "fmus/c/keeper.fmu"}
    entry = read_manifest(tmp_path)["c/keeper"]
    assert list(entry["sources"]) == [
        "controllers/c/keeper/modelDescription.xml",
        "controllers/c/keeper/speed_keeper.c",
    ]
    assert set(entry["tools"]) == {"fmpy", "compiler"}
    assert check_fmus(tmp_path) == []
    replace(description, "Keeps a speed", "Keeps one speed")
    assert [str(problem) for problem in check_fmus(tmp_path)] == [
        (
            'controllers/c/keeper/modelDescription.xml: changed since "c/keeper" was built; run '
            "`cosim build`"
        )
    ]


def test_every_folder_is_found_and_named_after_itself(folder, tmp_path):
    shutil.copytree(folder, folder.with_name("other"))
    assert [source.manifest_key for source in find_sources(tmp_path)] == ["c/keeper", "c/other"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            'name="speed_keeper.c"',
            'name="speed_kepper.c"',
            r'"speed_kepper\.c"> does not exist; did you mean "speed_keeper\.c"',
        ),
        (
            '<SourceFiles>\n      <File name="speed_keeper.c"/>\n    </SourceFiles>',
            "",
            "names no file in <CoSimulation><SourceFiles>",
        ),
        ('fmiVersion="2.0"', 'fmiVersion="3.0"', r'found fmiVersion "3\.0", expected "2\.0"'),
        ("<ModelStructure>", "<ModelStructure", "cannot be read: not well-formed"),
        ('index="13"', 'index="11"', "ModelStructure/Outputs"),
    ],
)
def test_a_faulty_description_is_refused(folder, description, tmp_path, old, new, message):
    replace(description, old, new)
    with pytest.raises(InputError, match=rf"(?s)modelDescription\.xml: .*{message}"):
        build_to(folder, None, tmp_path / "keeper.fmu")
    assert not (tmp_path / "keeper.fmu").exists()


def test_model_exchange_alone_is_refused(folder, description, tmp_path):
    text = description.read_text()
    before, after = (
        text[: text.index("<CoSimulation")],
        text[text.index("</CoSimulation>") + len("</CoSimulation>") :],
    )
    description.write_text(f'{before}<ModelExchange modelIdentifier="keeper"/>{after}')
    with pytest.raises(InputError, match=r"modelDescription\.xml: has no <CoSimulation>"):
        build_to(folder, None, tmp_path / "keeper.fmu")


def test_compiler_errors_are_shown_with_their_line(folder, tmp_path):
    replace(
        folder / "speed_keeper.c", "#include <math.h>", "#include <math.h>\nint wrong = thrust;"
    )
    with pytest.raises(
        InputError, match=r"speed_keeper: speed_keeper\.c:8:\d+: error: .thrust. undeclared"
    ):
        build_to(folder, None, tmp_path / "keeper.fmu")


def test_a_missing_function_is_named(folder, tmp_path):
    replace(
        folder / "speed_keeper.c",
        "static double clamp(",
        "extern double clamp(double, double);\nstatic double unused(",
    )
    with pytest.raises(InputError, match="undefined reference to `clamp'"):
        build_to(folder, None, tmp_path / "keeper.fmu")


def cosim(*arguments, cwd):
    return run_cosim(*arguments, cwd=cwd)


def test_the_command_builds_a_source_in_any_folder(folder, tmp_path):
    done = cosim("build", folder, "--output", "there/keeper.fmu", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"{folder} -> there/keeper.fmu\n")
    assert validate_fmu(str(tmp_path / "there/keeper.fmu")) == []


PACKAGE = """package Pilots
  block DeckPilot
    input Real u;
    output Real y = 2*u;
  end DeckPilot;
  block Other
    extends DeckPilot;
  end Other;
end Pilots;"""


def test_the_command_builds_a_model_of_a_package_in_a_file(tmp_path):
    (tmp_path / "Pilots.mo").write_text(PACKAGE)
    done = cosim("build", "Pilots.mo:Pilots.DeckPilot", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "Pilots.mo:Pilots.DeckPilot -> deck_pilot.fmu\n")
    assert read_model_description(tmp_path / "deck_pilot.fmu").modelName == "deck_pilot"
    done = cosim("build", "Pilots.mo", "--output", "x.fmu", cwd=tmp_path)
    assert done.stderr.endswith(
        "no model with the name Pilots, but Pilots.DeckPilot, Pilots.Other; write "
        "Pilots.mo:Pilots.DeckPilot\n"
    )


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        ((), "an FMU of your own requires one source, found 0"),
        (("nothing.mo:Pilot",), "nothing.mo: does not exist"),
        ((".",), ".: cannot be exported"),
    ],
)
def test_the_command_refuses_a_folder_that_is_not_a_source(tmp_path, sources, message):
    done = cosim("build", *sources, "--output", "x.fmu", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(message)
