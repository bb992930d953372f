"""`cosim new scenario`: a scenario that extends another one and runs at once, from any folder."""

import json

import pytest
from cosim_command import run_cosim


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("new scenario")


def test_a_copy_of_a_shipped_scenario_runs_anywhere(folder):
    done = run_cosim(
        "new", "scenario", "my_wind", "--from", "demo1_wind", "--directory", "deep/er", cwd=folder
    )
    assert done.returncode == 0, done.stderr
    file = folder / "deep/er/my_wind.json"
    assert json.loads(file.read_text()) == {
        "extends": "demo1_wind",
        "name": "my_wind",
        "description": "demo1_wind with changes",
    }
    file.write_text(json.dumps({**json.loads(file.read_text()), "stop_time": 1.0, "checks": None}))
    done = run_cosim("run", "deep/er/my_wind.json", "--no-report", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "runs/my_wind/result.csv").is_file()


def test_a_file_is_extended_by_its_relative_path(folder):
    (folder / "base.json").write_text(json.dumps({"extends": "demo1_box", "name": "base"}))
    done = run_cosim(
        "new", "scenario", "other", "--from", "base.json", "--directory", "sub", cwd=folder
    )
    assert done.returncode == 0, done.stderr
    assert json.loads((folder / "sub/other.json").read_text())["extends"] == "../base.json"


def test_existing_files_and_wrong_names_are_refused(folder):
    (folder / "there.json").write_text("mine")
    for arguments, text in (
        (("there", "--from", "demo1_box"), "there.json: exists; --force overwrites it"),
        (("a/b", "--from", "demo1_box"), '"a/b" is not a name of a scenario'),
        (
            ("new", "--from", "demo1_bax"),
            'no shipped scenario "demo1_bax"; did you mean "demo1_box"?',
        ),
    ):
        done = run_cosim("new", "scenario", *arguments, cwd=folder)
        assert done.returncode == 2
        assert text in done.stderr
    assert (folder / "there.json").read_text() == "mine"
