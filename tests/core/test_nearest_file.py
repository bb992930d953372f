"""Hints at files with similar names."""

from pathlib import Path

import pytest

import cosim
from cosim.core.errors import nearest_file


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("rooom.fmu", '; did you mean "room.fmu"?'),
        ("room", '; did you mean "room.fmu"?'),
        ("house", '; did you mean "house.fmu"?'),
        ("tether", ""),
        ("room.py", '; no *.py in "{folder}"'),
        ("x/room.fmu", '; there is no folder "{folder}/x"'),
        ("x/../../y/room.fmu", '; there is no folder "{folder.parent}/y"'),
    ],
)
def test_the_most_similar_file_of_the_folder_is_named(tmp_path, name, hint):
    for present in ("room.fmu", "house.fmu"):
        (tmp_path / present).touch()
    assert nearest_file(tmp_path / name) == hint.format(folder=tmp_path)


def test_without_a_similar_name_the_files_of_the_folder_are_named(tmp_path):
    for present in ("tether.fmu", "house.fmu", "tether.py"):
        (tmp_path / present).touch()
    assert nearest_file(tmp_path / "ropes.fmu") == f'; files in "{tmp_path}": house.fmu, tether.fmu'


def test_the_folder_of_a_relative_path_is_absolute(tmp_path, monkeypatch):
    (tmp_path / "house.fmu").touch()
    (tmp_path / "inner").mkdir()
    monkeypatch.chdir(tmp_path / "inner")
    assert nearest_file(Path("../tether.fmu")) == f'; files in "{tmp_path}": house.fmu'
    assert nearest_file(Path("room.fmu")) == f'; no *.fmu in "{tmp_path / "inner"}"'


def test_a_missing_fmu_and_a_missing_scenario_are_refused_with_the_hint(tmp_path):
    (tmp_path / "room.fmu").touch()
    (tmp_path / "heating.json").touch()
    for missing, near in (("romm.fmu", "room.fmu"), ("heatng.json", "heating.json")):
        with pytest.raises(cosim.InputError, match=f'did you mean "{near}"'):
            (cosim.simulate if missing.endswith(".fmu") else cosim.run)(tmp_path / missing)
