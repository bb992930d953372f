"""FMUs for Windows run under Wine; the DLLs are compiled for the tests."""

from __future__ import annotations

import subprocess
from pathlib import Path
from zipfile import ZipFile

import pytest
from ball_fmus import HEADERS, SOURCE, build_ball_fmu, description_1, model_description
from probe_fmus import PROBE_SOURCES, build_probe_fmu

import cosim
from cosim.core.errors import InputError
from cosim.export.foreign.windows_fmus import find_windows_compiler, find_wine


def _windows_compiler() -> list[str]:
    try:
        return find_windows_compiler()
    except InputError:
        return []


pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        not find_wine() or not _windows_compiler(), reason="needs Wine and a C compiler for Windows"
    ),
]


def windows_fmu(
    target: Path, folder: str, identifier: str, source: Path, description: str, *options: str
) -> Path:
    library = target.with_suffix(".dll")
    command = [
        *_windows_compiler(),
        "-shared",
        "-O2",
        "-w",
        "-Wl,--export-all-symbols",
        *options,
        f"-I{HEADERS}",
    ]
    subprocess.run([*command, str(source), "-o", str(library)], check=True)
    with ZipFile(target, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.write(library, f"binaries/{folder}/{identifier}.dll")
    return target


@pytest.fixture(
    scope="session",
    params=[(1, "CS"), (1, "ME"), (2, "ME"), (3, "ME")],
    ids=lambda value: "".join(map(str, value)),
)
def pair(request, tmp_path_factory):
    """The same FMU for Windows and for this machine."""
    version, interface = request.param
    folder = tmp_path_factory.mktemp("windows")
    description = description_1(interface) if version == 1 else model_description(version)
    platform = "x86_64-windows" if version == 3 else "win64"
    own = build_ball_fmu(version, folder, interface)
    return windows_fmu(
        folder / "windows.fmu", platform, "ball", SOURCE, description, f"-DFMI={version}"
    ), own


def test_the_results_are_those_of_a_native_library(pair):
    settings = {"start_values": {"u": 0.5, "i_in": 3}, "output": ["x", "h", "v", "count", "i_out"]}
    windows, native = (cosim.simulate(path, **settings) for path in pair)
    assert {name: windows[name].tolist() for name in windows} == {
        name: native[name].tolist() for name in native
    }


@pytest.mark.parametrize("isolation", ["none", "fmu"])
def test_a_crash_is_one_line_and_keeps_the_rows(pair, isolation):
    if pair[1].name == "ball1CS.fmu":
        pytest.skip("the slave has no such fault")
    with pytest.raises(
        cosim.ComponentError,
        match=r"exception 0xC0000005 \(access violation\) in the Windows library",
    ) as failed:
        cosim.simulate(pair[0], start_values={"fault": 5}, isolation=isolation)
    assert len(failed.value.result.time) > 10


@pytest.mark.parametrize("version", [2, 3])
def test_values_of_all_types_and_log_messages(version, tmp_path):
    description = (PROBE_SOURCES / f"probe{version}.xml").read_text()
    folder = "win64" if version == 2 else "x86_64-windows"
    windows = windows_fmu(
        tmp_path / "probe.fmu", folder, "probe", PROBE_SOURCES / f"probe{version}.c", description
    )
    native = build_probe_fmu(version, tmp_path)
    outputs = [
        v.name
        for v in cosim.components.fmi.FmuFile(native).description.variables
        if v.causality == "output"
    ]
    results = [cosim.simulate(path, output=outputs) for path in (windows, native)]
    under_wine, natively = results
    assert list(under_wine) == list(natively)
    for name in natively:
        assert under_wine[name].tolist() == natively[name].tolist()
    for path in (windows, native):
        with pytest.raises(cosim.ComponentError, match="told to fail, 100%s sure"):
            cosim.simulate(path, start_values={"fail_time": 0.5})


def test_binaries_and_structural_parameters(tmp_path):
    description = (PROBE_SOURCES / "shapes.xml").read_text()
    path = windows_fmu(
        tmp_path / "shapes.fmu", "x86_64-windows", "probe", PROBE_SOURCES / "shapes.c", description
    )
    result = cosim.simulate(path, start_values={"n": 2, "m": [[1, 2], [3, 4]], "b_in": "00ff"})
    assert result["b_out"].tolist()[-1] == b"\x00\xff"
    assert [result[f"y[{i}]"].tolist()[-1] for i in (1, 2)] == [3.0, 7.0]


def test_a_library_without_the_functions_is_refused(tmp_path):
    source = tmp_path / "empty.c"
    source.write_text("__declspec(dllexport) int nothing(void) { return 0; }")
    with pytest.raises(InputError, match="the library does not export fmi2"):
        cosim.simulate(
            windows_fmu(tmp_path / "e.fmu", "win64", "ball", source, model_description(2))
        )


#: case -> C code behind that of the FMU, and part of the message
LOADING = {
    "a crash": (
        "int __stdcall DllMain(void *a, unsigned b, void *c) { return *(volatile int *)8; }",
        "it crashed while it was loaded",
    ),
    "a refusal": (
        "int __stdcall DllMain(void *a, unsigned b, void *c) { return 0; }",
        "its initialization failed",
    ),
}


@pytest.mark.parametrize("case", LOADING)
def test_a_library_that_cannot_be_loaded_gives_the_reason(case, tmp_path):
    code, reason = LOADING[case]
    source = tmp_path / "ball.c"
    source.write_text(f"{SOURCE.read_text()}\n{code}\n")
    path = windows_fmu(
        tmp_path / "ball.fmu", "win64", "ball", source, model_description(2), "-DFMI=2"
    )
    with pytest.raises(
        cosim.ComponentError,
        match=f"the Windows library cannot be loaded: error [0-9]+ \\({reason}\\)$",
    ):
        cosim.simulate(path)


def test_a_library_that_ends_its_process_is_one_line_and_keeps_the_rows(tmp_path):
    path = windows_fmu(
        tmp_path / "ball.fmu", "win64", "ball", SOURCE, model_description(2), "-DFMI=2"
    )
    for fault in (391, 392):
        with pytest.raises(
            cosim.ComponentError, match="the Windows process ended in fmi2GetDerivatives"
        ) as failed:
            cosim.simulate(path, start_values={"fault": fault})
        assert len(failed.value.result.time) > 10


@pytest.mark.parametrize(
    "content",
    [b"MZ" + bytes(5000), b"\x7fELF" + bytes(5000), b""],
    ids=["zeros", "another format", "empty"],
)
def test_a_damaged_library_is_refused(content, tmp_path):
    path = tmp_path / "ball.fmu"
    with ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", model_description(2))
        archive.writestr("binaries/win64/ball.dll", content)
    with pytest.raises(InputError, match=r"ball.dll"):
        cosim.simulate(path)
