"""`cosim compare` in a real process."""

import json

import numpy as np
import pytest
from cosim_command import run_cosim
from matplotlib.image import imread

from cosim.core import resources
from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.result import write_run


def cosim(*arguments):
    return run_cosim(*arguments)


def csv(path, offset=0.0, delay=0.0):
    """Write a signal that is constant for 1 s and then a sine."""
    rows = (
        f"{t:.17g},{np.sin(max(t - delay - 1, 0)) + offset:.17g}" for t in np.arange(0, 601) / 100
    )
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(['"time","plant.x"', *rows]) + "\n")
    return path


def test_equal_files_compare_equal(tmp_path):
    done = cosim("compare", csv(tmp_path / "a.csv"), csv(tmp_path / "b.csv"))
    assert (done.returncode, done.stdout) == (0, "1 signal compared, none leaves its tube\n")


def test_a_folder_of_a_run_is_a_result(tmp_path):
    csv(tmp_path / "run" / "result.csv")
    assert cosim("compare", tmp_path / "run", csv(tmp_path / "b.csv")).returncode == 0


def test_a_signal_outside_its_tube_gives_exit_code_3_and_the_time(tmp_path):
    done = cosim(
        "compare", csv(tmp_path / "a.csv", offset=0.2), csv(tmp_path / "b.csv"), "--absolute", "0.1"
    )
    assert done.returncode == 3
    assert done.stderr.splitlines()[0] == "1 of 1 signal failed"
    assert done.stderr.splitlines()[1].startswith(
        "plant.x leaves its tube at t = 0 s: 0.2 is 0.1 above its limit 0.1;"
    )


@pytest.mark.parametrize("name", ["", "result.csv"])
def test_units_of_the_run_are_known_so_that_an_angle_may_jump_by_a_turn(tmp_path, name):
    time = np.arange(0, 10, 0.01)
    yaw = {"plant.yaw": np.angle(np.exp(1j * (time + 1e-3))), "plant.x": time}
    write_run(Result(Recording(time, yaw, {"plant.yaw": "rad", "plant.x": "m"})), tmp_path / "run")
    reference = {"plant.yaw": np.angle(np.exp(1j * time)), "plant.x": time + 1}
    Result(Recording(time, reference, dict.fromkeys(reference, ""))).to_csv(
        tmp_path / "reference.csv"
    )
    done = cosim(
        "compare", tmp_path / "run" / name, tmp_path / "reference.csv", "--absolute", "0.002"
    )
    assert done.stderr.splitlines()[0] == "1 of 2 signals failed"
    assert done.stderr.splitlines()[1].startswith(
        "plant.x leaves its tube at t = 0 s: 0 m is 0.998 m below its limit 0.998 m;"
    )


@pytest.mark.parametrize(("time", "code"), [("0.2", 0), ("0.05", 3)])
def test_a_shift_within_the_tolerance_of_time_is_accepted(tmp_path, time, code):
    shifted, reference = csv(tmp_path / "a.csv", delay=0.1), csv(tmp_path / "b.csv")
    assert (
        cosim("compare", shifted, reference, "--time", time, "--relative", "0.01").returncode
        == code
    )


def test_a_scenario_provides_reference_and_tolerances(tmp_path):
    csv(tmp_path / "reference.csv")
    components = {"a": {"fmu": "a.fmu"}}
    tolerances = {"plant.*": {"absolute": 0.3}}
    scenario = {"name": "s", "stop_time": 6, "step_size": 0.01, "components": components}
    path = tmp_path / "s.json"
    path.write_text(
        json.dumps({**scenario, "reference": {"file": "reference.csv", "tolerances": tolerances}})
    )
    assert cosim("compare", csv(tmp_path / "a.csv", offset=0.2), path).returncode == 0
    assert cosim("compare", csv(tmp_path / "a.csv", offset=0.4), path).returncode == 3
    path.write_text(json.dumps(scenario))
    refused = cosim("compare", tmp_path / "a.csv", path)
    assert (refused.returncode, refused.stderr) == (2, f'{path} has no "reference"\n')


def test_a_shipped_scenario_is_found_by_name():
    shipped = resources.root() / "scenarios/references/free_flight.csv"
    by_name = cosim("compare", shipped, "free_flight")
    assert (by_name.returncode, by_name.stdout) == (
        0,
        "10 signals compared, none leaves its tube\n",
    ), by_name.stderr
    misspelt = cosim("compare", shipped, "free_fligt")
    assert misspelt.returncode == 2
    assert misspelt.stderr.endswith('did you mean "free_flight"?\n')
    missing = cosim("compare", shipped, "runs/free_fligt")
    assert (missing.returncode, missing.stderr) == (
        2,
        "cannot read runs/free_fligt: No such file or directory\n",
    )


def test_the_figure_shows_the_tube_and_the_violations(tmp_path):
    picture = tmp_path / "tubes.png"
    outside = csv(tmp_path / "a.csv", offset=0.2)
    assert (
        cosim(
            "compare", outside, csv(tmp_path / "b.csv"), "--absolute", "0.1", "--plot", picture
        ).returncode
        == 3
    )
    pixels = 255 * imread(picture)[::2, ::2, :3].reshape(-1, 3)
    for colour in (
        (213, 94, 0),
        (204, 227, 240),
    ):  # points outside; a fifth of the reference's blue on white
        assert np.abs(pixels - colour).max(axis=1).min() < 2


def test_the_tube_is_visible_in_the_deviation_where_the_signal_hides_it(tmp_path):
    """A tube of 0.02 around a sine of 2: less than a pixel in the panel of the signal, all of the
    panel of the deviation.
    """
    picture = tmp_path / "tubes.png"
    result, reference = csv(tmp_path / "a.csv", offset=0.005), csv(tmp_path / "b.csv")
    assert (
        cosim("compare", result, reference, "--absolute", "0.01", "--plot", picture).returncode == 0
    )
    tube = np.abs(255 * imread(picture)[:, :, :3] - (204, 227, 240)).max(axis=2) < 2
    left, right = np.array_split(tube[50:], 2, axis=1)
    assert left.mean() < 0.02
    assert right.mean() > 0.3


def test_the_figure_shows_missing_and_non_finite_signals(tmp_path):
    text = csv(tmp_path / "a.csv").read_text().replace("\n1,", "\n1,NaN #", 1)
    broken = tmp_path / "broken.csv"
    broken.write_text("\n".join(line.split(" #")[0] for line in text.splitlines()))
    for result, reference in ((broken, tmp_path / "a.csv"), (tmp_path / "a.csv", broken)):
        picture = tmp_path / f"{result.stem}.png"
        done = cosim("compare", result, reference, "--absolute", "1", "--plot", picture)
        assert (done.returncode, "plant.x is nan at t = 1 s" in done.stderr, picture.exists()) == (
            3,
            True,
            True,
        )
    (tmp_path / "other.csv").write_text("time,y\n0,1\n6,1\n")
    assert (
        cosim(
            "compare", tmp_path / "other.csv", tmp_path / "a.csv", "--plot", tmp_path / "none.svg"
        ).returncode
        == 3
    )
    assert (tmp_path / "none.svg").exists()


def test_an_unreadable_file_is_refused(tmp_path):
    missing = cosim("compare", tmp_path / "none.csv", csv(tmp_path / "b.csv"))
    assert (missing.returncode, "none.csv" in missing.stderr) == (2, True)
    assert (
        cosim("compare", tmp_path / "b.csv", tmp_path / "b.csv", "--plot", "x.pdf").returncode == 2
    )


@pytest.mark.parametrize(
    ("option", "value"),
    [("absolute", "nan"), ("relative", "inf"), ("time", "nan"), ("time", "-1.0")],
)
def test_an_invalid_tolerance_is_refused(tmp_path, option, value):
    done = cosim(
        "compare",
        csv(tmp_path / "a.csv", offset=0.2),
        csv(tmp_path / "b.csv"),
        f"--{option}",
        value,
    )
    message = f'tolerance of "*": "{option}" is {value}, expected a finite number of at least 0\n'
    assert (done.returncode, done.stderr) == (2, message)
