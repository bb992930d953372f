"""FMU files: opened with a binary for this machine, examined and extracted once in a process."""

import ctypes
import os
import shutil
from pathlib import Path
from zipfile import ZipFile

import pytest

import cosim
from cosim.components.fmi import file as fmu_file
from cosim.components.fmi import open_fmu


@pytest.fixture
def fmu(tmp_path, probes):
    """Return a copy of an FMU that no test has used yet."""
    return Path(shutil.copy(probes[2], tmp_path / "probe.fmu"))


@pytest.fixture
def work(monkeypatch):
    """Functions that were called for FMU files."""
    calls = []
    for name in ("examine", "extract"):
        function = getattr(fmu_file, name)
        monkeypatch.setattr(
            fmu_file, name, lambda *args, f=function, n=name: (calls.append(n), f(*args))[1]
        )
    return calls


def simulate(fmu):
    return cosim.simulate(fmu, stop_time=0.05, step_size=0.01)


def idle_folder(fmu):
    key = fmu_file.FmuFile(fmu)._key
    return fmu_file._idle_folders.get(key)


def test_the_second_run_repeats_nothing(fmu, work):
    results = [simulate(fmu) for _ in range(3)]
    assert work == ["examine", "extract"]
    assert len({result["y"].tobytes() for result in results}) == 1


def test_a_changed_file_is_read_again_even_with_the_same_size_and_times(fmu, work):
    simulate(fmu)
    status = fmu.stat()
    with ZipFile(fmu, "a") as archive:
        archive.comment = b"changed"
    os.utime(fmu, ns=(status.st_atime_ns, status.st_mtime_ns))
    simulate(fmu)
    assert work == ["examine", "extract"] * 2


def test_a_folder_in_which_a_file_has_changed_is_not_used_again(fmu, work):
    simulate(fmu)
    folder = Path(idle_folder(fmu).folder.name)
    (folder / "modelDescription.xml").write_bytes((folder / "modelDescription.xml").read_bytes())
    simulate(fmu)
    assert work == ["examine", "extract", "extract"]
    assert not folder.exists()


def only_file(simulation):
    (file,) = simulation.prepared.component_factory.fmus.values()
    return file


def test_simulations_at_the_same_time_have_folders_of_their_own(fmu):
    document = {
        "name": "two",
        "stop_time": 0.05,
        "step_size": 0.01,
        "components": {"a": {"fmu": str(fmu)}},
    }
    with cosim.load(document) as first, cosim.load(document) as second:
        first.step()
        second.step()
        folders = {only_file(each)._folder.name for each in (first, second)}
    assert len(folders) == 2


def test_a_library_that_stays_loaded_is_loaded_from_another_folder(fmu):
    with cosim.load(
        {
            "name": "one",
            "stop_time": 0.05,
            "step_size": 0.01,
            "components": {"a": {"fmu": str(fmu)}},
        }
    ) as simulation:
        simulation.step()
        library = only_file(simulation).library.dll._name
        kept = ctypes.CDLL(library)
    assert idle_folder(fmu) is None
    assert kept


def test_an_fmu_with_a_binary_is_opened_as_it_is(fmu):
    opened = open_fmu(fmu, None, lambda _: pytest.fail("nothing has to be added"))
    assert (opened.path, opened.has_binary) == (fmu, True)


@pytest.mark.parametrize("is_possible", [True, False])
def test_an_fmu_without_a_binary_is_replaced_by_a_copy_that_has_one(fmu, tmp_path, is_possible):
    bare = tmp_path / "bare.fmu"
    with ZipFile(fmu) as whole, ZipFile(bare, "w") as part:
        for name in whole.namelist():
            if not name.startswith("binaries/"):
                part.writestr(name, whole.read(name))
    asked = []

    def add_binary(file):
        asked.append(file.path)
        return fmu if is_possible else None

    opened = open_fmu(bare, "co-simulation", add_binary)
    assert asked == [bare]
    assert opened.path == (fmu if is_possible else bare)
    assert opened.description.interface == "co-simulation"
