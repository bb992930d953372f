"""Pictures of the onboard camera: positions of objects in them and times of the files."""

from itertools import product

import matplotlib.image
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_harness import SensorHarness, with_parameters

from cosim.core.errors import InputError
from plant_src.sensors.camera import Camera

WIDTH, HEIGHT, ANGLE = 160, 120, 0.8
FOCAL = HEIGHT / 2 / np.tan(ANGLE / 2)


@pytest.fixture
def camera(tmp_path):
    made = []

    def make(attitude=None, position=(0, 0, 5.0), parameters=None, **arguments):
        arguments = {
            "vehicles": {"uav": "ar_drone"},
            "carrier": "uav",
            "size": [WIDTH, HEIGHT],
        } | arguments
        made.append(
            with_parameters(
                Camera("eye", folder=str(tmp_path / "frames"), **arguments), **parameters or {}
            )
        )
        x, y, z, w = (attitude or Rotation.identity()).as_quat()
        return SensorHarness(made[-1], uav__position=position, uav__orientation=(w, x, y, z))

    yield make
    for component in made:
        component.free()


def box(corner_low, corner_high):
    low, high = np.array(corner_low), np.array(corner_high)
    return {"size": (high - low).tolist(), "position": ((low + high) / 2).tolist()}


def changed(trial, empty):
    """Pixels (n, 2), right and down, in which two pictures differ."""
    rows, columns = np.nonzero((trial.component.render() != empty.component.render()).any(axis=2))
    return np.stack([columns, rows], axis=1)


@pytest.mark.parametrize("tilt", [0.0, 0.5])
def test_a_deck_is_where_a_pinhole_camera_sees_it(camera, tilt):
    attitude, position = Rotation.from_euler("ZYX", [0.7, 0.1, -0.15]), np.array([0.0, 0.0, 5.0])
    deck = box((0.6, -0.4, 0.49), (1.4, 0.9, 0.5))
    pose = {
        "attitude": attitude,
        "position": position,
        "parameters": {"tilt": tilt, "mounting": [0.1, 0, -0.05]},
    }
    found = changed(camera(platforms={"deck": deck}, **pose), camera(**pose))
    ahead, right = np.array([np.sin(tilt), 0, -np.cos(tilt)]), np.array([0, -1.0, 0])
    axes = np.stack([right, np.cross(ahead, right), ahead])
    corners = np.array([*product((0.6, 1.4), (-0.4, 0.9), (0.5,))])
    seen = axes @ (attitude.inv().apply(corners - position) - (0.1, 0, -0.05)).T
    pixels = FOCAL * seen[:2] / seen[2] + np.array([[WIDTH / 2], [HEIGHT / 2]])
    low, high = np.maximum(pixels.min(axis=1), 0), np.minimum(pixels.max(axis=1), (WIDTH, HEIGHT))
    top = found[found[:, 1] <= high[1] + 1]  # the posts below it reach down to the water
    assert top.min(axis=0) == pytest.approx(low, abs=2)
    assert (top.max(axis=0) + 1)[0] >= high[0] - 2


def test_other_vehicles_are_drawn_but_not_the_carrier(camera):
    both = {"vehicles": {"uav": "ar_drone", "usv": "strider"}}
    alone = camera()
    assert len(changed(alone, camera(vehicles={"uav": "strider"}))) == 0
    assert len(changed(camera(**both), alone)) > 20


def test_level_ahead_the_horizon_is_in_the_middle(camera):
    picture = camera(parameters={"tilt": np.pi / 2}).component.render().astype(float)
    jump = np.abs(np.diff(picture.mean(axis=(1, 2))))
    water = camera().component.render().reshape(-1, 3).mean(axis=0)
    assert (picture[-1].mean(axis=0) - water)[0] == pytest.approx(0, abs=12)
    assert jump[HEIGHT // 2 - 12 : HEIGHT // 2 + 2].max() == jump.max()


def test_files_are_written_at_the_rate(camera, tmp_path):
    trial = camera(parameters={"rate": 5.0}).step(50)
    files = sorted(path.name for path in (tmp_path / "frames").iterdir())
    assert files == [f"eye_{n:04d}.png" for n in range(3)]
    assert (trial["frames"], trial["time"]) == (3.0, pytest.approx(0.4))
    assert matplotlib.image.imread(tmp_path / "frames" / files[-1]).shape == (HEIGHT, WIDTH, 4)


def test_the_same_pose_gives_the_same_picture(camera):
    pictures = [
        camera(vehicles={"uav": "ar_drone", "usv": "strider"}).component.render().tobytes()
        for _ in range(2)
    ]
    assert pictures[0] == pictures[1]


def test_all_invalid_arguments_are_reported_together():
    with pytest.raises(InputError) as caught:
        Camera("eye", {"uav": "ar_dron"}, "usv", "frames", {"start": {"size": [1, 2, 3]}}, [0, 10])
    assert {problem.subject[1] for problem in caught.value.problems} == {
        "vehicles",
        "carrier",
        "platforms",
        "size",
    }
