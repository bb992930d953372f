"""FMU archives: contents and reproducibility."""

from __future__ import annotations

import subprocess
from dataclasses import replace
from zipfile import ZipFile

import pytest
from fmpy import read_model_description, simulate_fmu

from cosim.core.errors import InputError
from cosim.export.fmu.compiler import find_compiler
from cosim.export.fmu.package import write_archive, write_fmu


def test_the_same_block_gives_the_same_bytes(block, version, fmu, tmp_path):
    again = write_fmu(block, version, tmp_path / "elsewhere" / "renamed.fmu")
    assert again.read_bytes() == fmu.read_bytes()


def test_another_model_has_another_token(make_block, version, fmu, tmp_path):
    other = write_fmu(make_block(("return 2 * x", "return 3 * x")), version, tmp_path / "other.fmu")
    assert read_model_description(other).guid != read_model_description(fmu).guid


def test_the_binary_is_in_the_folder_that_the_standard_defines(version, fmu):
    from fmpy import platform, platform_tuple, sharedLibraryExtension

    with ZipFile(fmu) as archive:
        folder = platform if version == 2 else platform_tuple
        assert f"binaries/{folder}/sample{sharedLibraryExtension}" in archive.namelist()


def test_resources_are_packed_under_their_names(block, tmp_path):
    original = tmp_path / "Sample.mo"
    original.write_text("model Sample end Sample;")
    fmu = write_fmu(
        replace(block, resources={"Fleet/Sample.mo": original}), 2, tmp_path / "sample.fmu"
    )
    with ZipFile(fmu) as archive:
        assert archive.read("resources/Fleet/Sample.mo") == original.read_bytes()


def test_archives_do_not_depend_on_order_clock_or_umask(tmp_path):
    first = write_archive({"b": b"2", "a": b"1"}, tmp_path / "first.fmu")
    second = write_archive({"a": b"1", "b": b"2"}, tmp_path / "second.fmu")
    assert first.read_bytes() == second.read_bytes()
    with ZipFile(first) as archive:
        assert [
            (m.filename, m.date_time, oct(m.external_attr >> 16)) for m in archive.infolist()
        ] == [
            ("a", (1980, 1, 1, 0, 0, 0), "0o100644"),
            ("b", (1980, 1, 1, 0, 0, 0), "0o100644"),
        ]


def test_an_archive_is_written_atomically(tmp_path):
    write_archive({"a": b"1"}, tmp_path / "x.fmu")
    assert [path.name for path in tmp_path.iterdir()] == ["x.fmu"]


def test_fmi2_and_fmi3_compute_the_same(block, tmp_path):
    results = []
    for version in (2, 3):
        fmu = write_fmu(block, version, tmp_path / f"{version}.fmu")
        run = {"vehicle.position.x": 0.3, "gain": 1.7}
        results.append(
            simulate_fmu(str(fmu), stop_time=2.0, output_interval=0.01, start_values=run)
        )
    assert len(results[0]) == 201
    assert [row["outputs[2]"] for row in results[0]] == [row["outputs"][1] for row in results[1]]


def test_errors_of_the_compiler_name_file_and_line(make_block, tmp_path):
    broken = make_block(("m->clock = time;", "m->clock = tme;"))
    with pytest.raises(InputError, match=r"sample: model\.c:\d+:\d+: error: .*tme"):
        write_fmu(broken, 2, tmp_path / "broken.fmu")
    assert not (tmp_path / "broken.fmu").exists()


def test_a_missing_model_function_is_found_when_linking(make_block, tmp_path):
    with pytest.raises(InputError, match=r"sample: .*undefined reference to `model_step'"):
        write_fmu(
            make_block(("const char *model_step", "const char *model_stop")),
            2,
            tmp_path / "broken.fmu",
        )


def test_a_missing_compiler_is_reported_with_a_hint(block, tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(
        InputError,
        match=r"needs a C compiler, but none was found .*no-such-compiler.*; install gcc or set CC",
    ):
        write_fmu(block, 2, tmp_path / "sample.fmu")


def test_an_unknown_fmi_version_is_refused(block, tmp_path):
    with pytest.raises(InputError, match="found FMI version 1, expected 2 or 3"):
        write_fmu(block, 1, tmp_path / "sample.fmu")


def test_the_binary_depends_only_on_its_libraries(fmu, tmp_path):
    """A C program can load it with immediate binding: its libraries define all symbols."""
    with ZipFile(fmu) as archive:
        library = archive.extract(
            next(name for name in archive.namelist() if name.startswith("binaries/")), tmp_path
        )
    host = tmp_path / "host.c"
    host.write_text(
        "#include <dlfcn.h>\nint main(int n, char **v) { return dlopen(v[n - 1], RTLD_NOW) ? 0 : "
        "1; }\n"
    )
    subprocess.run([*find_compiler(), str(host), "-o", str(tmp_path / "host"), "-ldl"], check=True)
    assert subprocess.run([tmp_path / "host", library], check=False).returncode == 0
