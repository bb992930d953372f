"""Runs in one process examine and extract an FMU once, and notice when its content changes."""

import ctypes
import os
import shutil
from pathlib import Path
from zipfile import ZipFile

import pytest

import cosim
from cosim.components.fmi import file as fmu_file


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
